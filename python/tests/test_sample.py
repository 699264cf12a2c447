"""Samples: the program's numbers and pictures, ArviZ, Polars, pandas, networkx."""

import json
import math
import pickle
import sys

import numpy as np
import pytest
import topometric as tm
from conftest import interrupted, needs

SETTINGS = {"penalty_radius": 3, "samples": 3000, "seed": 5}


def test_eight_lines_from_numpy_to_a_verdict_and_a_picture(pairs):
    found = tm.sample(pairs, **SETTINGS)
    assert found.labels("map").tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert found.converged and found.verdict == "exact"
    assert "converged" in str(found)
    assert found.png()[:8] == b"\x89PNG\r\n\x1a\n"
    assert found.svg().startswith("<")
    assert found._repr_mimebundle_()["image/png"]


def test_a_seed_gives_the_programs_numbers_and_picture_to_the_last_bit(pairs, tmp_path, ptm):
    data = tm.Detections(pairs)
    (tmp_path / "pairs.csv").write_text(data.to_csv())
    flags = "--penalty-radius 3 --samples 3000 --seed 5 --json out.json --figure out.png"
    ptm("-q", "sample", "pairs.csv", *flags.split())
    theirs = json.loads((tmp_path / "out.json").read_text())
    found = tm.sample(data, **SETTINGS)
    ours = dict(found.result)
    for timed in ("seconds", "proposals_per_second"):
        assert ours.pop(timed) > 0 and theirs.pop(timed) > 0
    # The program knows the file, Python has an array.
    assert theirs["settings"].pop("detections") == "pairs.csv"
    assert ours["settings"].pop("detections") == ""
    assert json.loads(json.dumps(ours)) == theirs
    assert found.png("pairs.csv") == (tmp_path / "out.png").read_bytes()


def test_arviz_agrees_to_1e_9(pairs):
    needs("arviz_base"), needs("xarray")
    stats = needs("arviz_stats")
    if not hasattr(stats, "summary"):
        pytest.skip("arviz-stats is installed without its extra xarray")
    found = tm.sample(pairs + 0.4 * np.random.default_rng(1).normal(size=pairs.shape), **SETTINGS)
    tree = found.to_datatree()
    theirs = {
        "n_sets": stats.summary(tree, var_names=["n_sets"], round_to="none").loc["n_sets"],
        "ln_target": stats.summary(
            tree, var_names=["lp"], group="sample_stats", round_to="none"
        ).loc["lp"],
    }
    values = {"n_sets": found.n_sets, "ln_target": found.ln_target}
    n_compared = 0
    for name, row in theirs.items():
        ours = found.convergence[name]
        tail = float(stats.ess(values[name], method="tail", prob=(0.05, 0.95)))
        # ArviZ's summary takes the tails at 5.5 %, the paper (Vehtari et al. 2021) and we at 5 %.
        for what, value_of_theirs in (
            ("mean", row["mean"]),
            ("r_hat", row["r_hat"]),
            ("ess_bulk", row["ess_bulk"]),
            ("ess_tail", tail),
        ):
            value = ours[what]["value"]
            # We say why a number is undefined where ArviZ gives some number.
            if value is None:
                assert ours[what]["state"] != "defined"
                continue
            n_compared += 1
            assert math.isclose(value, float(value_of_theirs), rel_tol=1e-9), (
                name,
                what,
                value,
                value_of_theirs,
            )
    assert n_compared >= 5


def test_draws_are_those_of_the_series(pairs):
    found = tm.sample(pairs, **SETTINGS)
    draws = found.draws(most=10_000)
    assert draws.shape[:2] == found.n_sets.shape and draws.shape[2] == len(pairs)
    assert np.array_equal(draws.max(axis=2) + 1, found.n_sets)
    # The share of draws in which two detections are together is the co-clustering.
    together = (draws[..., :, None] == draws[..., None, :]).mean(axis=(0, 1))
    assert np.allclose(together, found.co_clustering, atol=0.02)
    assert found.draws(most=7).shape[1] <= 7


def test_tables_and_maps(pairs, tmp_path):
    found = tm.sample(pairs, **SETTINGS)
    polars, pandas, networkx = needs("polars"), needs("pandas"), needs("networkx")
    needs("pyarrow")
    assert isinstance(found.to_polars(), polars.DataFrame)
    frame = found.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == found.n_sets.size
    graph = found.map("vi")
    assert isinstance(graph, networkx.Graph) and graph.number_of_nodes() == 4
    assert graph.nodes[0]["members"] == [0, 1]
    assert np.allclose(graph.nodes[0]["pos"], pairs[:2].mean(axis=0))
    with pytest.raises(tm.Error, match="labels: got 3, expected 8"):
        found.map(np.array([0, 0, 1]))
    needs("rerun")
    found.to_rerun(tmp_path / "map.rrd")
    assert (tmp_path / "map.rrd").read_bytes()[:3] == b"RRF"


def test_exact_tune_evaluate(pairs):
    table = tm.exact(pairs[:4], penalty_radius=3)
    assert table["partitions"][0]["labels"] == [0, 0, 1, 1]
    assert math.isclose(sum(row["probability"] for row in table["partitions"]), 1, rel_tol=1e-12)
    world = tm.simulate(seed=3, noise=0.4)
    settings = tm.tune(world, simulate=False)["settings"]
    assert set(settings) == {"sigma_o", "sigma_t", "penalty_radius", "penalty_height"}
    scores = tm.evaluate({"one": world, "two": tm.simulate(seed=4, noise=0.4)}, samples=2000)
    assert [own["name"] for own in scores["data_sets"]] == ["one", "two"]
    with pytest.raises(tm.Error, match="1: got no detection of known landmark"):
        tm.evaluate([tm.Detections(pairs)], samples=100)


