"""Diagnoses of label chains: our own, others', wrong ones."""

import copy
import pickle

import numpy as np
import pytest
import topometric as tm
from conftest import needs


def lazy(rng, n_draws: int, stay: int) -> np.ndarray:
    """Independent draws of two partitions of six items, each `stay` times."""
    forms = np.array([[0, 0, 1, 1, 2, 2], [0, 0, 0, 1, 1, 1]])
    return np.repeat(forms[rng.integers(2, size=n_draws)], stay, axis=0)


def test_our_own_draws_get_the_verdict_of_the_sample(pairs):
    sampled = tm.sample(pairs, penalty_radius=3, samples=4000, seed=2, burn_in=400, exact_up_to=0)
    found = tm.diagnose(sampled.draws(most=4000), burn_in=0)
    assert found.result["topologies"] == sampled.result["topologies"]
    assert np.array_equal(found.co_clustering, sampled.co_clustering)
    assert found.labels("vi").tolist() == sampled.labels("vi").tolist()
    for quantity in ("n_sets", "at_map", "map_distance"):
        ours, theirs = found.convergence[quantity], sampled.convergence[quantity]
        for what in ("r_hat", "ess_bulk", "mean"):
            assert np.isclose(ours[what]["value"], theirs[what]["value"], rtol=1e-12), (
                quantity,
                what,
            )


@pytest.mark.parametrize("stay", [1, 5, 20])
def test_a_known_ess_is_found(stay):
    rng = np.random.default_rng(stay)
    n_draws = 200
    # One estimate scatters by some 10 %, the mean of sixteen by 3 %.
    sets = [np.stack([lazy(rng, n_draws, stay) for _ in range(4)]) for _ in range(16)]
    found = [tm.diagnose(chains, burn_in=0).convergence for chains in sets]
    ess = np.mean([own["n_sets"]["ess_bulk"]["value"] for own in found])
    assert ess == pytest.approx(4 * n_draws, rel=0.1)


def test_labels_in_any_form_are_one_chain():
    rng = np.random.default_rng(3)
    chains = np.stack([lazy(rng, 300, 2) for _ in range(3)])
    first = tm.diagnose(chains).result

    def same(result):
        rows = [{k: v for k, v in own.items() if k != "name"} for own in result["chains"]]
        return rows, result["topologies"], result["convergence"]["judged"]

    names = np.array(["b", "a", "c"])
    for form in (
        chains.astype(np.uint8),
        chains.astype(np.int16),
        chains.astype(">i4"),
        chains.astype(float),
        list(chains),
        names[chains],
        names[chains].astype(object),
        -7 * chains,
        chains * 10**15,
    ):
        assert same(tm.diagnose(form).result) == same(first)
    mixed = tm.diagnose(np.array([[[1, "1", "a"]] * 300], dtype=object)).result
    assert mixed["topologies"][0]["labels"] == [0, 1, 2], "a number and a text are two labels"
    single = tm.diagnose(chains[0])
    assert len(single.result["chains"]) == 1 and not single.converged


def test_weights_ragged_lengths_and_files(tmp_path):
    rng = np.random.default_rng(4)
    forms = [lazy(rng, 150, 1) for _ in range(2)]
    weights = [rng.integers(1, 5, size=150) for _ in range(2)]
    shortest = min(int(own.sum()) for own in weights)
    repeated = [np.repeat(form, weight, axis=0)[:shortest] for form, weight in zip(forms, weights)]
    weighted = tm.diagnose(forms, weights=weights)
    assert weighted.result["topologies"] == tm.diagnose(repeated).result["topologies"]
    assert weighted.n_left_out == sum(int(own.sum()) for own in weights) - 2 * shortest
    files = []
    for number, own in enumerate(repeated):
        files.append(tmp_path / f"chain{number}.csv")
        header = ",".join(f"i{k}" for k in range(6))
        np.savetxt(files[-1], own, fmt="%d", delimiter=",", header=header, comments="")
    assert tm.diagnose(files).result["topologies"] == weighted.result["topologies"]


def test_two_modes_are_two_answers_and_a_picture():
    rng = np.random.default_rng(5)
    found = tm.diagnose(np.stack([lazy(rng, 500, 1) for _ in range(4)]))
    assert found.converged
    assert [row["n_sets"] for row in found.representatives] in ([2, 3], [3, 2])
    assert sum(row["weight"] for row in found.representatives) == pytest.approx(1)
    assert found.png()[:4] == b"\x89PNG" and "probability" in found.svg()
    assert "Several answers" in found.html("Two <modes>") and "Two &lt;modes&gt;" in found.html(
        "Two <modes>"
    )
    # Chains that never leave one mode each do not agree.
    stuck = np.stack(
        [np.tile(lazy(rng, 1, 1), (500, 1))[:, [0, 1, 2, 3, 4, 5]] for _ in range(2)]
        + [np.tile([0, 1, 2, 3, 4, 5], (500, 1))]
    )
    assert not tm.diagnose(stuck).converged


def tree_of(chains: np.ndarray):
    """Label vectors as a sampler might leave them: dimensions in another order, other variables."""
    xarray = needs("xarray")
    labels = (("draw", "cell", "chain"), chains.transpose(1, 2, 0))
    n_sets = (("chain", "draw"), chains.max(axis=2) + 1)
    posterior = xarray.Dataset({"z": labels, "n_sets": n_sets})
    stats = xarray.Dataset({"lp": (("chain", "draw"), np.zeros(chains.shape[:2]))})
    return xarray.DataTree.from_dict({"sample_stats": stats, "posterior": posterior})


