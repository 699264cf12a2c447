//! What solving a mission found, in sentences.

use crate::mission::{Graph, NoiseFactors, Solution};

/// A sighting is sure with this probability.
const SURE: f64 = 0.99;

/// How many landmarks, how sure, and whether the map fits.
pub fn mission_answer(graph: &Graph, solution: &Solution) -> Vec<String> {
    let n = solution.map.labels.len();
    let (n_poses, n_landmarks) = (graph.times_s.len(), solution.landmarks.len());
    let sure = solution.probabilities.iter().filter(|p| **p >= SURE);
    let mut sentences = vec![format!(
        "{n} sightings from {n_poses} poses are of {n_landmarks} landmarks."
    )];
    if solution.draws.is_empty() {
        sentences.push("How sure that is was not asked: no sweeps were made.".to_owned());
    } else {
        sentences.push(format!(
            "{} of the sightings have their landmark with a probability of {:.0} % or more. The \
             draws behind this stay near the map, so a very different map is not ruled out.",
            sure.count(),
            100.0 * SURE
        ));
    }
    if let Some(second) = solution.alternatives.first() {
        sentences.push(format!(
            "The search came to {} other maps that count; this one has {:.1} % of the weight, the \
             next {:.1} %.",
            solution.alternatives.len(),
            100.0 * solution.map.weight,
            100.0 * second.weight
        ));
    }
    sentences.push(fit_words(solution));
    sentences
}

/// χ², its law, and what it says.
pub fn fit_words(solution: &Solution) -> String {
    let fit = &solution.fit;
    format!(
        "χ² is {:.1} at {} degrees of freedom, {}.",
        fit.chi_square,
        fit.degrees_of_freedom,
        fit.verdict()
    )
}

/// What became of the stated noise.
pub fn noise_words(noise: NoiseFactors) -> String {
    if noise == NoiseFactors::STATED {
        return "The noise is taken as it is stated.".to_owned();
    }
    format!(
        "The noise was calibrated: the stated standard deviations of range, bearing, odometry and \
         its heading are multiplied by {:.2}, {:.2}, {:.2} and {:.2}.",
        noise.range, noise.bearing, noise.place, noise.heading
    )
}
