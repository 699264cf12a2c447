//! How often a verdict is false, and how often it is withheld, with intervals over targets.

use rand::{Rng, RngExt};
use topometric::rng::Purpose;

use super::study::Row;

/// A share with its 95 % interval.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    pub value: f64,
    pub low: f64,
    pub high: f64,
    /// Verdicts that it is of.
    pub n: usize,
}

const N_RESAMPLES: usize = 1000;

/// Of the rows that are `counted`, the share that `is_bad`. Runs of one target are no independent
/// witnesses, so targets are resampled, not rows. Where no row is bad the upper end is that of the rule
/// of three: 3 over the number of targets.
pub fn share(
    rows: &[Row],
    counted: impl Fn(&Row) -> bool,
    is_bad: impl Fn(&Row) -> bool,
) -> Option<Share> {
    let mut targets: Vec<(u64, usize, usize)> = Vec::new();
    for row in rows.iter().filter(|row| counted(row)) {
        let place = targets.partition_point(|own| own.0 < row.target);
        if targets.get(place).is_none_or(|own| own.0 != row.target) {
            targets.insert(place, (row.target, 0, 0));
        }
        targets[place].1 += 1;
        targets[place].2 += usize::from(is_bad(row));
    }
    let sums = |own: &mut dyn Iterator<Item = &(u64, usize, usize)>| {
        own.fold((0, 0), |sum, target| (sum.0 + target.1, sum.1 + target.2))
    };
    let (n, n_bad) = sums(&mut targets.iter());
    if n == 0 {
        return None;
    }
    let mut rng = Purpose::new("shares of verdicts", 1).generator();
    let mut resampled: Vec<f64> = (0..N_RESAMPLES)
        .map(|_| {
            let draw = |rng: &mut dyn Rng| &targets[rng.random_range(0..targets.len())];
            let drawn: Vec<_> = (0..targets.len()).map(|_| draw(&mut rng)).collect();
            let (n, n_bad) = sums(&mut drawn.into_iter());
            n_bad as f64 / n.max(1) as f64
        })
        .collect();
    resampled.sort_unstable_by(f64::total_cmp);
    let n_targets = targets.len();
    let none = (3.0 / n_targets as f64).min(1.0);
    Some(Share {
        value: n_bad as f64 / n as f64,
        low: resampled[N_RESAMPLES / 40],
        high: if n_bad == 0 {
            none
        } else {
            resampled[N_RESAMPLES - 1 - N_RESAMPLES / 40]
        },
        n,
    })
}

/// "0.2 [0.0–0.4] % of 1,234".
pub fn words(share: Option<Share>) -> String {
    share.map_or_else(
        || "–".to_owned(),
        |own| {
            let [value, low, high] = [own.value, own.low, own.high].map(|x| 100.0 * x);
            format!("{value:.1} [{low:.1}–{high:.1}] of {}", own.n)
        },
    )
}