def test_what_arviz_holds_is_judged_as_the_array_that_it_is(pairs):
    rng = np.random.default_rng(6)
    chains = np.stack([lazy(rng, 300, 2) for _ in range(3)])
    expected = tm.diagnose(chains).result
    tree = tree_of(chains)
    posterior = tree["posterior"].to_dataset()
    for held in (tree, posterior, posterior["z"], posterior.rename(z="labels")):
        assert tm.diagnose(held).result == expected
    assert tm.diagnose(tree, variable="z").result == expected
    # ln target beside it, as an array of its own.
    lp = tree["sample_stats"]["lp"].transpose("draw", "chain")
    assert tm.diagnose(tree, ln_target=lp).result == expected
    assert not tm.diagnose(posterior["z"].isel(chain=0)).converged
    for held, more, words in (
        (tree, {"variable": "labels"}, "labels: got no variable 'labels', expected variable= one"),
        (posterior[["n_sets"]], {}, r"held \(n_sets\)"),
        (posterior["n_sets"], {}, r"labels: got dimensions \(chain, draw\)"),
        (chains, {"variable": "z"}, "variable: got 'z' beside a ndarray"),
        (tree, {"ln_target": posterior["z"]}, "z: got dimensions"),
    ):
        with pytest.raises(tm.Error, match=words):
            tm.diagnose(held, **more)
    # Our own tree has the draws of `draws()` in it.
    sampled = tm.sample(pairs, penalty_radius=3, samples=2000, exact_up_to=0)
    ours = tm.diagnose(sampled.to_datatree())
    assert ours.result == tm.diagnose(sampled.draws()).result


def test_a_diagnosis_is_the_same_out_of_a_pickle():
    rng = np.random.default_rng(7)
    ragged = [lazy(rng, n, 1) for n in (400, 390, 410)]
    for found in (tm.diagnose(ragged), tm.diagnose(ragged[:1]), tm.diagnose(np.arange(8)[None, :])):
        for again in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
            assert again.result == found.result and str(again) == str(found)
            assert np.array_equal(again.co_clustering, found.co_clustering)
            assert again.png() == found.png() and again.html() == found.html()
            assert again.n_left_out == found.n_left_out
    large = np.zeros((2, 50, 1500), int)
    large[:, ::2, :3] = 1
    found = tm.diagnose(large)
    assert np.array_equal(pickle.loads(pickle.dumps(found)).co_clustering, found.co_clustering)


def test_doubts_speak_of_draws_and_of_no_setting_of_ours():
    # All begin with one topology, and are at rest or not.
    rng = np.random.default_rng(8)
    same = np.stack([lazy(rng, 400, 1) for _ in range(4)])
    same[:, 0] = [0, 0, 1, 1, 2, 2]
    doubts = tm.diagnose(same, burn_in=0).doubts
    assert any(own.startswith("all chains begin with the same topology") for own in doubts), doubts
    late = np.zeros((2, 1000, 4), int)
    late[0, :400, 0], late[1, :300, 1] = 1, 1
    doubts += tm.diagnose(late, burn_in=400).doubts
    assert not any("init" in own or "proposal" in own or "probe" in own for own in doubts), doubts


@pytest.mark.parametrize(
    ("labels", "more", "words"),
    [
        (np.zeros((2, 2, 2, 2), int), {}, "labels: got shape"),
        (
            np.full((1, 5, 3), 0.5),
            {},
            "labels of chain 1: got numbers of dtype float64 that are not whole",
        ),
        ([np.zeros((5, 3), int), np.zeros((5, 4), int)], {}, "chain 2: got 4 labels, expected 3"),
        (np.zeros((2, 5, 3), int), {"weights": np.zeros((2, 5))}, "weights of chain 1"),
        (
            np.zeros((2, 5, 3), int),
            {"ln_target": np.zeros((2, 4))},
            "ln_target of chain 1: got shape",
        ),
        (np.zeros((2, 5, 3), int), {"burn_in": "some"}, "burn_in: got"),
        (np.zeros((2, 5, 3), int), {"burn_in": 5}, "burn-in: got 5, expected auto or less than"),
        (
            np.zeros((2, 5, 3), int),
            {"weights": np.full((2, 5), 2**62)},
            "weights of chain 1: got values",
        ),
        (np.zeros((2, 5, 3), int), {"weights": 2}, "weights: got 2, expected an array"),
        (np.zeros((2, 5, 3), int), {"max_topologies": 0}, "max_topologies: got 0"),
        (np.full((1, 5, 3), np.nan), {}, "labels of chain 1: got NaN"),
        (np.full((1, 5, 3), 1e19), {}, "labels of chain 1: got numbers of dtype float64"),
        (np.full((1, 5, 3), None), {}, "labels of chain 1: got None or NaN"),
        (
            np.ma.masked_equal(np.ones((1, 5, 3), int), 1),
            {},
            "labels of chain 1: got masked labels",
        ),
        (np.zeros((2, 0, 3), int), {}, "labels of chain 1: got shape"),
        ([np.zeros((5, 3), int), np.zeros(3, int)], {}, "labels of chain 2: got shape"),
        ([[1, 2], [1]], {}, "labels: got no array"),
        ("nothing.csv", {"weights": [1]}, "weights: got a value beside files"),
        ("nothing.csv", {}, "nothing.csv: cannot be read"),
    ],
)
def test_what_will_not_do_is_said_in_one_line(labels, more, words):
    with pytest.raises(tm.Error, match=words):
        tm.diagnose(labels, **more)
