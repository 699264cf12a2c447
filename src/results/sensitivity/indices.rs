//! Elementary effects and Sobol's indices of the designs that are made for them.

use super::responses::{Response, ResponseValues};
use crate::diagnostics::morris::{Screening, screening};
use crate::diagnostics::sobol_indices::{BasePoint, NoIndices, SobolIndices, sobol_indices};
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::settings::Key;
use crate::sweep::{Design, SampledDesign, Sampling, Sweep};

/// Of every response, by the factors of the design.
#[derive(Clone)]
pub struct Indices {
    /// The factors, in order.
    pub factors: Vec<&'static Key>,
    /// Which kind.
    pub by_response: FactorIndices,
}

impl std::fmt::Debug for Indices {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.by_response)
    }
}

/// By response.
#[derive(Clone, Debug)]
pub enum FactorIndices {
    /// Of a `morris` design, by factor.
    Morris(Vec<(Response, Vec<Screened>)>),
    /// Of a `sobol-indices` design, with the number of base points left out for want of a value.
    Sobol(Vec<(Response, usize, Result<SobolIndices, NoIndices>)>),
}

/// A factor's elementary effects.
#[derive(Clone, Copy, Debug)]
pub struct Screened {
    /// What they show; `None` of fewer than two trajectories.
    pub screening: Option<Screening>,
    /// Trajectories left out for want of a value.
    pub n_left_out: usize,
}

/// `None` for other designs.
pub(super) fn indices(sweep: &Sweep, values: &[ResponseValues]) -> Option<Indices> {
    let Design::Sampled(design) = &sweep.design else {
        return None;
    };
    let by_response = match design.sampling {
        Sampling::Morris => {
            let of = |values: &ResponseValues| (values.response, morris(sweep, design, values));
            FactorIndices::Morris(values.iter().map(of).collect())
        }
        Sampling::SobolIndices => {
            let of = |values: &ResponseValues| {
                let (n_left_out, found) = sobol(sweep, design, values);
                (values.response, n_left_out, found)
            };
            FactorIndices::Sobol(values.iter().map(of).collect())
        }
        _ => return None,
    };
    Some(Indices {
        factors: design.axes.iter().map(|axis| axis.key).collect(),
        by_response,
    })
}

fn purpose(sweep: &Sweep, values: &ResponseValues) -> Purpose {
    Purpose::new(SAMPLER_SEMANTICS, sweep.seed())
        .text("use", "bootstrap of indices")
        .text("response", values.response.name())
}

/// A cell's values, if all its units have one.
fn whole(row: &[Option<f64>]) -> Option<Vec<f64>> {
    row.iter().copied().collect()
}

fn morris(sweep: &Sweep, design: &SampledDesign, values: &ResponseValues) -> Vec<Screened> {
    let points = design.points();
    let n_factors = design.axes.len();
    let mut effects = vec![Vec::new(); n_factors];
    let mut left_out = vec![0; n_factors];
    for step in 1..points.len() {
        if step % design.n_each() == 0 {
            // The first point of a trajectory comes from nowhere.
            continue;
        }
        let (from, to) = (&points[step - 1], &points[step]);
        let Some(factor) = (0..n_factors).find(|&f| from[f] != to[f]) else {
            continue;
        };
        let moved = to[factor] - from[factor];
        let ends = [step - 1, step].map(|cell| whole(&values.by_cell[cell]));
        match ends {
            [Some(from), Some(to)] => {
                let effect = from.iter().zip(&to).map(|(from, to)| (to - from) / moved);
                effects[factor].push(effect.collect::<Vec<f64>>());
            }
            _ => left_out[factor] += 1,
        }
    }
    let of = |(factor, n_left_out): (usize, usize)| {
        let name = design.axes[factor].key.name;
        let mut rng = purpose(sweep, values).text("factor", name).generator();
        Screened {
            screening: screening(&effects[factor], &mut rng),
            n_left_out,
        }
    };
    left_out.into_iter().enumerate().map(of).collect()
}

fn sobol(
    sweep: &Sweep,
    design: &SampledDesign,
    values: &ResponseValues,
) -> (usize, Result<SobolIndices, NoIndices>) {
    let blocks = values.by_cell.chunks(design.n_each());
    let n = blocks.len();
    let base_point = |block: &[Vec<Option<f64>>]| {
        let all: Option<Vec<Vec<f64>>> = block.iter().map(|row| whole(row)).collect();
        let mut all = all?.into_iter();
        Some(BasePoint {
            a: all.next()?,
            b: all.next()?,
            mixed: all.collect(),
        })
    };
    let points: Vec<BasePoint> = blocks.filter_map(base_point).collect();
    let mut rng = purpose(sweep, values).generator();
    (n - points.len(), sobol_indices(&points, &mut rng))
}
