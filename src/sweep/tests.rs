//! Sweep files: what is read, what is refused, how cells are ordered.

use super::*;

fn parse(text: &str) -> Result<Sweep, String> {
    Sweep::parse(text, "a.toml", "a", None).map_err(|error| error.to_string())
}

fn refusal(text: &str) -> String {
    match parse(text) {
        Ok(sweep) => format!("accepted, {} cells", sweep.cells.len()),
        Err(message) => message,
    }
}

const GRID: &str = "
[model]
sigma_t = 2
[run]
chains = 3
[design]
kind = 'grid'
[design.factors]
init = ['singletons', 'one-cluster']
sigma_o = [2, 0.5, 1]
";

#[test]
fn a_grid_has_every_combination_in_an_order_of_its_own() {
    let sweep = parse(GRID).expect("a good sweep");
    assert_eq!((sweep.cells.len(), sweep.n_chains()), (6, 3));
    let names: Vec<_> = sweep.factors.iter().map(|factor| factor.key.name).collect();
    assert_eq!(names, ["sigma_o", "init"]);
    let first = &sweep.cells[0];
    assert_eq!(
        (first.id.as_str(), first.settings.number("sigma_o")),
        ("c001", 0.5)
    );
    assert_eq!(first.settings.text("init"), "one-cluster");
    assert!(
        sweep
            .cells
            .iter()
            .all(|cell| cell.settings.number("sigma_t") == 2.0)
    );
    let reordered = GRID.replace("[2, 0.5, 1]", "[0.5, 1.0, 2] # other order");
    assert_eq!(parse(&reordered).map(|sweep| sweep.key()), Ok(sweep.key()));
    let changed = GRID.replace("sigma_t = 2", "sigma_t = 3");
    assert_ne!(parse(&changed).map(|sweep| sweep.key()), Ok(sweep.key()));
}

#[test]
fn one_at_a_time_varies_round_the_base() {
    let sweep = parse(&GRID.replace("'grid'", "'one-at-a-time'")).expect("a good sweep");
    let titles: Vec<_> = sweep.cells.iter().map(Cell::title).collect();
    assert_eq!(
        titles,
        [
            "baseline",
            "σₒ = 0.5",
            "σₒ = 2",
            "init = one-cluster",
            "init = singletons"
        ]
    );
}

#[test]
fn a_list_is_what_it_says() {
    let text = "
[design]
kind = 'list'
[[design.cells]]
label = 'b'
penalty_radius = 50
samples = 30
[[design.cells]]
label = 'a'
variant = 'x'
note = 'why'
";
    let sweep = parse(text).expect("a good sweep");
    let titles: Vec<_> = sweep.cells.iter().map(Cell::title).collect();
    assert_eq!(titles, ["a (x)", "b"]);
    assert_eq!(sweep.cells[1].settings.count("samples"), 30);
    assert_eq!(sweep.factors.len(), 2);
    assert!(
        refusal(&text.replace("penalty_radius = 50\nsamples = 30", "")).contains("same settings")
    );
}

#[test]
fn data_from_a_csv_leaves_out_what_concerns_worlds() {
    let text = GRID.replace("sigma_o = [2, 0.5, 1]", "world = ['square-ring', 'office']");
    let sweep = Sweep::parse(&text, "a.toml", "a", Some(Path::new("d.csv"))).expect("a good sweep");
    assert_eq!((sweep.cells.len(), sweep.n_replicates()), (2, 1));
    assert_eq!(sweep.dropped_factors, ["world"]);
    assert!(!sweep.is_simulated());
    assert!(refusal(&format!("[data]\ndetections = 'd.csv'\n{text}")).contains("world"));
}

