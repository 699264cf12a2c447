//! Ranks, quantiles and folding of pooled draws (Vehtari, Gelman, Simpson, Carpenter & Bürkner,
//! Bayesian Analysis 16, 2021, §4.1).

use super::chains::Chains;
use super::normal::normal_quantile;

/// Distinct values in rising order, each with the number of draws at or below it.
pub struct Ordered {
    values: Vec<f64>,
    up_to: Vec<u64>,
}

impl Ordered {
    /// Of all draws of all chains.
    pub fn new(chains: &Chains) -> Self {
        let mut draws: Vec<_> = chains.pooled().collect();
        // −0 and 0 are one value; adding 0 makes them so.
        draws.iter_mut().for_each(|(value, _)| *value += 0.0);
        draws.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (mut values, mut up_to, mut total) = (Vec::new(), Vec::new(), 0);
        for (value, n) in draws {
            total += n;
            if values.last() == Some(&value) {
                up_to.pop();
            } else {
                values.push(value);
            }
            up_to.push(total);
        }
        Self { values, up_to }
    }

    /// Distinct values in rising order, each with the number of draws at or below it.
    pub fn cumulative(&self) -> Vec<(f64, u64)> {
        let up_to = self.up_to.iter().copied();
        self.values.iter().copied().zip(up_to).collect()
    }

    /// Number of draws.
    pub fn n(&self) -> u64 {
        *self.up_to.last().expect("chains have draws")
    }

    /// The draw at a place, from 0, in rising order.
    pub fn at(&self, place: u64) -> f64 {
        self.values[self.up_to.partition_point(|&n| n <= place)]
    }

    /// The p-quantile, 0 ≤ p ≤ 1, linear between neighbours (type 7 of Hyndman & Fan, 1996).
    pub fn quantile(&self, p: f64) -> f64 {
        let place = (self.n() - 1) as f64 * p;
        let share = place - place.floor();
        let below = self.at(place as u64);
        if share == 0.0 {
            return below;
        }
        let step = self.at(place as u64 + 1) - below;
        // From the nearer side, so that both ends are met exactly.
        if share < 0.5 {
            below + step * share
        } else {
            below + step - step * (1.0 - share)
        }
    }

    /// The median.
    pub fn median(&self) -> f64 {
        let n = self.n();
        (self.at((n - 1) / 2) + self.at(n / 2)) / 2.0
    }

    /// Rank of a value that was drawn, from 1; ties share their average rank.
    pub fn rank(&self, value: f64) -> f64 {
        let place = self.values.partition_point(|&v| v < value);
        let below = if place == 0 { 0 } else { self.up_to[place - 1] };
        below as f64 + ((self.up_to[place] - below) as f64 + 1.0) / 2.0
    }
}

/// Normal scores of the pooled ranks, z = Φ⁻¹((r − 3/8)/(S + 1/4)), S draws in all (their eq. 14,
/// with Blom's 1958 offset). Any increasing transform of the draws gives the same scores.
#[must_use]
pub fn rank_normalised(chains: &Chains) -> Chains {
    let ordered = Ordered::new(chains);
    let denominator = ordered.n() as f64 + 0.25;
    let scores: Vec<f64> = ordered
        .values
        .iter()
        .map(|&value| normal_quantile((ordered.rank(value) - 0.375) / denominator))
        .collect();
    chains.map(|value| scores[ordered.values.partition_point(|&v| v < value)])
}

/// Distances from the pooled median, |x − median|: what R-hat of the spread is computed of.
#[must_use]
pub fn folded(chains: &Chains) -> Chains {
    let median = Ordered::new(chains).median();
    chains.map(|value| (value - median).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ordered() -> Ordered {
        let chains = Chains::new(&[vec![(4.0, 2), (1.0, 1), (2.0, 2)], vec![(2.0, 1), (0.0, 4)]]);
        Ordered::new(&chains.expect("five draws each"))
    }

    #[test]
    fn ties_share_their_rank() {
        // 0 0 0 0 1 2 2 2 4 4
        let ranks: Vec<f64> = [0.0, 1.0, 2.0, 4.0].map(|v| ordered().rank(v)).to_vec();
        assert_eq!(ranks, [2.5, 5.0, 7.0, 9.5]);
    }

    #[test]
    fn quantiles_between_neighbours() {
        let ordered = ordered();
        assert_eq!((ordered.n(), ordered.median()), (10, 1.5));
        assert_eq!(
            [0.0, 0.5, 1.0].map(|p| ordered.quantile(p)),
            [0.0, 1.5, 4.0]
        );
        assert!((ordered.quantile(0.4) - 0.6).abs() < 1e-15);
        assert!((ordered.quantile(0.87) - 3.66).abs() < 1e-14);
    }

    #[test]
    fn zeros_of_both_signs_are_one_value() {
        let chains = Chains::new(&[vec![(-0.0, 2), (1.0, 1), (0.0, 2)]]).expect("five draws");
        assert_eq!(Ordered::new(&chains).rank(-0.0), 2.5);
        assert_eq!(rank_normalised(&chains).n_changes(), 2);
    }
}
