"""The JSON Schema of sweep files: takes every shipped sweep, refuses every file slip*.toml.

    python3 tests/scripts/schema_check.py SCHEMA SWEEPS FOLDER_OF_SLIPS
"""

import json
import pathlib
import sys

schema, sweeps, slips = map(pathlib.Path, sys.argv[1:])
try:
    import jsonschema
    import tomllib
except ImportError as missing:
    print(f"SKIPPED: {missing}")
    sys.exit()

validator = jsonschema.Draft202012Validator(json.loads(schema.read_text(encoding="utf-8")))
validator.check_schema(validator.schema)


def errors(path):
    return list(validator.iter_errors(tomllib.loads(path.read_text(encoding="utf-8"))))


shipped = sorted(sweeps.glob("*.toml"))
assert len(shipped) > 8, shipped
for path in shipped:
    assert not errors(path), (path, errors(path))
wrong = sorted(slips.glob("slip*.toml"))
assert len(wrong) == 6, wrong
for path in wrong:
    assert errors(path), path
print(f"the schema agrees on {len(shipped)} sweeps and {len(wrong)} slips")