#[test]
fn refusals_are_one_line_that_helps() {
    let cases = [
        (
            "[design]\nkind = 'gird'",
            "a.toml: [design] kind: got \"gird\", expected grid, one-at-a-time, list, latin-hypercube, sobol, morris, sobol-indices; did you mean grid?",
        ),
        (
            "[model]\nsigma_0 = 1\n[design]\nkind='grid'",
            "a.toml: [model] sigma_0: no such setting; did you mean sigma_o?",
        ),
        (
            "[model]\nsigma_o = 0\n[design]\nkind='grid'",
            "a.toml: [model] sigma_o: got 0, expected a number > 0 (m)",
        ),
        (
            "[run]\nsigma_o = 1\n[design]\nkind='grid'",
            "a.toml: [run] sigma_o: belongs into [model]; move it there",
        ),
        (
            "[model]\nsigma_o = true\n[design]\nkind='grid'",
            "a.toml: [model] sigma_o: got boolean true, expected a number or a text",
        ),
        (
            "[design]\nkind='grid'\n[design.factors]\nseed=[1,2]",
            "a.toml: [design.factors] seed: cannot differ between cells; set it once, in [run]",
        ),
        (
            "[design]\nkind='grid'\n[design.factors]\nsigma_o=[1,1.0]",
            "a.toml: [design] sigma_o: got the level 1 twice; name each once",
        ),
        (
            "[design]\nkind='grid'\n[design.factors]\nsigma_o=[]",
            "a.toml: [design] sigma_o: got no level, expected a list of at least one",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(refusal(text), expected);
    }
    for text in ["", "[modle]\n", "x = [", "[design]\nkind='list'"] {
        let message = refusal(text);
        assert!(
            message.starts_with("a.toml") && !message.contains('\n'),
            "{message}"
        );
    }
}

#[test]
fn a_grid_of_a_million_million_cells_is_refused_with_its_size() {
    let levels: Vec<String> = (1..=1000).map(|k| k.to_string()).collect();
    let levels = levels.join(",");
    let names = ["sigma_o", "sigma_t", "penalty_radius", "penalty_height"];
    let factors: String = names
        .iter()
        .map(|name| format!("{name} = [{levels}]\n"))
        .collect();
    let message = refusal(&format!(
        "[design]\nkind='grid'\n[design.factors]\n{factors}"
    ));
    assert!(
        message.contains("got 1000000000000 cells, expected at most 1000000"),
        "{message}"
    );
}

const SAMPLED: &str = "
[run]
seed = 4
[sampler]
estimator = 'common'
[design]
kind = 'sobol'
points = 16
[design.factors]
penalty_radius = { low = 1, high = 100, scale = 'log' }
importance_samples = { low = 5, high = 8 }
init = ['singletons', 'one-cluster']
";

#[test]
fn a_sampled_design_spreads_its_points_over_the_ranges() {
    let sweep = parse(SAMPLED).expect("a good sweep");
    let count = |name: &str, wanted: &dyn Fn(&Value) -> bool| {
        let values = sweep.cells.iter().map(|cell| cell.settings.get(name));
        values.filter(|value| wanted(value)).count()
    };
    assert_eq!(sweep.cells.len(), 16);
    let below_10 = |value: &Value| matches!(value, Value::Number(x) if *x < 10.0);
    assert_eq!(count("penalty_radius", &below_10), 8);
    assert_eq!(
        count("importance_samples", &|value| *value == Value::Count(6)),
        4
    );
    assert_eq!(count("init", &|value| value.to_string() == "singletons"), 8);
    // The order of the file changes nothing, the seed every point.
    let mut lines: Vec<&str> = SAMPLED.lines().collect();
    let n = lines.len();
    lines.swap(n - 1, n - 3);
    assert_eq!(parse(&lines.join("\n")).map(|s| s.key()), Ok(sweep.key()));
    let other = parse(&SAMPLED.replace("seed = 4", "seed = 5")).expect("a good sweep");
    assert_ne!(other.cells[0].settings, sweep.cells[0].settings);
    let replaced = Sweep::parse(
        &SAMPLED.replace("init = [", "noise = [1, 2] #"),
        "a.toml",
        "a",
        Some(Path::new("d.csv")),
    )
    .expect("a good sweep");
    assert_eq!(
        (replaced.cells.len(), &replaced.dropped_factors[..]),
        (16, &["noise"][..])
    );
}

#[test]
fn the_other_sampled_designs() {
    let morris = SAMPLED
        .replace("'sobol'", "'morris'")
        .replace("points = 16", "trajectories = 5");
    let morris = parse(&morris).expect("a good sweep");
    assert_eq!(morris.cells.len(), 5 * 4);
    assert_eq!(morris.cells[5].title(), "trajectory 2, point 2");
    let indices = parse(&SAMPLED.replace("'sobol'", "'sobol-indices'")).expect("a good sweep");
    assert_eq!(
        (indices.cells.len(), indices.cells[6].title()),
        (16 * 5, "B2".to_owned())
    );
    let latin = SAMPLED
        .replace("'sobol'", "'latin-hypercube'")
        .replace("16", "10");
    assert_eq!(parse(&latin).expect("a good sweep").cells.len(), 10);
}

#[test]
fn refusals_of_sampled_designs() {
    let with = |from: &str, to: &str| {
        let text = SAMPLED.replace(from, to);
        assert_ne!(text, SAMPLED, "{from}");
        refusal(&text)
    };
    let cases = [
        (
            ("points = 16", ""),
            "a.toml: [design] points: a sobol design needs it; say how many, as in points = 16",
        ),
        (
            ("points = 16", "points = 1"),
            "a.toml: [design] points: got 1, expected at least 2",
        ),
        (
            ("points = 16", "trajectories = 3"),
            "a.toml: [design] trajectories: a sobol design takes points, not trajectories",
        ),
        (
            ("'sobol'", "'grid'"),
            "a.toml: [design] points: a grid design takes neither points nor trajectories",
        ),
        (
            ("'sobol'\npoints = 16", "'grid'"),
            "a.toml: [design] importance_samples: got a range, expected a list of levels, as in [1, 2]; only sampled designs take ranges",
        ),
        (
            ("low = 1,", ""),
            "a.toml: [design] penalty_radius: a range needs low, as in { low = 1, high = 10 }",
        ),
        (
            ("low = 1,", "low = 100,"),
            "a.toml: [design] penalty_radius: got low 100 and high 100, expected low below high",
        ),
        (
            ("'log'", "'lin'"),
            "a.toml: [design] penalty_radius: got scale \"lin\", expected \"linear\" or \"log\"",
        ),
        (
            ("low = 5", "lo = 5"),
            "a.toml: [design] importance_samples: got \"lo\" in a range, expected low, high and perhaps scale",
        ),
        (
            ("['singletons', 'one-cluster']", "{ low = 1, high = 2 }"),
            "a.toml: [design] init: got a range, expected a list of levels: it is no number",
        ),
    ];
    for ((from, to), expected) in cases {
        assert_eq!(with(from, to), expected);
    }
}

/// A factor that the estimator has no use for would look like one without an effect.
#[test]
fn a_factor_without_use_is_refused() {
    let of = |estimator: &str| {
        parse(&SAMPLED.replace("'common'", estimator)).map_err(|error| error.to_string())
    };
    assert!(of("'fresh'").is_ok());
    for estimator in ["auto", "explicit"] {
        let message = of(&format!("'{estimator}'")).expect_err("no use");
        let words = format!(
            "importance_samples varies: got [sampler] estimator {estimator}, expected common"
        );
        assert!(message.contains(&words), "{message}");
    }
}
