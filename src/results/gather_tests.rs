//! Records made up so that what is gathered of them is known.

use super::cells::outcomes_by_world;
use super::convergence::tests::chain;
use super::draws::draws;
use super::levels::verdicts_by_level;
use super::*;
use crate::run::ChainRecord;

const N_WORLDS: usize = 2;

fn sweep(design: &str) -> Sweep {
    let text = format!("[data]\nreplicates = {N_WORLDS}\n[run]\nchains = 1\n[design]\n{design}");
    Sweep::parse(&text, "a.toml", "a", None).expect("a good sweep")
}

/// One chain for each world, which recovered the truth or not, by cell and world.
fn gathered(sweep: &Sweep, recovered: impl Fn(usize, usize) -> bool) -> SweepResults {
    let plan = Plan::new(sweep).expect("worlds");
    let record = |(cell, task): (usize, &Task)| {
        let mut outcome = chain(&[0; 200], 0, 1);
        outcome.recovered = Some(recovered(cell, task.replicate as usize));
        Some(ChainRecord {
            key: task.key.clone(),
            status: ChainStatus::Done(Box::new(outcome)),
        })
    };
    let records = plan.tasks_of_cells().map(record).collect();
    SweepResults::gather(sweep, &plan, records)
}

/// Of a grid of two by three cells, those at a corner have two neighbours and those between three;
/// siblings count too, and a setting without an order has no neighbours.
#[test]
fn neighbours_in_a_grid_are_a_level_apart_in_one_factor() {
    let ordered = "sigma_o = [1, 2]\nsigma_t = [1, 2, 4]";
    let sweep = sweep(&format!("kind = 'grid'\n[design.factors]\n{ordered}\n"));
    // Cell k recovers the truth in the first k of its worlds, up to both.
    let found = gathered(&sweep, |cell, world| world < cell);
    let expected = [[1, 3].as_slice(), &[0, 2, 4], &[1, 5], &[0, 4]];
    for (cell, own) in expected.iter().enumerate() {
        let mut neighbours = found.around(cell).neighbours.clone();
        neighbours.sort_unstable();
        assert_eq!(neighbours, *own, "{cell}");
    }
    // With another start the posterior is the same: a sibling, of the cell and of its neighbour.
    let starts = super::gather_tests::sweep(
        "kind = 'grid'\n[design.factors]\nsigma_o = [1, 2, 4]\ninit = ['singletons', 'random']\n",
    );
    let by_start = gathered(&starts, |_, _| true);
    let n: Vec<usize> = (0..6)
        .map(|cell| by_start.around(cell).neighbours.len())
        .collect();
    assert_eq!(n, [3, 3, 5, 5, 3, 3]);
    // Where the sampler alone varies, cells are no siblings, and a start has no neighbours.
    let samplers = super::gather_tests::sweep(
        "kind = 'grid'\n[design.factors]\nimportance_samples = [5, 10, 20]\n\
         init = ['singletons', 'random']\n[sampler]\nestimator = 'fresh'\n",
    );
    let by_sampler = gathered(&samplers, |_, _| true);
    for cell in 0..6 {
        let own = &by_sampler.around(cell).neighbours;
        let of = |cell: usize, key: &str| samplers.cells[cell].settings.get(key).clone();
        let is_middle = of(cell, "importance_samples") == crate::settings::Value::Count(10);
        assert_eq!(own.len(), if is_middle { 2 } else { 1 }, "{cell}");
        assert!(
            own.iter()
                .all(|other| of(*other, "init") == of(cell, "init"))
        );
    }
    let of_cell = |cell| outcomes_by_world(found.chains.iter().filter(|own| own.cell == cell));
    assert_eq!(of_cell(0), [[false], [false]]);
    assert_eq!(of_cell(1), [[true], [false]]);
    // Each level of sigma_o has three cells, each of sigma_t two.
    for (factor, n_cells) in [(0, 3), (1, 2)] {
        for level in verdicts_by_level(&sweep, &found.cells, factor) {
            assert_eq!(level.n_all(), n_cells * N_WORLDS);
        }
    }
}

/// In a one-at-a-time design a level has the cells whose other factors are at the baseline.
#[test]
fn levels_of_one_factor_at_a_time_leave_the_others_out() {
    let sweep =
        sweep("kind = 'one-at-a-time'\n[design.factors]\nsigma_o = [1, 2]\nsigma_t = [1, 2, 4]\n");
    let found = gathered(&sweep, |_, _| true);
    for factor in [0, 1] {
        for level in verdicts_by_level(&sweep, &found.cells, factor) {
            assert_eq!(level.n_all(), N_WORLDS);
        }
    }
}

/// Every draw of chains that are short enough is kept, from the latest burn-in on.
#[test]
fn draws_are_those_after_the_latest_burn_in() {
    let at = [0, 1, 1, 2, 0, 3];
    let chains = [chain(&at, 0, 0), chain(&at, 2, 0)];
    let found = draws(&chains.iter().collect::<Vec<_>>()).expect("draws");
    assert_eq!((found.first_step, found.every), (2, 1));
    for own in &found.chains {
        // ln target is made up as −k at topology k.
        assert_eq!(own.ln_target, [-1.0, -2.0, 0.0, -3.0]);
        assert_eq!(own.topology, [0, 1, 2, 3]);
    }
}
