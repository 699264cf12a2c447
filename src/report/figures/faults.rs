//! Whose fault the wrong maps of every cell are.

use super::super::{Figure, Material, words};
use super::all_cells::Grid;
use super::level_key;
use crate::figure::heat_map::HeatCategory;
use crate::figure::style::{FAULTS, RECOVERED, UNTOLD};
use crate::results::{Fault, Faults};
use crate::sweep::Design;

/// Chains of every cell by what became of them, side by side in its tile; `None` where nothing was
/// sorted.
pub(in crate::report) fn faults(material: Material<'_>) -> Option<Figure> {
    let total = material.results.faults()?;
    let category = |name: &str, n: usize, colour| HeatCategory {
        name: format!("{name}: {}", words::counted(n, "chain")),
        colour,
    };
    let of_fault = |(fault, colour): (Fault, _)| category(fault.words(), total.n(fault), colour);
    let mut categories = vec![category(
        "recovered the truth",
        total.n_recovered,
        RECOVERED,
    )];
    categories.extend(Fault::ALL.into_iter().zip(FAULTS).map(of_fault));
    let cells = &material.results.cells;
    let n_unsorted = cells.iter().filter(|cell| cell.faults.is_none()).count();
    if n_unsorted > 0 {
        categories.push(HeatCategory {
            name: format!("not sorted: {}", words::counted(n_unsorted, "cell")),
            colour: UNTOLD,
        });
    }
    let parts = |faults: Faults| -> Vec<f64> {
        let failures = Fault::ALL.into_iter().map(|fault| faults.n(fault));
        let counts = std::iter::once(faults.n_recovered).chain(failures);
        counts.map(|n| n as f64).collect()
    };
    let of_cell = |cell: usize| {
        let Some(faults) = cells[cell].faults else {
            return (Fault::ALL.len() + 1, Vec::new());
        };
        let parts = parts(faults);
        // Of equals the first.
        let most = (0..parts.len())
            .rev()
            .max_by(|a, b| parts[*a].total_cmp(&parts[*b]));
        (most.unwrap_or(0), parts)
    };
    let grid = Grid::new(material);
    let figure = grid.tiles(categories, of_cell);
    let (width, height) = grid.size_px();
    let key = match material.sweep.design {
        Design::Grid(_) => level_key(&material.sweep.factors),
        _ => String::new(),
    };
    Some(Figure {
        file: "figures/faults".to_owned(),
        caption: format!(
            "Whose fault the wrong maps are: the chains of every cell, side by side in its tile. A \
             wrong map is the model’s if the posterior itself prefers another map; the sampler’s if \
             it has the truth, and the chain did not get there; underflow if the chain then walked \
             at random; undecided if the posterior is not known well enough.{key}"
        ),
        scene: figure.page(width + 250, height),
    })
}
