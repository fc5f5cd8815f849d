//! What can be wrong with a design: the place, what was found, what is allowed, the nearest right word.

use crate::fault::Fault;

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

impl DesignError {
    /// An error at `path`.
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        DesignError {
            path: path.into(),
            message: message.into(),
            ..Default::default()
        }
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
    pub(super) fn fault(path: &str, fault: Fault) -> Self {
        let at = if fault.at.starts_with('[') || fault.at.is_empty() || path.is_empty() {
            format!("{path}{}", fault.at)
        } else {
            format!("{path}.{}", fault.at)
        };
        DesignError::new(at, fault.message)
    }

    /// `word` is none of `allowed`. `what` names the kind of word: key, cell, region …
    pub(super) fn unknown(path: &str, what: &str, word: &str, allowed: &[&str]) -> Self {
        let nearest = nearest(word, allowed.iter().copied());
        Self::unknown_but(path, what, word, allowed, nearest)
    }

    /// The same, the nearest right word known.
    pub(super) fn unknown_but(
        path: &str,
        what: &str,
        word: &str,
        allowed: &[&str],
        nearest: Option<&str>,
    ) -> Self {
        let hint = nearest.map_or(String::new(), |n| format!("; did you mean \"{n}\"?"));
        let stop = if hint.is_empty() { "." } else { "" };
        let mut e = DesignError::new(
            path,
            format!(
                "unknown {what} \"{word}\"{hint}{stop} Allowed: {}",
                allowed.join(", ")
            ),
        );
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
            write!(f, "{}: ", self.path)?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for DesignError {}

/// The allowed word nearest to `word`, if it is near enough to be meant: at most a third of its letters differ
/// (two in short words), letter case not counted.
pub fn nearest<'a>(word: &str, allowed: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase().replace(['-', ' '], "_");
    let limit = (word.chars().count() / 3).max(2);
    allowed
        .into_iter()
        .map(|a| (distance(&word, a), a))
        .filter(|&(d, a)| d <= limit && d < a.chars().count().max(2))
        .min_by_key(|&(d, _)| d)
        .map(|(_, a)| a)
}

/// Letters to insert, delete, replace or swap with a neighbour to turn `a` into `b`.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut d = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in d.iter_mut().enumerate() {
        row[0] = i;
    }
    for j in 0..=b.len() {
        d[0][j] = j;
    }
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let change = usize::from(a[i - 1] != b[j - 1]);
            d[i][j] = (d[i - 1][j] + 1)
                .min(d[i][j - 1] + 1)
                .min(d[i - 1][j - 1] + change);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                d[i][j] = d[i][j].min(d[i - 2][j - 2] + 1);
            }
        }
    }
    d[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_finds_slips_and_leaves_strangers_alone() {
        let keys = ["wavelength", "rotate", "offset", "skew"];
        for (slip, want) in [
            ("wavelenght", Some("wavelength")),
            ("wave_length", Some("wavelength")),
            ("Rotate", Some("rotate")),
            ("rotatoin", None),
            ("rotates", Some("rotate")),
            ("ofset", Some("offset")),
            ("colour", None),
            ("x", None),
        ] {
            assert_eq!(nearest(slip, keys), want, "{slip}");
        }
        assert_eq!(distance("abcd", "acbd"), 1);
        assert_eq!(distance("", "abc"), 3);
    }

    #[test]
    fn the_message_says_file_line_path_and_cure() {
        let mut e =
            DesignError::unknown("lattice.a.cell", "cell", "gyriod", &["gyroid", "diamond"])
                .in_file("d.toml");
        e.line = Some(7);
        assert_eq!(
            e.to_string(),
            "d.toml:7: lattice.a.cell: unknown cell \"gyriod\"; did you mean \"gyroid\"? Allowed: gyroid, diamond"
        );
        assert_eq!(e.nearest.as_deref(), Some("gyroid"));
    }
}
