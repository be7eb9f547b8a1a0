//! A page for every code of [`crate::diagnostic::code`]: what it means, the equation of the paper behind it, what to try, and
//! an example that is wrong beside the same one mended.
//!
//! The pages are the markdown files of `src/explain/`; the program prints them (`dpc-codegen explain E0104`), and the constants
//! of [`pages`] show them in this documentation.

use crate::diagnostic::code;

/// What is to be known about one code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    /// `E0104`
    pub code: &'static str,
    /// Markdown; the first line is `# E0104: ` and the title.
    pub text: &'static str,
}

impl Page {
    /// What the code stands for, in a few words.
    pub fn title(&self) -> &'static str {
        let heading = self.text.lines().next().unwrap_or_default();
        heading.split_once(": ").map_or(heading, |(_, title)| title)
    }

    /// The network under the heading `## Network`, which the examples are scenarios for; `None` where these are networks themselves.
    pub fn network(&self) -> Option<&'static str> {
        self.example("## Network")
    }

    /// The network, or scenario, under the heading `## Wrong`, which this code refuses; `None` where no small one is known.
    pub fn wrong(&self) -> Option<&'static str> {
        self.example("## Wrong")
    }

    /// The network under the heading `## Right`, which is designed, or the scenario, which can be simulated.
    pub fn right(&self) -> Option<&'static str> {
        self.example("## Right")
    }

    fn example(&self, heading: &str) -> Option<&'static str> {
        let (_, under) = self.text.split_once(heading)?;
        let (_, from) = under.split_once("```toml\n")?;
        from.split_once("```").map(|(example, _)| example)
    }
}

/// The page of a code, in either case.
pub fn page(code: &str) -> Option<&'static Page> {
    PAGES.iter().find(|page| page.code.eq_ignore_ascii_case(code))
}

/// The code that `written` may have been meant for: the same digits with another letter or none, or the nearest number.
pub fn nearest(written: &str) -> Option<&'static str> {
    let digits: String = written.chars().filter(char::is_ascii_digit).collect();
    let number: u32 = digits.parse().ok()?;
    let distance = |page: &&Page| page.code[1..].parse().map_or(u32::MAX, |known: u32| known.abs_diff(number));
    let near = PAGES.iter().min_by_key(distance)?;
    (distance(&near) <= NEAR).then_some(near.code)
}

/// How far a number may be off.
const NEAR: u32 = 20;

macro_rules! pages {
    ($($name:ident = $code:literal,)*) => {
        /// In the order of their numbers.
        pub const PAGES: &[Page] = &[$(Page { code: code::$name, text: pages::$name }),*];

        /// The pages by the names of [`crate::diagnostic::code`].
        pub mod pages {
            $(
                #[doc = include_str!(concat!("explain/", $code, ".md"))]
                pub const $name: &str = include_str!(concat!("explain/", $code, ".md"));
            )*
        }
    };
}

pages! {
    SYNTAX = "E0101",
    UNKNOWN_KEY = "E0102",
    MISSING_KEY = "E0103",
    WRONG_TYPE = "E0104",
    NOT_FINITE = "E0105",
    BAD_NAME = "E0106",
    DUPLICATE_NAME = "E0107",
    UNKNOWN_CHOICE = "E0108",
    OUT_OF_RANGE = "E0109",
    SHAPE = "E0110",
    MIXED_FORMS = "E0111",
    UNKNOWN_SUBSYSTEM = "E0112",
    SELF_COUPLING = "E0113",
    PARTITION = "E0114",
    COUPLED_OUTPUT = "E0115",
    MORE_OUTPUTS_THAN_INPUTS = "E0116",
    ASYMMETRIC = "E0117",
    INDEFINITE = "E0118",
    GAMMA = "E0119",
    EMPTY_BOUNDS = "E0120",
    ZERO_OUTSIDE = "E0121",
    EMPTY_ROW = "E0122",
    UNKNOWN_SIGNAL = "E0123",
    COVER = "E0124",
    RESERVE = "E0125",
    HALF_A_GAIN = "E0126",
    DISTURBANCE = "E0127",
    LOAD = "E0128",
    START_OUTSIDE = "E0129",
    MEMBERS = "E0130",
    PLANNED_START = "E0131",
    SINGLE_PRECISION = "E0132",
    FILE = "E0140",
    NOT_IN_FILE = "E0141",
    SAMPLING = "E0142",
    HOLD_ERROR = "E0143",
    UNSTABILISABLE = "E0201",
    LOCAL_LOOP = "E0202",
    COLLECTIVE_LOOP = "E0203",
    ASSUMPTION_2 = "E0204",
    ASSUMPTION_3 = "E0205",
    NO_INTEGRATION = "E0206",
    LARGE_REFERENCES = "E0207",
    SMALL_GAIN = "E0301",
    NO_INVARIANT_SET = "E0302",
    FEW_NORMALS = "E0303",
    STEADY_STATE = "E0304",
    EPSILON = "E0401",
    RESERVE_TOO_LARGE = "E0402",
    COVER_TOO_LARGE = "E0403",
    NOT_SIZED = "E0404",
    LOST_SLACK = "E0405",
    DISTURBANCE_TOO_LARGE = "E0406",
    MARGIN_TOO_SMALL = "E0407",
    NOT_CONVEX = "E0501",
    OVERFLOW = "E0502",
    TOO_MANY_OUTPUTS = "E0503",
    NO_START_PLAN = "E0504",
    SCENARIO_VALUE = "E0601",
    NO_LINK = "E0602",
    RULE = "E0603",
    PROFILE = "E0604",
    TRUE_PLANT = "E0605",
    NO_SET = "E0606",
    UNIT = "E0607",
}
