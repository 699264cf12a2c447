"""Golden values for src/diagnostics: chain diagnostics from arviz-stats, agreement of partitions from scikit-learn.

    python3.12 -m venv env && env/bin/pip install arviz-stats==1.3.3 scikit-learn==1.9.1 numpy==2.5.5 scipy==1.18.1
    env/bin/python make.py

writes chains.json and partitions.json beside this file. No code of the project is used.
"""

import datetime
import json
import pathlib
import platform

import arviz_stats
import numpy as np
import scipy
import sklearn
from arviz_stats.base import array_stats
from scipy import stats
from scipy.special import betaincinv
from sklearn import metrics
from sklearn.metrics.cluster import pair_confusion_matrix

HERE = pathlib.Path(__file__).parent
MADE_BY = {
    "python": platform.python_version(),
    "arviz_stats": arviz_stats.__version__,
    "numpy": np.__version__,
    "scipy": scipy.__version__,
    "scikit_learn": sklearn.__version__,
    "date": datetime.date.today().isoformat(),
}


def ar1(rng, chains, draws, phi):
    """Stationary AR(1) of unit innovations."""
    noise = rng.standard_normal((chains, draws))
    out = np.empty_like(noise)
    out[:, 0] = noise[:, 0] / np.sqrt(1 - phi**2)
    for t in range(1, draws):
        out[:, t] = phi * out[:, t - 1] + noise[:, t]
    return out


def lazy_integers(rng, chains, draws):
    """Like M: a random walk on 4..11 that mostly stands still."""
    out = np.empty((chains, draws))
    for c in range(chains):
        at = rng.integers(6, 9)
        for t in range(draws):
            if rng.random() < 0.3:
                at = min(11, max(4, at + rng.choice([-1, 1])))
            out[c, t] = at
    return out


def indicator(rng, chains, draws, up, down):
    """A two-state chain of 0 and 1."""
    out = np.empty((chains, draws))
    for c in range(chains):
        at = rng.integers(0, 2)
        for t in range(draws):
            at = at ^ int(rng.random() < (down if at else up))
            out[c, t] = at
    return out


def series():
    rng = np.random.default_rng(20260804)
    yield "normal-1-chain", rng.standard_normal((1, 400))
    yield "normal-2-chains", rng.standard_normal((2, 300))
    yield "normal-4-chains", rng.standard_normal((4, 250))
    yield "normal-8-chains", rng.standard_normal((8, 100))
    yield "normal-4-chains-odd-length", rng.standard_normal((4, 251))
    yield "normal-2-chains-of-9", rng.standard_normal((2, 9))
    for phi in (-0.6, 0.3, 0.9, 0.99):
        yield f"ar1-{phi}", ar1(rng, 4, 300, phi)
    yield "ar1-0.9-1-chain", ar1(rng, 1, 501, 0.9)
    yield "integers-4-chains", lazy_integers(rng, 4, 500)
    yield "integers-3-chains-odd-length", lazy_integers(rng, 3, 333)
    yield "indicator-common", indicator(rng, 4, 300, 0.2, 0.3)
    yield "indicator-uncommon", indicator(rng, 2, 800, 0.03, 0.3)
    yield "cauchy-4-chains", rng.standard_cauchy((4, 250))
    yield "disagree-in-mean", rng.standard_normal((4, 200)) + np.array([[0.0], [0.0], [0.0], [1.5]])
    yield "disagree-in-scale", rng.standard_normal((4, 200)) * np.array([[1.0], [1.0], [1.0], [3.0]])
    yield "drifting", rng.standard_normal((2, 200)) + np.linspace(0, 2, 200)
    one_stuck = rng.standard_normal((3, 100))
    one_stuck[1] = 0.25
    yield "one-of-three-stuck", one_stuck
    yield "constant", np.full((2, 50), 3.0)
    yield "stuck-and-disagree", np.repeat([[3.0], [5.0]], 50, axis=1)


def nested_r_hat(chains, superchains):
    """Margossian et al. (2024), of normal scores, bulk and folded: written from the paper, as arviz has none."""
    superchains = np.asarray(superchains)
    values = []
    for draws in (chains, abs(chains - np.median(chains))):
        ranks = stats.rankdata(draws, method="average").reshape(draws.shape)
        scores = stats.norm.ppf((ranks - 3 / 8) / (draws.size + 1 / 4))
        groups = [scores[superchains == start] for start in np.unique(superchains)]
        between = np.var([group.mean(axis=1).mean() for group in groups], ddof=1)
        within = np.mean([np.var(group.mean(axis=1), ddof=1) + np.var(group, axis=1, ddof=1).mean() for group in groups])
        values.append(np.sqrt(1 + between / within))
    return values


def number(value):
    value = float(value)
    if np.isnan(value):
        return "nan"
    return "inf" if np.isinf(value) else value


