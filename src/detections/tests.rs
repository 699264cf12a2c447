//! The CSV reader and writer, and the checks of what they read.

use proptest::prelude::*;

use super::*;

fn read(text: &str) -> Result<Detections, DetectionsError> {
    Detections::from_csv_reader(text.as_bytes(), "d.csv")
}

fn message(text: &str) -> String {
    read(text).expect_err("the text is faulty").to_string()
}

#[test]
fn reads_the_columns_in_any_order_through_bom_crlf_quotes_and_blank_lines() {
    let text = "\u{feff}landmark,\"y\",x,corner,last_seen,first_seen\r\n\
                3,\"2.5\", 1 ,closed,9,4.5\r\n\r\n,-1e-3,+7,,,\r\n4.0,0,0,open,1,1";
    let detections = read(text).expect("a good file");
    assert_eq!(
        detections.positions_m(),
        [[1.0, 2.5], [7.0, -1e-3], [0.0, 0.0]]
    );
    assert_eq!(detections.truth(), [Some(3), None, Some(4)]);
    let rows: Vec<_> = detections.iter().collect();
    assert_eq!(rows[0].corner, Some(Corner::Closed));
    assert_eq!(
        (rows[0].first_seen_s, rows[0].last_seen_s),
        (Some(4.5), Some(9.0))
    );
    assert_eq!(*rows[1], Detection::at(7.0, -1e-3));
    assert_eq!(rows[2].corner, Some(Corner::Open));
    assert!(detections.covariances_m2().is_none());
}

