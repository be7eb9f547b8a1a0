//! Which emitted files this version of the runtime fits.

const MAJOR: u32 = number(env!("CARGO_PKG_VERSION_MAJOR"));
const MINOR: u32 = number(env!("CARGO_PKG_VERSION_MINOR"));

/// Whether a file emitted for version `major.minor` of the runtime works with this one, by the rules of semantic
/// versioning. An emitted file checks it when it is compiled: `const _: () = assert!(dpc_runtime::fits(0, 1));`
pub const fn fits(major: u32, minor: u32) -> bool {
    major == MAJOR && if MAJOR == 0 { minor == MINOR } else { minor <= MINOR }
}

const fn number(digits: &str) -> u32 {
    match u32::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("cargo gives the version in digits"),
    }
}

#[cfg(test)]
mod tests {
    use super::{MAJOR, MINOR, fits};

    #[test]
    fn fits_itself_and_no_other_line() {
        assert!(fits(MAJOR, MINOR));
        assert!(!fits(MAJOR + 1, MINOR));
        assert!(!fits(MAJOR, MINOR + 1));
    }
}
