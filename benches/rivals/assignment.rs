//! Sightings of one scan to landmarks, each to one at most.

/// The assignment of rows to columns with the least sum of costs, by the Hungarian method in
/// O(rows² · columns) (Kuhn 1955, with potentials). There must be as many columns as rows or more.
pub fn cheapest(costs: &[Vec<f64>]) -> Vec<usize> {
    let (n, m) = (costs.len(), costs[0].len());
    let (mut of_row, mut of_column) = (vec![0.0; n + 1], vec![0.0; m + 1]);
    // Columns count from 1; 0 stands for none.
    let mut row_of = vec![0_usize; m + 1];
    for row in 1..=n {
        row_of[0] = row;
        let mut column = 0;
        let mut least = vec![f64::INFINITY; m + 1];
        let mut before = vec![0_usize; m + 1];
        let mut is_used = vec![false; m + 1];
        loop {
            is_used[column] = true;
            let from = row_of[column];
            let (mut step, mut next) = (f64::INFINITY, 0);
            for to in (1..=m).filter(|&to| !is_used[to]) {
                let slack = costs[from - 1][to - 1] - of_row[from] - of_column[to];
                if slack < least[to] {
                    (least[to], before[to]) = (slack, column);
                }
                if least[to] < step {
                    (step, next) = (least[to], to);
                }
            }
            for to in 0..=m {
                if is_used[to] {
                    of_row[row_of[to]] += step;
                    of_column[to] -= step;
                } else {
                    least[to] -= step;
                }
            }
            column = next;
            if row_of[column] == 0 {
                break;
            }
        }
        while column != 0 {
            row_of[column] = row_of[before[column]];
            column = before[column];
        }
    }
    let mut column_of = vec![0; n];
    for (column, &row) in row_of.iter().enumerate().skip(1) {
        if row > 0 {
            column_of[row - 1] = column - 1;
        }
    }
    column_of
}
