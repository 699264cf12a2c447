"""Runs the recipe of docs/tables.md on a trace: its first Python block that reads trace.parquet."""

import os
import re
import sys

trace, docs = sys.argv[1:]
try:
    import numpy  # noqa: F401
    import pandas  # noqa: F401
    import pyarrow  # noqa: F401
except ImportError as missing:
    print(f"SKIPPED: {missing}")
    sys.exit()

blocks = re.findall(r"```python\n(.*?)```", open(docs, encoding="utf-8").read(), re.S)
recipe = next(block for block in blocks if "trace.parquet" in block)
os.chdir(os.path.dirname(trace))
found = {}
exec(recipe, found)
assert found["trace"]["n_proposals"].dtype == "int64", found["trace"].dtypes
assert len(found["n_sets"]) == 2000, len(found["n_sets"])
print("the recipe works")
