"""What the verdict says of chains of public samplers: the table of docs/others.md.

    pip install './python' gerrychain tomotopy arviz-stats
    python python/examples/others.py

Four chains of each, as long as a hasty user would run them and longer. Prints Markdown.
"""

from __future__ import annotations

import random
import warnings
from functools import partial

import networkx
import numpy as np
import topometric as tm

N_CHAINS = 4


def districts(how: str, n_draws: int, every: int) -> list[np.ndarray]:
    """GerryChain on a grid of 10 x 10 precincts in four districts: ReCom, or single flips."""
    from gerrychain import Graph, MarkovChain, Partition, accept, constraints, proposals, updaters

    # GerryChain counts places from 0: row by row.
    grid = networkx.convert_node_labels_to_integers(
        networkx.grid_2d_graph(10, 10), ordering="sorted"
    )
    for place in grid:
        grid.nodes[place]["pop"] = 1
    graph = Graph.from_networkx(grid)
    starts = {
        "columns": lambda place: (place // 10) * 4 // 10,
        "rows": lambda place: (place % 10) * 4 // 10,
        "squares": lambda place: 2 * (place // 50) + place % 10 // 5,
    }
    chains = []
    for seed, start in enumerate(["columns", "rows", "squares", "squares"]):
        random.seed(seed)
        np.random.seed(seed)
        first = Partition(
            graph,
            {place: starts[start](place) for place in range(100)},
            updaters={
                "population": updaters.Tally("pop", alias="population"),
                "cut_edges": updaters.cut_edges,
            },
        )
        proposal = proposals.propose_random_flip
        if how == "recom":
            proposal = partial(
                proposals.recom, pop_col="pop", pop_target=25, epsilon=0.2, node_repeats=0
            )
        chain = MarkovChain(
            proposal_fn=proposal,
            constraints=[
                constraints.within_percent_of_ideal_population(first, 0.25),
                constraints.contiguous,
            ],
            acceptance_fn=accept.always_accept,
            initial_partition=first,
            total_steps=n_draws * every,
        )
        drawn = [
            [state.assignment[place] for place in range(100)]
            for step, state in enumerate(chain)
            if step % every == 0
        ]
        chains.append(np.array(drawn))
    return chains


def topics(n_topics: int, n_draws: int, every: int, shared: float) -> list[np.ndarray]:
    """tomotopy's collapsed Gibbs sampler of LDA: which words of 40 short texts share a topic."""
    import tomotopy

    rng = np.random.default_rng(1)
    texts = []
    for number in range(40):
        own = [f"w{number % 3}{letter}" for letter in "abcdef"]
        common = [f"c{letter}" for letter in "abcdef"]
        words = [str(rng.choice(common if rng.random() < shared else own)) for _ in range(12)]
        texts.append(words)
    chains = []
    for seed in range(N_CHAINS):
        model = tomotopy.LDAModel(k=n_topics, alpha=0.3, eta=0.1, seed=seed + 1)
        model.optim_interval = 0
        for words in texts:
            model.add_doc(words)
        model.train(0)
        drawn = []
        for _ in range(n_draws):
            model.train(every, workers=1)
            drawn.append([topic for text in model.docs for topic in text.topics])
        chains.append(np.array(drawn))
    return chains


def mixture(n_draws: int, gap: float) -> list[np.ndarray]:
    """Neal's algorithm 3 for a Dirichlet process mixture, thirty points in two groups."""
    rng = np.random.default_rng(2)
    points = np.concatenate([rng.normal(size=15), gap + rng.normal(size=15)])

    def sweep(labels: np.ndarray) -> None:
        for i in rng.permutation(len(points)):
            labels[i] = -1
            sets, sizes = np.unique(labels[labels >= 0], return_counts=True)
            sums = np.array([points[labels == k].sum() for k in sets])
            precision = 1 / 25 + np.append(0, sizes)
            mean = np.append(0, sums) / precision
            variance = 1 / precision + 1
            weight = np.log(np.append(1.0, sizes)) - 0.5 * np.log(variance)
            weight -= (points[i] - mean) ** 2 / (2 * variance)
            weight = np.exp(weight - weight.max())
            choice = rng.choice(len(weight), p=weight / weight.sum())
            labels[i] = labels.max() + 1 if choice == 0 else sets[choice - 1]

    chains = []
    for start in (np.arange(30), np.zeros(30, int), np.repeat([0, 1], 15), np.arange(30) % 3):
        labels = start.copy()
        drawn = []
        for _ in range(n_draws):
            sweep(labels)
            drawn.append(labels.copy())
        chains.append(np.array(drawn))
    return chains


def plain(chains: list[np.ndarray]) -> str:
    """What ArviZ says of the number of sets: R-hat and bulk ESS."""
    try:
        from arviz_stats import ess, rhat
    except ImportError:
        return "–"
    n_sets = np.array([[len(set(draw)) for draw in chain] for chain in chains], float)
    if np.ptp(n_sets) == 0:
        return f"M is always {n_sets[0, 0]:.0f}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return f"R-hat {rhat(n_sets, method='rank'):.3f}, ESS {ess(n_sets, method='bulk'):.0f}"


def main() -> None:
    """Prints the table."""
    runs = [
        ("GerryChain, ReCom", "200 draws", lambda: districts("recom", 200, 1)),
        ("GerryChain, ReCom", "3,000 draws", lambda: districts("recom", 3000, 1)),
        (
            "GerryChain, single flips",
            "2,000 draws, every 20th",
            lambda: districts("flip", 2000, 20),
        ),
        ("tomotopy, LDA", "1,000 draws", lambda: topics(4, 1000, 1, 0.2)),
        ("tomotopy, LDA, texts alike", "5,000 draws", lambda: topics(3, 5000, 1, 0.8)),
        ("DP mixture, groups 6 σ apart", "2,000 sweeps", lambda: mixture(2000, 6.0)),
        ("DP mixture, groups 2.5 σ apart", "2,000 sweeps", lambda: mixture(2000, 2.5)),
    ]
    print("| chains | length | ArviZ of M | verdict | R-hat at most | ESS at least | first doubt |")
    print("|---|---|---|---|---|---|---|")
    for name, length, draw in runs:
        chains = draw()
        found = tm.diagnose(chains)
        judged = found.convergence["judged"] if found.convergence else []
        r_hats = [own["r_hat"]["value"] for own in judged if own["r_hat"]["value"] is not None]
        ess = [own["ess"]["value"] for own in judged if own["ess"]["value"] is not None]
        cells = [
            name,
            length,
            plain(chains),
            found.verdict,
            f"{max(r_hats):.3f}" if r_hats else "–",
            f"{min(ess):.0f}" if ess else "–",
            found.doubts[0] if found.doubts else "–",
        ]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
