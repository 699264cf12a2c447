//! Means over groups of cells, and differences of such means, with intervals over the units.
//!
//! A unit's value is the mean over the group's cells on that unit, so that cells that share a world count as
//! one. In a **sampled** design another draw of points would fill the bins differently, so the spread
//! between cells counts too: the squared standard errors over units and over cells are added (as for a
//! crossed design with both at random; noise is counted in each, so it errs on the wide side), with
//! the degrees of freedom of Satterthwaite (Biometrics Bulletin 2, 1946).

use super::responses::ResponseValues;
use crate::diagnostics::interval::{Interval, of_units_that_agree};
use crate::diagnostics::student::{UnitMean, student_p_value, student_quantile, unit_mean};

/// Sums of a response over the cells of several groups.
pub(super) struct Groups {
    n_units: usize,
    /// By group and unit.
    sums: Vec<(f64, usize)>,
    /// By group: the means of its cells.
    cell_means: Vec<Vec<f64>>,
}

impl Groups {
    /// `group` gives a cell's group, below `n_groups`.
    pub fn new(
        values: &ResponseValues,
        n_groups: usize,
        group: impl Fn(usize) -> Option<usize>,
    ) -> Self {
        let n_units = values.n_units;
        let mut sums = vec![(0.0, 0); n_groups * n_units];
        let mut cell_means = vec![Vec::new(); n_groups];
        for (cell, row) in values.by_cell.iter().enumerate() {
            let Some(group) = group(cell) else { continue };
            let (mut of_cell, mut n) = (0.0, 0);
            for (unit, value) in row.iter().enumerate() {
                if let Some(value) = value {
                    let (sum, count) = &mut sums[group * n_units + unit];
                    *sum += value;
                    *count += 1;
                    of_cell += value;
                    n += 1;
                }
            }
            if n > 0 {
                cell_means[group].push(of_cell / f64::from(n));
            }
        }
        Self {
            n_units,
            sums,
            cell_means,
        }
    }

    /// The mean of a group on a unit.
    fn on_unit(&self, group: usize, unit: usize) -> Option<f64> {
        let (sum, n) = self.sums[group * self.n_units + unit];
        (n > 0).then(|| sum / n as f64)
    }

    /// Σ weight × mean of the group, on units where all groups have values; `sampled` counts the spread
    /// between cells in.
    pub fn combine(&self, weights: &[(usize, f64)], sampled: bool) -> Option<UnitMean> {
        let on_unit = |unit: usize| -> Option<f64> {
            let terms = weights
                .iter()
                .map(|(group, weight)| Some(weight * self.on_unit(*group, unit)?));
            terms.sum()
        };
        let by_unit: Vec<f64> = (0..self.n_units).filter_map(on_unit).collect();
        let over_units = unit_mean(&by_unit)?;
        if !sampled {
            return Some(over_units);
        }
        Some(self.with_cells(over_units, weights))
    }

    fn with_cells(&self, over_units: UnitMean, weights: &[(usize, f64)]) -> UnitMean {
        // Variances with their degrees of freedom.
        let mut parts = Vec::new();
        if let Some(error) = over_units.standard_error {
            parts.push((error * error, (over_units.n - 1) as f64));
        }
        let mut has_lone_cell = false;
        for (group, weight) in weights {
            let cells = &self.cell_means[*group];
            has_lone_cell |= cells.len() < 2;
            if let Some(error) = unit_mean(cells).and_then(|mean| mean.standard_error) {
                parts.push((weight * weight * error * error, (cells.len() - 1) as f64));
            }
        }
        let none = UnitMean {
            standard_error: None,
            interval: None,
            p_value: None,
            ..over_units
        };
        let squared: f64 = parts.iter().map(|(variance, _)| variance).sum();
        if has_lone_cell || squared == 0.0 {
            return none;
        }
        let error = squared.sqrt();
        let terms = parts
            .iter()
            .map(|(variance, degrees)| variance * variance / degrees);
        let degrees = squared * squared / terms.sum::<f64>();
        let half = student_quantile(degrees) * error;
        UnitMean {
            standard_error: Some(error),
            interval: Some(Interval {
                low: over_units.mean - half,
                high: over_units.mean + half,
            }),
            p_value: Some(student_p_value(over_units.mean / error, degrees)),
            ..over_units
        }
    }
}

/// The estimate of what can only lie on `range`: its interval is cut to that, and where all units
/// agree it is the widest that their number allows ([`of_units_that_agree`]).
pub(super) fn within(estimate: UnitMean, range: Interval) -> UnitMean {
    let cut = |interval: Interval| Interval {
        low: interval.low.max(range.low),
        high: interval.high.min(range.high),
    };
    let agree = estimate.standard_error == Some(0.0);
    let of_agreeing = || of_units_that_agree(estimate.mean, estimate.n, range);
    UnitMean {
        interval: estimate
            .interval
            .map(cut)
            .or_else(|| of_agreeing().filter(|_| agree)),
        ..estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::sensitivity::Response;

    /// The spread between the cells of a group of one cell is not known, so nothing is claimed of
    /// its mean.
    #[test]
    fn one_cell_of_a_sampled_design_claims_nothing() {
        let values = |rows: &[[f64; 3]]| ResponseValues {
            response: Response::NSets,
            by_cell: rows.iter().map(|row| row.map(Some).to_vec()).collect(),
            n_units: 3,
        };
        let two = values(&[[1.0, 2.0, 4.0], [1.5, 2.0, 3.0]]);
        let one_cell = Groups::new(&two, 2, Some);
        let found = one_cell.combine(&[(0, 1.0)], true).expect("a mean");
        assert_eq!(
            (found.standard_error, found.interval, found.p_value),
            (None, None, None)
        );
        let both_cells = Groups::new(&two, 1, |_| Some(0));
        let found = both_cells.combine(&[(0, 1.0)], true).expect("a mean");
        assert!(found.standard_error.is_some() && found.p_value.is_some());
    }
}
