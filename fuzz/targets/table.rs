//! Tables of any columns: plain, packed and encoded; read twice they are the same, or refused in one line.
#![no_main]

use std::path::Path;

use topometric::input::{Column, Identities, InputError, Layout, Source, Table};

const LAYOUT: Layout = Layout {
    rows: "rows",
    columns: &[
        Column::required("x", "m"),
        Column::optional("y"),
        Column::optional("landmark"),
    ],
    max_rows: 1000,
};

type Rows = (Vec<(f64, Option<f64>, Option<usize>)>, Vec<String>);

fn read(bytes: &[u8]) -> Result<Rows, InputError> {
    let mut table = Table::new(Source::from_reader(bytes, Path::new("f"))?, LAYOUT)?;
    let mut identities = Identities::default();
    let mut rows = Vec::new();
    let mut last_line = 0;
    while let Some(mut row) = table.next_row()? {
        assert!(row.line() > last_line);
        last_line = row.line();
        let identity = row.identity(2, &mut identities)?;
        rows.push((row.number(0)?, row.optional_number(1)?, identity));
    }
    let n_known = rows.iter().filter_map(|row| row.2).max().map_or(0, |key| key + 1);
    assert_eq!(identities.finish().numbers.len(), n_known);
    let notes = table.notes().iter().map(ToString::to_string).collect();
    Ok((rows, notes))
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    match read(bytes) {
        Ok(rows) => {
            assert!(rows.0.iter().all(|row| row.0.is_finite()));
            assert!(rows.1.iter().all(|note| !note.contains('\n')), "{:?}", rows.1);
            assert_eq!(read(bytes).expect("it was read before"), rows);
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.contains('\n') && text.chars().count() < 1000, "{text}");
        }
    }
});
