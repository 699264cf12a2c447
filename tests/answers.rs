//! Black-box tests of what a report opens with: a question for each design, a short answer, one
//! figure; and of the page that shows a sweep while it runs.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod common;

use common::{Bench, SMALL_SWEEP, files};

/// The small sweep with another design.
fn with_design(design: &str) -> String {
    let (before, _) = SMALL_SWEEP.split_once("[design]").unwrap();
    format!("{before}[design]\n{design}")
}

const RANGES: &str = "[design.factors]\npenalty_radius = { low = 1, high = 50, scale = \"log\" }\n\
                      sigma_o = { low = 0.3, high = 3 }\n";
const LEVELS: &str = "[design.factors]\npenalty_radius = [1, 10]\nsigma_o = [0.5, 1]\n";
const LIST: &str = "[[design.cells]]\nlabel = \"near\"\npenalty_radius = 3\n\
                    [[design.cells]]\nlabel = \"far\"\npenalty_radius = 30\n";

/// The sentences between the question and the first figure.
fn answer(report: &str) -> Vec<&str> {
    let (head, _) = report.split_once("\n![").unwrap();
    let lines = head.lines().filter(|line| line.starts_with("- **"));
    lines.collect()
}

#[test]
fn each_design_opens_with_its_own_question_and_a_short_answer() {
    let designs = [
        ("grid", LEVELS, "Which settings recover the true map", ""),
        (
            "one-at-a-time",
            LEVELS,
            "Starting from the baseline, which single setting changes recovery?",
            "",
        ),
        ("list", LIST, "How do these 2 settings compare?", ""),
        (
            "latin-hypercube",
            RANGES,
            "Where in these ranges is the true map recovered",
            "points = 8\n",
        ),
        (
            "sobol",
            RANGES,
            "Where in these ranges is the true map recovered",
            "points = 8\n",
        ),
        (
            "morris",
            RANGES,
            "Which of these 2 settings matter at all?",
            "trajectories = 4\n",
        ),
        (
            "sobol-indices",
            RANGES,
            "How much of the variation in recovery does each setting explain?",
            "points = 8\n",
        ),
    ];
    let bench = Bench::new();
    for (kind, factors, question, amount) in designs {
        let text = with_design(&format!("kind = \"{kind}\"\n{amount}{factors}"));
        bench.write("s.toml", text);
        bench.ok(&["-q", "sweep", "s.toml", "--out", kind]);
        let report = bench.read(&format!("{kind}/report.md"));
        let page = bench.read(&format!("{kind}/index.html"));
        assert!(report.contains(question), "{kind}: {report}");
        assert!(page.contains(question), "{kind}");
        let answer = answer(&report);
        assert!((2..=5).contains(&answer.len()), "{kind}: {answer:?}");
        for sentence in &answer {
            // One sentence each: a full stop at its end and none before.
            let text = sentence.replace(". ", "\u{1}");
            assert!(sentence.ends_with('.'), "{kind}: {sentence}");
            assert!(text.matches('\u{1}').count() <= 1, "{kind}: {sentence}");
        }
        let (_, figure) = report.split_once("\n![").unwrap();
        let file = figure.split_once("](").unwrap().1;
        let file = file.split_once(')').unwrap().0;
        assert!(bench.exists(&format!("{kind}/{file}")), "{kind}: {file}");
    }
}

/// Tiles say their values and lead to their cells, figures know dark pages, conditions can be asked
/// of the table, and nothing comes from a network.
#[test]
fn a_page_is_one_file_with_words_links_and_a_dark_side() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let page = bench.read("out/index.html");
    let figures = page.split("<svg ").count() - 1;
    assert!(figures >= 3, "{figures} figures are part of the page");
    assert!(page.contains("prefers-color-scheme:dark"));
    for cell in ["c001", "c002", "c003", "c004"] {
        let link = format!("<a href=\"cells/{cell}.html\"><path ");
        assert!(page.contains(&link), "a tile leads to {cell}");
    }
    assert!(page.contains("to use: c0"), "the map names the cell to use");
    for name in ["\"names\":", "\"numeric\":", "penalty_radius = 10"] {
        assert!(page.contains(name), "{name}");
    }
    let addresses = page.matches("http").count() - page.matches("http-equiv").count();
    let of_svg = page.matches("http://www.w3.org/2000/svg").count();
    assert_eq!(addresses, of_svg, "nothing is fetched");
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
}

#[test]
fn a_sweep_is_watched_without_touching_its_report() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL_SWEEP);
    bench.ok(&["-q", "sweep", "small.toml", "--out", "out"]);
    let before = files(&bench.path("out"));
    // As it is while the sweep runs: half of the records are there.
    let journal = bench.read("out/journal.jsonl");
    let half: Vec<&str> = journal.split_inclusive('\n').take(6).collect();
    bench.write("out/journal.jsonl", half.concat());
    let mut watch = bench
        .command(&["-q", "report", "out", "--watch", "1"])
        .spawn()
        .unwrap();
    let page = || {
        let began = std::time::Instant::now();
        while !bench.exists("out/live.html") && began.elapsed().as_secs() < 60 {
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        bench.read("out/live.html")
    };
    let running = page();
    assert!(
        running.contains("http-equiv=\"refresh\" content=\"1\""),
        "{running}"
    );
    assert!(running.contains("The sweep is running: "));
    assert!(
        !running.contains("href=\"cells/"),
        "those pages are not there yet"
    );
    // The other half ends, and so does the watch.
    bench.write("out/journal.jsonl", journal);
    assert!(watch.wait().unwrap().success());
    let over = bench.read("out/live.html");
    assert!(!over.contains("http-equiv=\"refresh\"") && over.contains("href=\"index.html\""));
    let mut after = files(&bench.path("out"));
    after.remove("live.html");
    let names = |of: &std::collections::BTreeMap<String, Vec<u8>>| {
        of.keys().cloned().collect::<Vec<String>>()
    };
    assert_eq!(names(&after), names(&before));
    assert_eq!(after, before, "a watch writes nothing else");
}
