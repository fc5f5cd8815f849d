//! Lines, words and numbers of text files, with the line for messages.

use crate::fault::Fault;

/// The lines of a file, numbered from one. A backslash at a line's end joins the next line to it.
pub struct NumberedLines<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> NumberedLines<'a> {
    /// The lines of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        NumberedLines { rest: bytes, line: 0 }
    }
}

impl<'a> Iterator for NumberedLines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let all = self.rest;
        self.line += 1;
        let first = self.line;
        let mut from = 0;
        let (end, after) = loop {
            let Some(n) = all[from..].iter().position(|b| matches!(b, b'\n' | b'\r')) else {
                break (all.len(), all.len());
            };
            let end = from + n;
            let after = if all[end..].starts_with(b"\r\n") { end + 2 } else { end + 1 };
            if end == 0 || all[end - 1] != b'\\' {
                break (end, after);
            }
            self.line += 1;
            from = after;
        };
        self.rest = &all[after..];
        Some((first, &all[..end]))
    }
}

/// The place of the column of a table whose heading is a name, perhaps with a unit behind it; letter case is not counted.
pub fn column<T: AsRef<str>>(headings: &[T], name: &str) -> Option<usize> {
    headings.iter().position(|h| heading(h.as_ref()).0.eq_ignore_ascii_case(name))
}

/// The name and the unit of a heading such as "x [mm]" or "x (mm)"; "" if there is no unit.
pub fn heading(text: &str) -> (&str, &str) {
    let (name, unit) = text.split_once(['[', '(']).unwrap_or((text, ""));
    (name.trim(), unit.trim().trim_end_matches([']', ')']).trim())
}

/// The words of a line: what lies between spaces (and joining backslashes).
pub fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| b.is_ascii_whitespace() || *b == b'\\').filter(|w| !w.is_empty())
}

/// What was found, for a message, where it is a short word or number: what else stands in a file may be nobody's business, if it is
/// another file than was meant.
pub fn shown(word: &[u8]) -> String {
    const SHORT: usize = 16;
    let plain = |b: &u8| b.is_ascii_alphanumeric() || b"_.+-#*%/,".contains(b);
    match core::str::from_utf8(word) {
        Ok(text) if text.len() <= SHORT && word.iter().all(plain) => format!("\"{text}\""),
        _ => "some text".to_string(),
    }
}

/// A fault at a line.
pub fn at_line(line: usize, message: impl core::fmt::Display) -> Fault {
    Fault::new("", format!("line {line}: {message}"))
}

/// A word as a number of type `T`.
pub fn parse<T: core::str::FromStr>(word: &[u8]) -> Option<T> {
    core::str::from_utf8(word).ok()?.parse().ok()
}

/// The next word as a finite number.
pub fn coordinate(line: usize, word: Option<&[u8]>) -> Result<f64, Fault> {
    let Some(word) = word else {
        return Err(at_line(line, "a coordinate is missing: expected three numbers"));
    };
    match parse::<f64>(word) {
        Some(v) if v.is_finite() => Ok(v),
        Some(v) => Err(at_line(line, format!("coordinate {v} is not finite"))),
        None => Err(at_line(line, format!("{} is not a number", shown(word)))),
    }
}

/// The next three words as a position.
pub fn position<'a>(line: usize, mut words: impl Iterator<Item = &'a [u8]>) -> Result<[f64; 3], Fault> {
    Ok([coordinate(line, words.next())?, coordinate(line, words.next())?, coordinate(line, words.next())?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_any_of_the_three_ways_and_join_by_backslash() {
        let got: Vec<_> =
            NumberedLines::new(b"a\r\nb\rc\n\nd \\\n e\nf").map(|(n, l)| (n, words(l).count(), l.len())).collect();
        assert_eq!(got, [(1, 1, 1), (2, 1, 1), (3, 1, 1), (4, 0, 0), (5, 2, 6), (7, 1, 1)]);
    }

    #[test]
    fn numbers_must_be_finite() {
        assert_eq!(position(1, words(b"1 -2e1 .5")).unwrap(), [1.0, -20.0, 0.5]);
        for bad in [&b"1 2"[..], b"1 nan 3", b"1 2 1e999", b"1 2 x\xff"] {
            assert!(position(9, words(bad)).unwrap_err().message.starts_with("line 9: "));
        }
    }
}
