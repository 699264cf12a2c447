//! Names of columns: which of them mean the same, and which are so near that one may be meant.

/// Whether a column of a file is the one of that name: case and surrounding space do not count.
pub(super) fn is_same(found: &str, known: &str) -> bool {
    found.trim().eq_ignore_ascii_case(known)
}

/// Whether a column looks like latitudes or longitudes.
pub(super) fn is_degrees_of_earth(found: &str) -> bool {
    const WORDS: [&str; 7] = [
        "lat",
        "latitude",
        "lon",
        "lng",
        "long",
        "longitude",
        "latlon",
    ];
    words(found).any(|word| WORDS.contains(&word.as_str()))
}

/// The one of `absent` that an unknown column may be meant for: a slip or two away in spelling, or
/// the same words with more or fewer beside them, as in `pos_x`, `x [m]` and `theta` for
/// `robot_theta`. Never a far one.
pub(super) fn meant<'a>(found: &str, absent: &[&'a str]) -> Option<&'a str> {
    let found = found.trim();
    let slips = |known: &str| strsim::osa_distance(&found.to_ascii_lowercase(), known);
    let allowed = |known: &str| match known.len() {
        0..=3 => 0,
        4..=6 => 1,
        _ => 2,
    };
    let nearest = absent.iter().copied().min_by_key(|known| slips(known))?;
    if slips(nearest) <= allowed(nearest) {
        return Some(nearest);
    }
    let of_words = |known: &&&str| {
        let wanted: Vec<String> = words(known).collect();
        let words: Vec<String> = words(found).collect();
        let is_in = |part: &[String], whole: &[String]| {
            !part.is_empty() && whole.windows(part.len()).any(|window| window == part)
        };
        let has_others = words.len() <= wanted.len() + 2 && is_in(&wanted, &words);
        has_others || 2 * words.len() >= wanted.len() && is_in(&words, &wanted)
    };
    let mut fitting = absent.iter().filter(of_words);
    let first = fitting.next()?;
    fitting.next().is_none().then_some(first)
}

/// The words of a name in lower case: `posX_m` is pos, x, m.
fn words(name: &str) -> impl Iterator<Item = String> + use<> {
    let mut spaced = String::new();
    let mut was_lower = false;
    for c in name.chars() {
        if was_lower && c.is_uppercase() {
            spaced.push(' ');
        }
        was_lower = c.is_lowercase();
        spaced.push(if c.is_alphanumeric() { c } else { ' ' });
    }
    let words: Vec<String> = spaced.split_whitespace().map(str::to_lowercase).collect();
    words.into_iter()
}
