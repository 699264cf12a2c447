//! Which column of a table of draws is what.

/// The columns of a table with one row for each draw.
///
/// `chain` names the chain; without it a file is one chain. `weight`, or `n_proposals` as the traces
/// of `ptm sample` call it, is the number of steps that a draw stands for. `ln_target` is ln of the
/// target density. The labels are in one column `labels`, as in `0,0,1`, and all other columns are
/// left out; or each item has a column of its own, which are all others but `draw`, those without a
/// name, and the index that pandas writes. Names count without regard to case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns {
    /// The place of `chain`.
    pub chain: Option<usize>,
    /// The place of the weight.
    pub weight: Option<usize>,
    /// The place of `ln_target`.
    pub ln_target: Option<usize>,
    /// Where the labels are.
    pub items: Items,
}

/// Steps that a draw can stand for.
pub const MAX_WEIGHT: u64 = 1_000_000_000_000;

/// The weight in a cell; `None` if it is no whole number from 1 to [`MAX_WEIGHT`].
pub fn weight_of(cell: &str) -> Option<u64> {
    let weight = cell.parse().ok();
    weight.filter(|weight| (1..=MAX_WEIGHT).contains(weight))
}

/// Where the labels of a draw are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Items {
    /// All in this column.
    Together(usize),
    /// Those of the items in these columns.
    Apart(Vec<usize>),
}

impl Columns {
    /// By the names of all columns; `None` if none is left for an item.
    pub fn of<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        let place = |wanted: &str| {
            let mut names = names.clone();
            names.position(|name| name.trim().eq_ignore_ascii_case(wanted))
        };
        let chain = place("chain");
        let weight = place("weight").or_else(|| place("n_proposals"));
        let ln_target = place("ln_target");
        let items = match place("labels") {
            Some(labels) => Items::Together(labels),
            None => {
                let others = [chain, weight, ln_target, place("draw")];
                let is_item = |(ix, name): &(usize, &str)| {
                    let is_index = name.starts_with("__index_level_");
                    !others.contains(&Some(*ix)) && !name.trim().is_empty() && !is_index
                };
                let items = names.clone().enumerate().filter(is_item);
                Items::Apart(items.map(|(ix, _)| ix).collect())
            }
        };
        if items == Items::Apart(Vec::new()) {
            return None;
        }
        Some(Self {
            chain,
            weight,
            ln_target,
            items,
        })
    }
}
