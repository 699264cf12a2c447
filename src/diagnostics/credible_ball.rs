//! How far the posterior spreads about a point estimate: the credible ball of Wade & Ghahramani
//! (Bayesian Analysis 13, 2018, §5), the smallest ball in the metric of the loss that holds a share
//! of the draws.

use super::loss::Loss;
use super::mass::share_interval;
use super::undefined::Undefined;
use crate::chain::TopologyCount;
use crate::partition::Topology;

/// A credible ball with the topologies at its edge.
#[derive(Clone, Debug, PartialEq)]
pub struct CredibleBall {
    /// Largest distance inside, in the unit of the loss.
    pub radius: f64,
    /// 95 % interval of the radius, from the draws' ESS; the upper end is `None` where the draws
    /// cannot tell it.
    pub radius_interval: (f64, Option<f64>),
    /// Share of the draws inside, at least the level.
    pub mass: f64,
    /// Visited topologies inside.
    pub n_topologies: usize,
    /// Horizontal bounds: those at the radius.
    pub horizontal: Vec<Topology>,
    /// Upper vertical bounds: of those with the fewest sets inside, the farthest.
    pub upper: Vec<Topology>,
    /// Lower vertical bounds: of those with the most sets inside, the farthest.
    pub lower: Vec<Topology>,
}

/// The smallest ball about `centre` with at least a share `level` of the counts.
///
/// # Errors
/// [`Undefined::TooShort`] without counts.
pub fn credible_ball(
    centre: &Topology,
    rows: &[TopologyCount],
    loss: Loss,
    level: f64,
    ess: f64,
) -> Result<CredibleBall, Undefined> {
    assert!(level > 0.0 && level < 1.0, "a share between 0 and 1");
    let mut by_distance: Vec<(f64, &TopologyCount)> = rows
        .iter()
        .filter(|row| row.count > 0)
        .map(|row| (loss.distance(centre, &row.topology), row))
        .collect();
    by_distance.sort_by(|a, b| {
        a.0.total_cmp(&b.0)
            .then_with(|| a.1.topology.cmp(&b.1.topology))
    });
    let total: u64 = by_distance.iter().map(|(_, row)| row.count).sum();
    let Some(&(farthest, _)) = by_distance.last() else {
        return Err(Undefined::TooShort { n: 0, fewest: 1 });
    };
    let radius_of = |share: f64| {
        let mut sum = 0;
        let reaches = |(_, row): &&(f64, &TopologyCount)| {
            sum += row.count;
            sum as f64 >= share * total as f64
        };
        by_distance
            .iter()
            .find(reaches)
            .map_or(farthest, |(distance, _)| *distance)
    };
    let radius = radius_of(level);
    let (low, high) = share_interval(level, ess);
    // Distances that are equal in exact arithmetic may differ in the last digits.
    let reach = radius * (1.0 + 1e-12);
    let inside: Vec<(f64, &TopologyCount)> = by_distance
        .iter()
        .copied()
        .take_while(|(distance, _)| *distance <= reach)
        .collect();
    let n_sets = || inside.iter().map(|(_, row)| row.topology.n_sets());
    let (fewest, most) = (n_sets().min(), n_sets().max());
    Ok(CredibleBall {
        radius,
        radius_interval: (radius_of(low), (high < 1.0).then(|| radius_of(high))),
        mass: inside.iter().map(|(_, row)| row.count).sum::<u64>() as f64 / total as f64,
        n_topologies: inside.len(),
        horizontal: farthest_of(&inside, |_| true),
        upper: farthest_of(&inside, |topology| Some(topology.n_sets()) == fewest),
        lower: farthest_of(&inside, |topology| Some(topology.n_sets()) == most),
    })
}

/// Of topologies by rising distance, the farthest that are wanted.
fn farthest_of(
    inside: &[(f64, &TopologyCount)],
    wanted: impl Fn(&Topology) -> bool,
) -> Vec<Topology> {
    let wanted: Vec<_> = inside
        .iter()
        .filter(|(_, row)| wanted(&row.topology))
        .collect();
    let farthest = wanted.last().map_or(0.0, |(distance, _)| *distance);
    let at_edge = wanted
        .iter()
        .filter(|(distance, _)| *distance >= farthest * (1.0 - 1e-12));
    at_edge.map(|(_, row)| row.topology.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(labels: &[u32], count: u64) -> TopologyCount {
        TopologyCount {
            topology: Topology::canonical(labels),
            count,
        }
    }

    #[test]
    fn the_ball_and_its_bounds() {
        // Pairs that disagree with the centre 0011, out of six: 0, 1, 1, 2, 4, 2.
        let rows = [
            row(&[0, 0, 1, 1], 60),
            row(&[0, 0, 1, 2], 15),
            row(&[0, 1, 2, 2], 14),
            row(&[0, 1, 2, 3], 7),
            row(&[0, 0, 0, 0], 3),
            row(&[0, 1, 2, 3], 1),
        ];
        let centre = &rows[0].topology;
        let ball =
            |level| credible_ball(centre, &rows, Loss::Binder, level, 1000.0).expect("counts");
        let wide = ball(0.95);
        assert!((wide.radius - 2.0 / 6.0).abs() < 1e-15 && (wide.mass - 0.97).abs() < 1e-15);
        assert_eq!(
            wide.horizontal,
            [rows[3].topology.clone(), rows[3].topology.clone()]
        );
        assert_eq!((wide.upper, wide.n_topologies), (vec![centre.clone()], 5));
        assert_eq!(wide.radius_interval, (2.0 / 6.0, Some(2.0 / 6.0)));
        let narrow = ball(0.8);
        assert!((narrow.radius - 1.0 / 6.0).abs() < 1e-15 && (narrow.mass - 0.89).abs() < 1e-15);
        assert_eq!(
            narrow.horizontal,
            [rows[1].topology.clone(), rows[2].topology.clone()]
        );
        assert_eq!(narrow.lower, narrow.horizontal);
        let whole = ball(0.99);
        assert_eq!(whole.upper, [rows[4].topology.clone()]);
        assert!((whole.radius - 4.0 / 6.0).abs() < 1e-15);
        let unsure = credible_ball(centre, &rows, Loss::Binder, 0.95, 20.0).expect("counts");
        assert_eq!(unsure.radius_interval, (1.0 / 6.0, None));
        assert!(credible_ball(centre, &[], Loss::Binder, 0.95, 1.0).is_err());
    }
}
