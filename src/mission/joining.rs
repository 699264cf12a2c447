//! Joining landmarks: all pairs that gain, or only those that are hardly in doubt.

use super::placing::ln_sum_exp;
use super::state::State;

/// Pairs further apart than this, squared and in standard deviations, are not looked at.
const GATE: f64 = 60.0;

impl State {
    /// Joins the pair that gains most, again and again, while the log of the gain is above `least`.
    /// Gives the number of pairs.
    pub fn join_greedily(&mut self, least: f64) -> usize {
        let mut n_joined = 0;
        loop {
            let mut best: Option<(f64, usize, usize)> = None;
            self.each_pair(|a, b, gain| {
                if gain > best.map_or(least, |(most, _, _)| most) {
                    best = Some((gain, a, b));
                }
            });
            let Some((_, a, b)) = best else {
                return n_joined;
            };
            self.join(a, b);
            n_joined += 1;
        }
    }

    /// Joins pairs that are each other's best partner with log odds above `least` against all other
    /// partners and none, the surest first.
    pub fn join_surely(&mut self, least: f64) -> usize {
        let mut n_joined = 0;
        while let Some((a, b)) = self.surest_pair(least) {
            self.join(a, b);
            n_joined += 1;
        }
        n_joined
    }

    fn surest_pair(&self, least: f64) -> Option<(usize, usize)> {
        let mut partners: Vec<Vec<(usize, f64)>> = vec![Vec::new(); self.n_landmarks()];
        self.each_pair(|a, b, gain| {
            partners[a].push((b, gain));
            partners[b].push((a, gain));
        });
        let best: Vec<Option<(usize, f64)>> =
            partners.iter().map(|of_one| surest(of_one)).collect();
        let mut found: Option<(f64, usize, usize)> = None;
        for (a, of_a) in best.iter().enumerate() {
            let Some((b, margin_a)) = *of_a else { continue };
            let Some((back, margin_b)) = best[b] else {
                continue;
            };
            let margin = margin_a.min(margin_b);
            let is_mutual = back == a && a < b;
            if is_mutual && margin > found.map_or(least, |(most, _, _)| most) {
                found = Some((margin, a, b));
            }
        }
        found.map(|(_, a, b)| (a, b))
    }

    /// Calls for all pairs that may be one, with the log of what joining them gains.
    pub fn each_pair(&self, mut call: impl FnMut(usize, usize, f64)) {
        for a in 0..self.n_landmarks() {
            for b in a + 1..self.n_landmarks() {
                if let Some((gain, _)) = self.joining(a, b, GATE) {
                    call(a, b, gain);
                }
            }
        }
    }
}

/// The best partner with its log odds against all others and none.
fn surest(partners: &[(usize, f64)]) -> Option<(usize, f64)> {
    let by_gain = |x: &&(usize, f64), y: &&(usize, f64)| x.1.total_cmp(&y.1).then(y.0.cmp(&x.0));
    let &(best, gain) = partners.iter().max_by(by_gain)?;
    let others = partners.iter().filter(|(b, _)| *b != best);
    let others = others.map(|(_, gain)| *gain).chain([0.0]);
    Some((best, gain - ln_sum_exp(others)))
}
