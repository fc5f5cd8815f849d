//! What was wrong with an input, said where the input is read.

/// A refused input: which key or part of it, and one sentence with what was found, what is allowed and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Key below the place where the caller stands (`"wavelength"`, `"stops[2]"`); empty for the place itself.
    pub at: String,
    /// The sentence.
    pub message: String,
}

impl Fault {
    /// A fault at `at`.
    pub fn new(at: impl Into<String>, message: impl Into<String>) -> Self {
        Fault {
            at: at.into(),
            message: message.into(),
        }
    }

    /// The same fault, its place moved under `key`.
    pub fn under(mut self, key: &str) -> Self {
        self.at = match (key.is_empty(), self.at.is_empty()) {
            (true, _) => self.at,
            (false, true) => key.to_string(),
            (false, false) => format!("{key}.{}", self.at),
        };
        self
    }
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.at.is_empty() {
            f.write_str(&self.message)
        } else {
            write!(f, "{}: {}", self.at, self.message)
        }
    }
}

impl std::error::Error for Fault {}