def test_detections_come_back_as_they_went_in(pairs, tmp_path):
    n = len(pairs)
    covariances = np.tile([[0.2, 0.05], [0.05, 0.1]], (n, 1, 1))
    names = ["a", "a", "b", "b", None, "c", "c", "c"]
    corners = ["open", "closed", None] + [None] * (n - 3)
    data = tm.Detections(pairs, covariances, np.arange(n), names, corners)
    assert len(data) == n and np.array_equal(data.positions, pairs)
    assert np.array_equal(data.covariances, covariances)
    assert data.landmarks.tolist() == [0, 0, 1, 1, -1, 2, 2, 2]
    assert data.landmark_names == ["a", "b", "c"]
    assert data.corners[:3] == ["open", "closed", None]
    (tmp_path / "data.csv").write_text(data.to_csv())
    unknown = tm.Detections(pairs, covariances, np.full(n, np.nan), [2**40] * n)
    assert np.isnan(unknown.times).all() and unknown.landmark_names == []
    again = tm.Detections.read_csv(tmp_path / "data.csv")
    assert again.to_csv() == data.to_csv()
    assert tm.sample(tmp_path / "data.csv", samples=200).detections.to_csv() == data.to_csv()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda z: tm.sample(z, sigma_0=1), "sigma_0: no such setting; did you mean sigma_o"),
        (lambda z: tm.sample(z, sigma_o=0), "sigma_o: got 0, expected a number > 0"),
        (
            lambda z: tm.sample(z[:, :1]),
            r"positions: got shape \(8, 1\), expected an array \(n, 2\)",
        ),
        (lambda z: tm.sample("nothing.csv"), "nothing.csv: cannot be read"),
        (lambda z: tm.sample(z, model="covariance"), "model: got detections without covariances"),
        (lambda z: tm.sample(z * np.nan), "x"),
        (lambda z: tm.sample(z, samples=[1]), "samples: got a list, expected a number or a text"),
        (lambda z: tm.Detections(z, landmarks=[1]), "landmarks: got 1, expected 8"),
        (lambda z: tm.Detections(z, corners=["round"] * 8), "corners: got"),
        (lambda z: tm.exact(np.zeros((13, 2))), "got 13 detections, expected at most 12"),
        (lambda z: tm.sample(z, world="office"), "world: no setting of sample"),
        (lambda z: tm.sample(z * 1j), "positions: got complex numbers"),
        (lambda z: tm.sample(None), "positions: got None"),
        (lambda z: tm.simulate(sigma_o=1), "sigma_o: no setting of simulate"),
        (lambda z: tm.simulate(replicate=0), "replicate: got 0, expected a whole number from 1"),
        (lambda z: tm.exact(z, tolerance=0), "tolerance: got 0, expected a number > 0"),
        (lambda z: tm.tune(z, sensor_noise=-1), "sensor_noise: got -1"),
        (lambda z: tm.evaluate({}), "data: got none"),
        (lambda z: tm.settings("nope"), "section: got 'nope'"),
        (lambda z: tm.Detections(z, times=[1, 2]), r"times: got shape \(2,\)"),
        (lambda z: tm.Detections(z, landmarks=3), "landmarks: got an array of 0 dimensions"),
        (lambda z: tm.Detections(z, landmarks=[2**63] * 8), "landmarks: got numbers of 2"),
        (lambda z: tm.tune(z, model="cubic"), "model: got"),
    ],
)
def test_whatever_is_wrong_is_one_line(pairs, wrong, words):
    with pytest.raises(tm.Error, match=words) as raised:
        wrong(pairs)
    assert "\n" not in str(raised.value)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are others there")
@pytest.mark.parametrize(
    "job",
    [
        "tm.sample(z[:60], samples=1e11)",
        "tm.exact(z[:9] / 9, tolerance=1e-9, max_draws=1e14, penalty_radius=3)",
        "tm.tune(z)",
    ],
)
def test_ctrl_c_ends_a_long_job(job):
    complaint = interrupted(f"""
        import numpy as np, topometric as tm
        z = np.random.default_rng(1).normal(size=(1500, 2)) * 9
        print("begun", flush=True)
        {job}
    """)
    assert "KeyboardInterrupt" in complaint


def test_a_sample_is_the_same_out_of_a_pickle(pairs):
    world = tm.simulate(seed=3, noise=0.4)
    for data in (tm.Detections(pairs), world):
        again = pickle.loads(pickle.dumps(data))
        assert again.to_csv() == data.to_csv() and again.png() == data.png()
        found = tm.sample(data, **SETTINGS)
        again = pickle.loads(pickle.dumps(found))
        assert again.result == found.result and str(again) == str(found)
        assert again.png() == found.png() and again.svg() == found.svg()
        assert np.array_equal(again.ln_target, found.ln_target)
        assert np.array_equal(again.draws(), found.draws())
        assert again.detections.to_csv() == data.to_csv()
    with pytest.raises(tm.Error, match="data: got bytes that version"):
        tm.Detections.__reduce__(world)[0](b"topometric 0.0.0 data")
