"""The draws that `ptm export` writes, read by ArviZ: shapes, and the diagnostics of the sweep's own table.

    python3 tests/scripts/arviz_check.py DRAWS.json REPORT_FOLDER

Ends with code 1 if anything differs. Needs arviz-base and arviz-stats (ArviZ 1.x) or arviz 0.x.
"""

import csv
import json
import math
import pathlib
import sys


def main(draws, folder):
    content = json.loads(pathlib.Path(draws).read_text(encoding="utf-8"))
    try:
        import numpy
    except ImportError:
        print("SKIPPED: no NumPy, no ArviZ")
        return 0
    # Some versions of ArviZ take no lists.
    arrays = lambda group: {key: numpy.asarray(values) for key, values in group.items()}
    groups = {name: arrays(content[name]) for name in ("posterior", "sample_stats")}
    try:
        from arviz_base import from_dict
        from arviz_stats import ess, rhat

        data = from_dict(groups)
    except ImportError:
        try:
            from arviz import ess, from_dict, rhat
        except ImportError:
            print("SKIPPED: no ArviZ")
            return 0
        data = from_dict(**groups)
    attrs = content["attrs"]
    n_sets = data["posterior"]["n_sets"]
    assert n_sets.dims == ("chain", "draw"), n_sets.dims
    assert n_sets.sizes["chain"] == len(attrs["chains"]), n_sets.sizes
    lp = data["sample_stats"]["lp"]
    assert lp.shape == n_sets.shape, lp.shape

    rows = csv.DictReader((pathlib.Path(folder) / "convergence.csv").open(encoding="utf-8", newline=""))
    row = next(r for r in rows if r["cell"] == attrs["cell"] and int(r["world"]) == attrs["world"])
    assert attrs["proposals_left_out"] == int(row["first_proposal"])
    assert attrs["proposals_per_draw"] == 1 and attrs["record_stride"] == 1, "draws are not every proposal: a shorter chain is needed"
    assert n_sets.sizes["draw"] == int(row["n_proposals"]), n_sets.sizes
    n = 0
    for name, values in (("n_sets", n_sets), ("ln_target", lp)):
        theirs = {
            "r_hat": float(rhat(values.values, method="rank")),
            "ess_bulk": float(ess(values.values, method="bulk")),
            "mean": float(values.values.mean()),
        }
        for what, value in theirs.items():
            if row[f"{name}_{what}_state"] != "defined":
                continue
            ours = float(row[f"{name}_{what}"])
            assert math.isclose(ours, value, rel_tol=1e-6), f"{name} {what}: {ours}, ArviZ {value}"
            n += 1
    assert n >= 3, f"only {n} numbers are defined; choose a cell that moves"
    print(f"ArviZ agrees on {n} numbers of {attrs['cell']}")
    return 0


sys.exit(main(*sys.argv[1:]))
