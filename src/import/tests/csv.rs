//! The truth of a CSV.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::ImportError;
use super::super::truth::{Truth, parse_truth};
use crate::input::Source;

fn parse(text: &str, rows: &[(f64, Option<i64>)]) -> Result<Truth, ImportError> {
    parse_truth(
        Source::from_reader(text.as_bytes(), Path::new("t.csv"))?,
        rows,
    )
}

#[test]
fn the_truth_of_a_csv_has_its_rows() {
    let rows = [(0.0, Some(3)), (0.0, None), (0.1, Some(4))];
    let good =
        "gt_x,gt_y,gt_theta,lm_x,lm_y,range_resid\n1,2,0,5,6,0\n1,2,0,nan,nan,0\n1.1,2,0,7,8,0\n";
    let truth = parse(good, &rows).expect("good");
    assert_eq!(
        truth.landmarks_m,
        BTreeMap::from([(3, [5.0, 6.0]), (4, [7.0, 8.0])])
    );
    let refusal = |text: &str| parse(text, &rows).expect_err("bad").to_string();
    assert_eq!(
        refusal("gt_x,gt_y,gt_theta,lm_x,lm_y\n1,2,0,5,6\n"),
        "t.csv: got 1 rows, expected 3 as in the recording; give the truth of this recording"
    );
    assert!(
        refusal(&good.replace("1.1,2", "1.1,?"))
            .starts_with("t.csv, line 4, column gt_y: got \"?\"")
    );
}
