//! Sizes, colours and number formats shared by all figures.
//!
//! Sizes are for a page 1600 px wide that must still be read at half size, so text is never below
//! 22 px there; [`Style::scaled`] serves other resolutions. Categorical colours are Okabe & Ito's
//! (2008), safe for the common colour-vision deficiencies; sequential ones are viridis and cividis,
//! diverging ones the RdBu of ColorBrewer.

use plotters::style::RGBAColor;

/// A colour with its opacity.
pub type Colour = RGBAColor;

const fn rgb(r: u8, g: u8, b: u8) -> Colour {
    RGBAColor(r, g, b, 1.0)
}

/// Text, frames and walls.
pub const INK: Colour = rgb(34, 34, 34);
/// Secondary text.
pub const MUTED: Colour = rgb(95, 95, 95);
/// Grid lines.
pub const GRID: Colour = rgb(228, 228, 228);
/// Quiet fills: burn-in, "all others".
pub const QUIET: Colour = rgb(189, 189, 189);
/// The page.
pub const PAPER: Colour = rgb(255, 255, 255);
/// Text on light colours that mean something. It is not [`INK`], because it stays dark on dark pages.
pub const ON_LIGHT: Colour = rgb(34, 34, 35);
/// Text on dark colours that mean something; it stays white on dark pages.
pub const ON_DARK: Colour = rgb(255, 255, 254);
/// The path of the robot.
pub const PATH: Colour = rgb(0, 128, 96);
/// Everything that stands for the truth.
pub const TRUTH: Colour = rgb(0, 128, 96);
/// The colour of a single series.
pub const SERIES: Colour = rgb(0, 114, 178);
/// A second series that must stand out from the first.
pub const ACCENT: Colour = rgb(213, 94, 0);
/// Fill and hatching of cells without data.
pub const NO_DATA: (Colour, Colour) = (rgb(240, 240, 240), rgb(176, 176, 176));

/// Colours that only carry the drawing, with what takes their place where the reader prefers dark
/// pages. Colours that mean something are the same on both.
pub const DARK: [(Colour, Colour); 7] = [
    (INK, rgb(230, 232, 235)),
    (MUTED, rgb(166, 173, 181)),
    (GRID, rgb(51, 56, 63)),
    (QUIET, rgb(96, 104, 113)),
    (PAPER, rgb(22, 24, 27)),
    (NO_DATA.0, rgb(36, 40, 45)),
    (NO_DATA.1, rgb(84, 92, 101)),
];

/// Okabe & Ito with grey for black and yellow darkened so that it shows on white.
pub const CATEGORIES: [Colour; 8] = [
    rgb(0, 114, 178),
    rgb(230, 159, 0),
    rgb(0, 158, 115),
    rgb(204, 121, 167),
    rgb(86, 180, 233),
    rgb(213, 94, 0),
    rgb(170, 155, 20),
    rgb(110, 110, 110),
];

/// The colour of category `index`, repeating after eight.
pub fn category(index: usize) -> Colour {
    CATEGORIES[index % CATEGORIES.len()]
}

/// The same colour at another opacity.
pub fn fade(colour: Colour, opacity: f64) -> Colour {
    RGBAColor(colour.0, colour.1, colour.2, colour.3 * opacity)
}

/// Colours of verdicts on a cell, from the best to the worst: green and blue for what converged
/// rightly, purple for the undecided, orange for a lucky find, vermilion for a wrong one, light
/// blue for what did not converge, ink for what failed, and paper for what was not run. Of
/// different lightness too, for print in grey.
pub const STATUS: [Colour; 8] = [
    rgb(0, 114, 89),
    rgb(0, 114, 178),
    rgb(190, 130, 200),
    rgb(240, 180, 40),
    rgb(213, 94, 0),
    rgb(150, 205, 240),
    rgb(34, 34, 34),
    rgb(240, 240, 240),
];

/// Colour of a chain that recovered the truth.
pub const RECOVERED: Colour = STATUS[0];
/// Colours of faults: of the model, of the sampler, of arithmetic, and undecided.
pub const FAULTS: [Colour; 4] = [STATUS[4], STATUS[3], STATUS[6], STATUS[2]];
/// Colour of what was not looked at.
pub const UNTOLD: Colour = STATUS[7];

/// Colours of a scale from its low end to its high end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Palette {
    /// Dark blue to yellow; the most steps to tell apart.
    #[default]
    Viridis,
    /// Dark blue to yellow through grey; the safest for colour-vision deficiencies.
    Cividis,
    /// Red through white to blue, for values about a middle.
    RedBlue,
}

