//! Which cells get pictures of their chains; every cell has a page.

use super::Material;

/// Cells from each end of the ranking that always get pictures.
const N_EXTREME: usize = 6;
/// Cells between them, at even steps of the ranking.
const N_BETWEEN: usize = 6;

/// Which cells get pictures of their chains. A page costs a millisecond and ten kilobytes; its pictures
/// cost a hundred times as much, so a sweep of a thousand cells does not draw them all unasked.
#[derive(Clone, Debug, PartialEq)]
pub enum Pages {
    /// The six most and six least successful, and six at even steps between; all of up to 24 cells.
    Chosen,
    /// All.
    All,
    /// Those chosen and these.
    Also(Vec<usize>),
}

impl Pages {
    pub(super) fn choose(&self, material: Material<'_>) -> Vec<usize> {
        let ranking = material.results.ranking();
        let n = ranking.len();
        let mut chosen: Vec<usize> = if *self == Self::All || n <= 2 * N_EXTREME + 2 * N_BETWEEN {
            ranking.to_vec()
        } else {
            let between = n - 2 * N_EXTREME;
            let step = |k: usize| N_EXTREME + (2 * k + 1) * between / (2 * N_BETWEEN);
            let sample = (0..N_BETWEEN).map(|k| ranking[step(k)]);
            let best = ranking[..N_EXTREME].iter().copied();
            let worst = ranking[n - N_EXTREME..].iter().copied();
            best.chain(sample).chain(worst).collect()
        };
        if let Self::Also(cells) = self {
            chosen.extend(cells);
        }
        chosen.sort_unstable();
        chosen.dedup();
        chosen
    }
}

/// How the choice is described.
pub fn choice_words(n_cells: usize) -> String {
    if n_cells <= 2 * N_EXTREME + 2 * N_BETWEEN {
        "Every cell has a page.".to_owned()
    } else {
        format!(
            "Every cell has a page with its map. The pictures of its chains are drawn for the {N_EXTREME} most and {N_EXTREME} least \
             successful cells and {N_BETWEEN} at even steps between them; `ptm report FOLDER --cell ID` draws others."
        )
    }
}

/// A cell's page, relative to the report's folder.
pub fn cell_file(material: Material<'_>, cell: usize) -> String {
    format!("cells/{}.html", material.sweep.cells[cell].id)
}
