//! What can be wrong with a design: the place, what was found, what is allowed, the nearest right word.

use geometry::fault::{Fault, brief, nearest};
use schemars::JsonSchema;
use serde::Serialize;

/// A refused design.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DesignError {
    /// Name of the file the design came from, where a door knows it.
    pub file: Option<String>,
    /// Line in that file, counted from one.
    pub line: Option<usize>,
    /// Path of the key in the design, such as `lattice.core.map.affine.wavelength`.
    pub path: String,
    /// What stood there, as text.
    pub found: Option<String>,
    /// What is wrong, what is allowed and what to do.
    pub message: String,
    /// The nearest right word to a misspelt one.
    pub nearest: Option<String>,
}

/// Something in a design that is allowed but may be a mistake.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(rename = "WarningReport")]
pub struct Warning {
    /// Path of the key in the design.
    pub path: String,
    /// The possible mistake, with the numbers.
    pub message: String,
}

impl DesignError {
    /// An error at `path`.
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        DesignError { path: path.into(), message: message.into(), ..Default::default() }
    }

    /// The same, with what was found.
    pub fn found(mut self, found: impl Into<String>) -> Self {
        self.found = Some(found.into());
        self
    }

    /// The same, in the file `name`.
    pub fn in_file(mut self, name: &str) -> Self {
        self.file = Some(name.to_string());
        self
    }

    /// A fault raised below `path`.
    pub(crate) fn fault(path: &str, fault: Fault) -> Self {
        let at = if fault.at.starts_with('[') || fault.at.is_empty() || path.is_empty() {
            format!("{path}{}", fault.at)
        } else {
            format!("{path}.{}", fault.at)
        };
        DesignError { found: fault.found, ..DesignError::new(at, fault.message) }
    }

    /// `word` is none of `allowed`. `what` names the kind of word: key, cell, region …
    pub(crate) fn unknown(path: &str, what: &str, word: &str, allowed: &[&str]) -> Self {
        let nearest = nearest(word, allowed.iter().copied());
        Self::unknown_but(path, what, word, allowed, nearest)
    }

    /// The same, the nearest right word known.
    pub(crate) fn unknown_but(path: &str, what: &str, word: &str, allowed: &[&str], nearest: Option<&str>) -> Self {
        let hint = nearest.map_or(String::new(), |n| format!("; did you mean \"{n}\"?"));
        let stop = if hint.is_empty() { "." } else { "" };
        let mut e =
            DesignError::new(path, format!("unknown {what} \"{word}\"{hint}{stop} Allowed: {}", allowed.join(", ")));
        e.nearest = nearest.map(str::to_string);
        e.found(word)
    }
}

impl core::fmt::Display for DesignError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{file}:{line}: ")?,
            (Some(file), None) => write!(f, "{file}: ")?,
            (None, Some(line)) => write!(f, "line {line}: ")?,
            (None, None) => {}
        }
        if !self.path.is_empty() {
            write!(f, "{}: ", brief(&self.path))?;
        }
        f.write_str(&brief(&self.message))
    }
}

impl std::error::Error for DesignError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_says_file_line_path_and_cure() {
        let mut e = DesignError::unknown("lattice.a.cell", "cell", "gyriod", &["gyroid", "diamond"]).in_file("d.toml");
        e.line = Some(7);
        assert_eq!(
            e.to_string(),
            "d.toml:7: lattice.a.cell: unknown cell \"gyriod\"; did you mean \"gyroid\"? Allowed: gyroid, diamond"
        );
        assert_eq!(e.nearest.as_deref(), Some("gyroid"));
    }
}