const VIRIDIS: [(u8, u8, u8); 9] = [
    (68, 1, 84),
    (71, 44, 122),
    (59, 81, 139),
    (44, 113, 142),
    (33, 144, 141),
    (39, 173, 129),
    (92, 200, 99),
    (170, 220, 50),
    (253, 231, 37),
];
const CIVIDIS: [(u8, u8, u8); 9] = [
    (0, 34, 78),
    (18, 53, 112),
    (59, 73, 108),
    (87, 93, 109),
    (112, 113, 115),
    (138, 134, 120),
    (165, 156, 116),
    (195, 179, 105),
    (254, 232, 56),
];
const RED_BLUE: [(u8, u8, u8); 9] = [
    (178, 24, 43),
    (214, 96, 77),
    (244, 165, 130),
    (253, 219, 199),
    (247, 247, 247),
    (209, 229, 240),
    (146, 197, 222),
    (67, 147, 195),
    (33, 102, 172),
];

impl Palette {
    /// The colour at `share` of the way from the low end (0) to the high end (1), clamped.
    pub fn at(self, share: f64) -> Colour {
        let stops = match self {
            Self::Viridis => &VIRIDIS,
            Self::Cividis => &CIVIDIS,
            Self::RedBlue => &RED_BLUE,
        };
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let low = (place.floor() as usize).min(stops.len() - 2);
        let mix = |a: u8, b: u8| {
            let t = place - low as f64;
            (f64::from(a) * (1.0 - t) + f64::from(b) * t).round() as u8
        };
        let (a, b) = (stops[low], stops[low + 1]);
        rgb(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
    }
}

/// Dark or white text. By WCAG contrast they break even at a luminance of 0.21, but on saturated
/// colours of that luminance white is the easier to read.
pub fn readable_on(background: Colour) -> Colour {
    let linear = |byte: u8| (f64::from(byte) / 255.0).powf(2.2);
    let luminance = 0.2126 * linear(background.0)
        + 0.7152 * linear(background.1)
        + 0.0722 * linear(background.2);
    if luminance > 0.26 { ON_LIGHT } else { ON_DARK }
}

/// Sizes in pixels of everything that is not data.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    scale: f64,
}

impl Default for Style {
    fn default() -> Self {
        Self::scaled(1.0)
    }
}

impl Style {
    /// Sizes for a page `scale` times 1600 px wide.
    pub fn scaled(scale: f64) -> Self {
        Self { scale }
    }

    /// Any length given for the 1600 px page.
    pub fn px(&self, length_px: f64) -> f64 {
        length_px * self.scale
    }

    /// Headings of pages.
    pub fn title_px(&self) -> f64 {
        self.px(30.0)
    }

    /// Panel titles and axis names.
    pub fn text_px(&self) -> f64 {
        self.px(24.0)
    }

    /// Tick labels, legends and notes.
    pub fn small_px(&self) -> f64 {
        self.px(22.0)
    }

    /// Data lines.
    pub fn line_px(&self) -> f64 {
        self.px(3.0)
    }

    /// Frames, ticks and spokes.
    pub fn thin_px(&self) -> f64 {
        self.px(2.0)
    }

    /// Between neighbours.
    pub fn gap_px(&self) -> f64 {
        self.px(12.0)
    }
}

/// A number for a tick: as many decimals as the step needs, thousands grouped, a true minus sign.
pub fn tick_label(value: f64, step: f64) -> String {
    let decimals = (-step.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    // A step such as 2.5 needs one more decimal than its order of magnitude says.
    let needs_more = ((step * 10f64.powi(decimals as i32)).fract()).abs() > 1e-6;
    group_thousands(&format!("{value:.*}", decimals + usize::from(needs_more)))
}

/// A share as a percentage with the decimals it deserves: "42.3 %", "0.02 %", "100 %".
pub fn percent(share: f64) -> String {
    let value = share * 100.0;
    match value {
        v if v == 0.0 || v >= 99.95 => format!("{v:.0} %"),
        v if v < 0.0095 => "<0.01 %".to_owned(),
        v if v < 0.95 => format!("{v:.2} %"),
        v => format!("{v:.1} %"),
    }
}

/// A share in two digits, for narrow places: "42 %", "7.1 %", "0.21 %".
pub fn percent_short(share: f64) -> String {
    let value = share * 100.0;
    if value >= 9.95 {
        format!("{value:.0} %")
    } else {
        percent(share)
    }
}

fn group_thousands(number: &str) -> String {
    let (sign, digits) = number
        .strip_prefix('-')
        .map_or(("", number), |rest| ("−", rest));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    // A rounded zero has no sign.
    let sign = if digits.bytes().any(|b| (b'1'..=b'9').contains(&b)) {
        sign
    } else {
        ""
    };
    let mut grouped = String::new();
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i) % 3 == 0 {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    if fraction.is_empty() {
        format!("{sign}{grouped}")
    } else {
        format!("{sign}{grouped}.{fraction}")
    }
}
