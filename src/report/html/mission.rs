//! The page of a solved mission: one file.

use maud::html;

use super::super::figures::DOUBTFUL;
use super::super::section::{Entry, Section, Table};
use super::super::summary::{mission_answer, noise_words};
use super::super::{Figure, figures};
use super::{section, still, still_page};
use crate::mission::{Graph, Misfit, Solution, SolvedMap};

/// Rows of each table.
const MOST_ROWS: usize = 50;

/// The page, with the picture in it. The graph is that of the solution's noise.
pub fn mission_page(graph: &Graph, solution: &Solution, title: &str) -> String {
    let figure = Figure {
        file: String::new(),
        caption:
            "The way that was found, the way by odometry alone, and the landmarks, dark where \
                  they are sure; lines lead from sightings in doubt to the landmark that they are \
                  taken for."
                .to_owned(),
        scene: figures::mission_figure(graph, solution, String::new()),
    };
    let parts = [
        doubts(graph, solution),
        alternatives(solution),
        misfits(graph, solution),
        landmarks(solution),
    ];
    let body = html! {
        h1 { (title) }
        p { "Which sightings are of one landmark, and where was the robot?" }
        @for sentence in mission_answer(graph, solution) { p { (sentence) } }
        p { (noise_words(solution.noise)) }
        (still(&figure))
        @for part in parts.iter().flatten() { (section(part, "")) }
    };
    still_page(title, &body)
}

fn metres([x, y]: [f64; 2]) -> [Entry; 2] {
    [x, y].map(|value| format!("{value:.2}").into())
}

fn percent(share: f64) -> Entry {
    format!("{:.1} %", 100.0 * share).into()
}

fn doubts(graph: &Graph, solution: &Solution) -> Option<Section> {
    let p = &solution.probabilities;
    let mut doubtful: Vec<usize> = (0..p.len()).filter(|&s| p[s] < DOUBTFUL).collect();
    doubtful.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let seen = solution.map.sighted_m(graph);
    let row = |&s: &usize| {
        let pose = graph.observations[s].pose;
        let [x, y] = metres(seen[s]);
        vec![
            s.to_string().into(),
            pose.to_string().into(),
            format!("{:.1}", graph.times_s[pose]).into(),
            x,
            y,
            solution.map.labels[s].to_string().into(),
            percent(p[s]),
        ]
    };
    let head = [
        "sighting",
        "pose",
        "t, s",
        "x, m",
        "y, m",
        "landmark",
        "probability",
    ];
    let words = format!(
        "Of {} sightings the landmark is less than {:.0} % sure. The least sure come first (at most \
         {MOST_ROWS} are listed); sightings.csv has all.",
        doubtful.len(),
        100.0 * DOUBTFUL
    );
    let rows = Table::new(&head, doubtful.iter().take(MOST_ROWS).map(row));
    Section::of_table("doubts", "In doubt", &words, rows)
}

fn alternatives(solution: &Solution) -> Option<Section> {
    let all = std::iter::once(&solution.map).chain(&solution.alternatives);
    let row = |(place, map): (usize, &SolvedMap)| {
        let folder = match place {
            0 => "this map".to_owned(),
            place => format!("alternatives/{place}"),
        };
        vec![
            folder.into(),
            percent(map.weight),
            map.landmarks_m.len().to_string().into(),
            format!("{:.1}", map.ln_posterior).into(),
        ]
    };
    let head = ["map", "weight", "landmarks", "log posterior"];
    let rows = Table::new(&head, all.enumerate().map(row));
    let words = "Maps that the search came to, and their weights against each other. Maps that it \
                 did not come to have none.";
    let found = Section::of_table("alternatives", "Other maps", words, rows);
    found.filter(|_| !solution.alternatives.is_empty())
}

fn misfits(graph: &Graph, solution: &Solution) -> Option<Section> {
    let seen = solution.map.sighted_m(graph);
    let row = |misfit: &Misfit| {
        let (what, place) = match *misfit {
            Misfit::Odometry(k, _) => (
                format!("odometry from pose {k} to {}", k + 1),
                solution.map.poses[k + 1].position_m(),
            ),
            Misfit::Sighting(s, _) => (
                format!("sighting {s} of landmark {}", solution.map.labels[s]),
                seen[s],
            ),
        };
        let [x, y] = metres(place);
        vec![
            what.into(),
            x,
            y,
            format!("{:.1}", misfit.square().sqrt()).into(),
        ]
    };
    let rows = Table::new(
        &["residual", "x, m", "y, m", "standard deviations"],
        solution.fit.worst.iter().map(row),
    );
    let [n, of] = solution.fit.n_beyond;
    let words = format!(
        "{n} of {of} residuals are larger than the noise allows 999 of 1,000 to be; by chance {:.1} \
         would be. The worst come first.",
        0.001 * of as f64
    );
    Section::of_table("misfits", "What fits worst", &words, rows)
}

fn landmarks(solution: &Solution) -> Option<Section> {
    let mut n_seen = vec![0_usize; solution.landmarks.len()];
    for &label in &solution.map.labels {
        n_seen[label as usize] += 1;
    }
    let mut order: Vec<usize> = (0..n_seen.len()).collect();
    let p = |a: usize| solution.landmarks[a].probability;
    order.sort_by(|&a, &b| p(a).total_cmp(&p(b)));
    let row = |&a: &usize| {
        let one = &solution.landmarks[a];
        let [x, y] = metres(one.position_m);
        let [xx, _, yy] = one.covariance_m2;
        vec![
            a.to_string().into(),
            n_seen[a].to_string().into(),
            x,
            y,
            format!("{:.3}", (0.5 * (xx + yy)).sqrt()).into(),
            percent(one.probability),
        ]
    };
    let head = [
        "landmark",
        "sightings",
        "x, m",
        "y, m",
        "standard deviation, m",
        "probability",
    ];
    let words = format!(
        "The least sure come first (at most {MOST_ROWS} are listed); map.geojson has all. The \
         probability is that exactly these sightings are a landmark."
    );
    Section::of_table(
        "landmarks",
        "Landmarks",
        &words,
        Table::new(&head, order.iter().take(MOST_ROWS).map(row)),
    )
}