#[test]
fn every_message_is_one_line_that_says_where_and_what_to_change() {
    let cases = [
        (
            "",
            "d.csv, line 1: got a blank file, expected a header with the columns x,y; add one",
        ),
        (
            " \n\n",
            "d.csv, line 1: got a blank file, expected a header with the columns x,y; add one",
        ),
        (
            "x,y\n",
            "d.csv: got no detections, expected at least one row below the header; add a row for each",
        ),
        (
            "x,cov_xx\n1,2",
            "d.csv, line 1: got x,cov_xx in the header, expected the columns x,y; add the column y (m)",
        ),
        (
            "x,y,x\n",
            "d.csv, line 1: got x twice in the header, expected each column once; keep one column x",
        ),
        (
            "1,2\n3,4",
            "d.csv, line 1: got the number 1 in the header, expected names of columns; put the header x,y above the first row",
        ),
        (
            "x,y,cov_xx,cov_yy\n",
            "d.csv, line 1: got cov_xx,cov_yy without cov_xy in the header, expected cov_xx,cov_xy,cov_yy all three or none; add cov_xy or remove cov_xx,cov_yy",
        ),
        (
            "x,y\n1,2\n1,2,3",
            "d.csv, line 3: got 3 fields, expected 2 as in the header; write one field per column, separated by commas, with a decimal point",
        ),
        (
            "x,y\n\n1,oops",
            "d.csv, line 3, column y: got \"oops\", expected a number; correct the value or remove the row",
        ),
        (
            "x,y\n1,",
            "d.csv, line 2, column y: got nothing, expected a number; correct the value or remove the row",
        ),
        (
            "x,y\nnan,1",
            "d.csv, line 2, column x: got \"nan\", expected a finite number; correct the value or remove the row",
        ),
        (
            "x,y\n1,2\n1,-inf",
            "d.csv, line 3, column y: got \"-inf\", expected a finite number; correct the value or remove the row",
        ),
        (
            "x,y,cov_xx,cov_xy,cov_yy\n1,2,1,2,1",
            "d.csv, line 2, column cov_xx,cov_xy,cov_yy: got 1,2,1 with determinant -3, expected a positive definite covariance (cov_xx > 0, determinant > 0); correct the values, or remove the three columns to do without covariances",
        ),
        (
            "x,y,cov_xx,cov_xy,cov_yy\n1,2,1,,1",
            "d.csv, line 2, column cov_xy: got nothing, expected a number; correct the value or remove the row",
        ),
        (
            "x,y,corner\n1,2,ajar",
            "d.csv, line 2, column corner: got \"ajar\", expected open, closed or nothing; correct the value or remove the row",
        ),
        (
            "x,y,landmark\n1,2,1.5",
            "d.csv, line 2, column landmark: got \"1.5\", expected a whole number, a name, or nothing (or -1) for an unknown landmark; correct the value or remove the row",
        ),
        (
            "x,y,first_seen,last_seen\n1,2,5,4",
            "d.csv, line 2, column last_seen: got 4 before first_seen 5, expected a time not before first_seen; swap the two times",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(message(text), expected, "{text:?}");
    }
}

#[test]
fn bytes_that_are_not_text_are_refused_with_their_line() {
    let error = Detections::from_csv_reader(&b"x,y\n1,2\n1,\xff2\n"[..], "d.csv");
    assert_eq!(
        error.expect_err("not UTF-8").to_string(),
        "d.csv, line 3: got bytes that are not UTF-8, expected UTF-8 text; save the file as UTF-8"
    );
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = Detections::read_csv("/no/such/d.csv")
        .expect_err("no such file")
        .to_string();
    assert!(
        error.starts_with("/no/such/d.csv: cannot be read (No such file"),
        "{error}"
    );
    assert!(!error.contains('\n'));
}

#[test]
fn sets_made_in_memory_are_checked_too() {
    let message = |rows| Detections::new(rows).expect_err("faulty").to_string();
    assert!(message(vec![]).starts_with("detections: got no detections"));
    assert!(
        message(vec![Detection::at(0.0, f64::NAN)]).starts_with("detection 1, column y: got NaN")
    );
    let mut with = Detection::at(0.0, 0.0);
    with.covariance_m2 = Some(Covariance {
        xx: 1.0,
        xy: 0.0,
        yy: 1.0,
    });
    let mixed = message(vec![Detection::at(0.0, 0.0), with.clone()]);
    assert!(
        mixed.starts_with("detection 2, column cov_xx,cov_xy,cov_yy: got a covariance"),
        "{mixed}"
    );
    assert!(message(vec![with, Detection::at(0.0, 0.0)]).contains("got none"));
}

#[test]
fn the_hash_sees_every_value_and_the_order() {
    let text = "x,y,cov_xx,cov_xy,cov_yy,first_seen,last_seen,corner,landmark\n\
                0,1,1,0,1,3,4,open,1\n5,6,1,0,1,3,4,open,1\n";
    let hash = |text: &str| read(text).expect("a good file").content_hash();
    let reference = hash(text);
    assert_eq!(reference, hash(&text.replace("\n0,1", "\n-0.0,1e0")));
    let first_row = "\n0,1,1,0,1,3,4,open,1";
    for changed in [
        "\n9,1,1,0,1,3,4,open,1",
        "\n0,9,1,0,1,3,4,open,1",
        "\n0,1,9,0,1,3,4,open,1",
        "\n0,1,1,0.5,1,3,4,open,1",
        "\n0,1,1,0,9,3,4,open,1",
        "\n0,1,1,0,1,2,4,open,1",
        "\n0,1,1,0,1,3,9,open,1",
        "\n0,1,1,0,1,,4,open,1",
        "\n0,1,1,0,1,3,4,closed,1",
        "\n0,1,1,0,1,3,4,open,",
    ] {
        assert_ne!(
            reference,
            hash(&text.replace(first_row, changed)),
            "{changed}"
        );
    }
    let mut rows: Vec<Detection> = read(text).expect("a good file").iter().cloned().collect();
    rows.reverse();
    assert_ne!(
        reference,
        Detections::new(rows).expect("still good").content_hash()
    );
}

#[test]
fn unknown_landmarks_are_empty_negative_or_a_word_for_nothing() {
    let text = "x,y,landmark,corner\n0,0,-1,\n1,0,,None\n2,0,NaN,null\n3,0,none,OPEN\n4,0,7.0,Closed\n5,0,-1.0,na\n";
    let detections = read(text).expect("a good file");
    assert_eq!(detections.truth(), [None, None, None, None, Some(7), None]);
    let corners: Vec<_> = detections.iter().map(|row| row.corner).collect();
    assert_eq!(corners[3..5], [Some(Corner::Open), Some(Corner::Closed)]);
    assert!(corners[..3].iter().all(Option::is_none));
}

#[test]
fn names_of_landmarks_are_kept_and_written_again() {
    let text = "x,y,landmark\n0,0,tree0\n1,0,\n2,0,\"oak, old\"\n3,0,tree0\n4,0,12\n";
    let detections = read(text).expect("a good file");
    assert_eq!(
        detections.truth(),
        [Some(0), None, Some(1), Some(0), Some(2)]
    );
    assert_eq!(detections.landmark_name(1), "oak, old");
    assert_eq!(detections.to_csv_string(), text);
    // Names of some detections only are numbered anew, as a reader of their file numbers them.
    let rows: Vec<Detection> = detections.iter().skip(2).cloned().collect();
    let names = ["tree0", "oak, old", "12"].map(str::to_owned);
    let rest = Detections::new(rows).and_then(|rest| rest.with_landmark_names(&names));
    let rest = rest.expect("a good set");
    assert_eq!(rest.truth(), [Some(0), Some(1), Some(2)]);
    assert_eq!(read(&rest.to_csv_string()).expect("our own file"), rest);
    for bad in ["", "none", "-1", " tree", "1.5"] {
        let names = [bad.to_owned(), bad.to_owned(), bad.to_owned()];
        let refused = detections.clone().with_landmark_names(&names);
        assert!(refused.is_err(), "{bad:?}");
    }
    let mut negative = Detection::at(0.0, 0.0);
    negative.landmark = Some(-1);
    assert!(Detections::new(vec![negative]).is_err());
}

fn any_detections() -> impl Strategy<Value = Detections> {
    let number =
        || proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO;
    let row = (
        [number(), number()],
        (1e-6..1e6, 1e-6..1e6, -0.99..0.99),
        proptest::option::of((number(), number())),
        proptest::option::of(any::<bool>()),
        proptest::option::of(0..=i64::MAX),
    );
    (any::<bool>(), proptest::collection::vec(row, 1..20)).prop_map(|(with_covariance, rows)| {
        let rows = rows
            .into_iter()
            .map(|(position_m, (xx, yy, rho), times, closed, landmark)| {
                let xy = rho * f64::sqrt(xx * yy);
                Detection {
                    position_m,
                    covariance_m2: with_covariance.then_some(Covariance { xx, xy, yy }),
                    first_seen_s: times.map(|(a, b)| a.min(b)),
                    last_seen_s: times.map(|(a, b)| a.max(b)),
                    corner: closed.map(|closed| if closed { Corner::Closed } else { Corner::Open }),
                    landmark,
                }
            });
        Detections::new(rows.collect()).expect("made to be good")
    })
}

proptest! {
    #[test]
    fn what_is_written_reads_back_equal(detections in any_detections()) {
        let back = read(&detections.to_csv_string()).expect("our own file");
        prop_assert_eq!(&back, &detections);
        prop_assert_eq!(back.content_hash(), detections.content_hash());
    }
}
