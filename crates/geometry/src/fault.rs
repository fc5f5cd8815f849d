//! What was wrong with an input, said where the input is read.

/// A refused input: which key or part of it, and one sentence with what was found, what is allowed and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Key below the place where the caller stands (`"wavelength"`, `"stops[2]"`); empty for the place itself.
    pub at: String,
    /// The sentence.
    pub message: String,
    /// The value that was found, where it is one.
    pub found: Option<String>,
}

impl Fault {
    /// A fault at `at`.
    pub fn new(at: impl Into<String>, message: impl Into<String>) -> Self {
        Fault { at: at.into(), message: message.into(), found: None }
    }

    /// The same fault, with the value that was found.
    pub fn found(mut self, found: impl Into<String>) -> Self {
        self.found = Some(found.into());
        self
    }

    /// The same fault, its place moved under `key`.
    pub fn under(mut self, key: &str) -> Self {
        self.at = match (key.is_empty(), self.at.is_empty()) {
            (true, _) => self.at,
            (false, true) => key.to_string(),
            (false, false) if self.at.starts_with('[') => format!("{key}{}", self.at),
            (false, false) => format!("{key}.{}", self.at),
        };
        self
    }
}

/// A number as text for a message: as it was written where that is short, else its first six digits (%g).
pub fn number(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return v.to_string();
    }
    let written = format!("{v:e}");
    let mantissa = written.split('e').next().unwrap_or_default();
    let long = mantissa.bytes().filter(u8::is_ascii_digit).count() > 12;
    let v = match format!("{v:.5e}").parse() {
        Ok(rounded) if long => rounded,
        _ => v,
    };
    if (1e-5..1e15).contains(&v.abs()) { v.to_string() } else { format!("{v:e}") }
}

/// A position (mm) as text for a message, to a micrometre.
pub fn position(p: [f64; 3]) -> String {
    // Plus zero: −0 is 0.
    let [x, y, z] = p.map(|v| number((1e3 * v).round() / 1e3 + 0.0));
    format!("({x}, {y}, {z}) mm")
}

/// A message with what it quotes shortened: no word is longer than 80 characters, or 240 if it is a path, and no stretch between double
/// quotes than 1200, the length of the longest list of allowed words.
pub fn brief(message: &str) -> std::borrow::Cow<'_, str> {
    const WORD: usize = 80;
    const PATH: usize = 240;
    const STRETCH: usize = 1200;
    let cut = |s: &str, most: usize| match s.chars().count() > most {
        true => s.chars().take(most - 1).chain(['…']).collect(),
        false => s.to_string(),
    };
    if message.len() <= WORD {
        return message.into();
    }
    let stretch = |part: &str| {
        let words = part.split(' ').map(|word| cut(word, if word.contains(['/', '\\']) { PATH } else { WORD }));
        words.collect::<Vec<_>>().join(" ")
    };
    let each = message.split('"').map(|part| cut(&stretch(part), STRETCH));
    each.collect::<Vec<_>>().join("\"").into()
}

/// "1 value", "2 values".
pub fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// The allowed word nearest to `word`, if it is near enough to be meant: at most a third of its letters differ
/// (two in short words, but never all of them), letter case not counted.
pub fn nearest<'a>(word: &str, allowed: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase().replace(['-', ' '], "_");
    let limit = (word.chars().count() / 3).max(2);
    allowed
        .into_iter()
        .map(|a| (strsim::osa_distance(&word, &a.to_lowercase()), a))
        .filter(|&(d, a)| d <= limit && d < a.chars().count().max(word.chars().count()))
        .min_by_key(|&(d, _)| d)
        .map(|(_, a)| a)
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let (at, message) = (brief(&self.at), brief(&self.message));
        if at.is_empty() { f.write_str(&message) } else { write!(f, "{at}: {message}") }
    }
}

impl std::error::Error for Fault {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_is_shortened() {
        let long = "x".repeat(40_000);
        let said = Fault::new("cell", format!("unknown cell \"{long}\"; allowed: gyroid, \"{long}")).to_string();
        assert!(said.starts_with("cell: unknown cell \"xxx") && said.contains("x…\"; allowed: gyroid, \"x"), "{said}");
        assert!(said.chars().count() < 80 + 80 + 60, "{said}");
        let short =
            "a \"word\", and a path as long as they come: /some/where/else/that/is/not/too/long/for/a/line/of/text.stl";
        assert_eq!(brief(short), short);
        let allowed = format!("no cell \"x\"; use one of {}", "diamond_sheet, ".repeat(60));
        assert_eq!(brief(&allowed), allowed);
    }

    #[test]
    fn numbers_are_short() {
        for (v, text) in [
            (0.3, "0.3"),
            (0.1 + 0.2, "0.3"),
            (-70.0, "-70"),
            (1e300, "1e300"),
            (-1.5e-9, "-1.5e-9"),
            (1.000_000_1, "1.0000001"),
            (2.0 / 3.0, "0.666667"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
            (0.0, "0"),
        ] {
            assert_eq!(number(v), text);
        }
        assert_eq!((counted(1, "value"), counted(0, "value")), ("1 value".into(), "0 values".into()));
    }

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
            ("", None),
        ] {
            assert_eq!(nearest(slip, keys), want, "{slip}");
        }
        for (slip, want) in [("ü", None), ("X", Some("x")), ("xx", Some("x")), ("p", Some("pi"))] {
            assert_eq!(nearest(slip, ["x", "pi"]), want, "{slip}");
        }
    }
}