def chain_case(name, chains):
    # What is stored is the data: four decimals keep the file small.
    chains = np.round(chains, 4)
    call = {}
    if len(chains) > 1:
        for method, key in (("rank", "r_hat"), ("z_scale", "r_hat_bulk"), ("folded", "r_hat_folded"), ("split", "r_hat_split"), ("identity", "r_hat_identity")):
            call[key] = array_stats.rhat(chains, method=method)
    if len(chains) >= 4:
        call["nested_r_hat_bulk"], call["nested_r_hat_folded"] = nested_r_hat(chains, np.arange(len(chains)) % 2)
    for method in ("bulk", "mean", "sd", "median", "identity", "folded"):
        call[f"ess_{method}"] = array_stats.ess(chains, method=method)
    call["ess_tail"] = array_stats.ess(chains, method="tail", prob=(0.05, 0.95))
    for prob in (0.05, 0.25, 0.95):
        call[f"ess_quantile_{prob}"] = array_stats.ess(chains, method="quantile", prob=prob)
        call[f"mcse_quantile_{prob}"] = array_stats.mcse(chains, method="quantile", prob=prob)
    call["mcse_mean"] = array_stats.mcse(chains, method="mean")
    call["mcse_sd"] = array_stats.mcse(chains, method="sd")
    call["mcse_median"] = array_stats.mcse(chains, method="median")
    return {"name": name, "chains": chains.tolist(), "values": {key: number(value) for key, value in call.items()}}


def partition_case(name, truth, found):
    truth, found = list(map(int, truth)), list(map(int, found))
    homogeneity, completeness, v_measure = metrics.homogeneity_completeness_v_measure(truth, found)
    entropy = lambda labels: stats.entropy(np.unique(labels, return_counts=True)[1])
    mutual = metrics.mutual_info_score(truth, found)
    return {
        "name": name,
        "truth": truth,
        "found": found,
        "adjusted_rand_index": float(metrics.adjusted_rand_score(truth, found)),
        "homogeneity": float(homogeneity),
        "completeness": float(completeness),
        "v_measure": float(v_measure),
        # H(truth) + H(found) - 2 I, in nats; scikit-learn has the mutual information.
        "variation_of_information": float(entropy(truth) + entropy(found) - 2 * mutual),
        # Ordered pairs: [[apart in both, together in found only], [together in truth only, in both]].
        "pair_confusion": pair_confusion_matrix(truth, found).tolist(),
    }


def partitions():
    rng = np.random.default_rng(20260804)
    yield "equal", [0, 0, 1, 1, 2], [5, 5, 3, 3, 9]
    yield "one-split", [0, 0, 1, 1, 2, 2, 3, 3], [0, 0, 1, 1, 1, 2, 3, 3]
    yield "singletons-of-four-pairs", [0, 0, 1, 1, 2, 2, 3, 3], range(8)
    yield "one-cluster-of-four-pairs", [0, 0, 1, 1, 2, 2, 3, 3], [0] * 8
    yield "both-one-cluster", [0] * 6, [0] * 6
    yield "both-singletons", range(6), range(6)
    yield "one-cluster-against-singletons", [0] * 6, range(6)
    yield "one-detection", [0], [0]
    yield "crossed", [0, 0, 0, 1, 1, 1, 2, 2, 2], [0, 1, 2, 0, 1, 2, 0, 1, 2]
    for n, k_truth, k_found in ((30, 5, 5), (30, 3, 12), (200, 40, 25), (200, 8, 190)):
        truth = rng.integers(0, k_truth, n)
        found = np.where(rng.random(n) < 0.7, truth, 1000 + rng.integers(0, k_found, n))
        yield f"random-{n}-{k_truth}-{k_found}", truth, found


def functions():
    """Quantiles of the normal and the beta law."""
    p = [1e-300, 1e-20, 1e-8, 1e-4, 0.01, 0.02425, 0.07, 0.075, 0.3, 0.5, 0.6, 0.9, 0.975, 0.9999, 1 - 1e-10]
    beta = [(a, b, q) for a, b in ((1.0, 1.0), (6.0, 96.0), (21.5, 401.25), (3500.0, 200.0), (50000.5, 50000.5)) for q in (0.1586553, 0.8413447)]
    return {
        "normal_quantile": [[x, float(stats.norm.ppf(x))] for x in p],
        "beta_quantile": [[a, b, q, float(betaincinv(a, b, q))] for a, b, q in beta],
    }


def write(name, content):
    lines = json.dumps({"made_by": MADE_BY, **content}, allow_nan=False)
    # One case a line.
    (HERE / name).write_text(lines.replace('{"name"', '\n{"name"') + "\n")


np.seterr(all="ignore")
write("chains.json", {"cases": [chain_case(*case) for case in series()]})
write("partitions.json", {"cases": [partition_case(*case) for case in partitions()]})
write("functions.json", functions())
