//! A small XML scanner: elements and attributes, in order; text is passed over.

use std::borrow::Cow;

use crate::fault::Fault;
use crate::formats::text::shown;

/// What stands next in the document.
pub enum Event<'a> {
    /// `<name attributes>`; `empty` for `<name/>`, which has no end of its own.
    Start { name: &'a [u8], attributes: &'a [u8], empty: bool },
    /// `</name>`.
    End { name: &'a [u8] },
}

/// Reads events one after the other.
pub struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    depth: usize,
    what: &'static str,
}

fn find(bytes: &[u8], from: usize, what: &[u8]) -> Option<usize> {
    bytes.get(from..)?.windows(what.len()).position(|w| w == what).map(|i| from + i)
}

impl<'a> Scanner<'a> {
    /// Scans UTF-8 text.
    pub fn new(bytes: &'a [u8]) -> Self {
        Scanner { bytes, at: 0, depth: 0, what: "3MF model" }
    }

    /// Scans UTF-8 text that is called `what` in faults.
    pub fn of(bytes: &'a [u8], what: &'static str) -> Self {
        Scanner { what, ..Scanner::new(bytes) }
    }

    /// The byte after what was read last.
    pub fn at(&self) -> usize {
        self.at
    }

    /// A fault at the present byte.
    pub fn fault(&self, message: impl core::fmt::Display) -> Fault {
        Fault::new("", format!("{}, byte {}: {message}", self.what, self.at))
    }

    /// The next element's start or end; `None` when the root has ended.
    pub fn next(&mut self) -> Result<Option<Event<'a>>, Fault> {
        loop {
            let Some(from) = self.bytes[self.at..].iter().position(|b| *b == b'<').map(|i| self.at + i) else {
                return if self.depth == 0 { Ok(None) } else { Err(self.fault("the document ends early: truncated")) };
            };
            self.at = from;
            let rest = &self.bytes[from..];
            let until = |what: &[u8]| {
                let end = find(self.bytes, from, what);
                end.map(|e| e + what.len()).ok_or_else(|| self.fault("the document ends early: truncated"))
            };
            if rest.starts_with(b"<!--") {
                self.at = until(b"-->")?;
            } else if rest.starts_with(b"<![CDATA[") {
                self.at = until(b"]]>")?;
            } else if rest.starts_with(b"<?") {
                self.at = until(b"?>")?;
            } else if rest.starts_with(b"<!") {
                return Err(self.fault("document types are not allowed"));
            } else {
                return self.tag().map(Some);
            }
        }
    }

    fn tag(&mut self) -> Result<Event<'a>, Fault> {
        let from = self.at + 1;
        let mut quote = None;
        let end = self.bytes[from..].iter().position(|b| {
            match (quote, b) {
                (Some(q), b) if *b == q => quote = None,
                (None, b'"' | b'\'') => quote = Some(*b),
                (None, b'>') => return true,
                _ => {}
            }
            false
        });
        let Some(end) = end.map(|e| from + e) else {
            return Err(self.fault("a tag has no end: truncated"));
        };
        let inside = &self.bytes[from..end];
        self.at = end + 1;
        if let Some(name) = inside.strip_prefix(b"/") {
            self.depth = self.depth.checked_sub(1).ok_or_else(|| self.fault("an end without a start"))?;
            return Ok(Event::End { name: name.trim_ascii() });
        }
        let (inside, empty) = match inside.strip_suffix(b"/") {
            Some(i) => (i, true),
            None => (inside, false),
        };
        self.depth += usize::from(!empty);
        let split = inside.iter().position(u8::is_ascii_whitespace).unwrap_or(inside.len());
        let (name, attributes) = inside.split_at(split);
        if name.is_empty() {
            return Err(self.fault("a tag without a name"));
        }
        Ok(Event::Start { name, attributes, empty })
    }
}

/// The attributes of a tag in order: name (with its prefix) and raw value.
pub fn attributes(mut text: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    std::iter::from_fn(move || {
        let equals = text.iter().position(|b| *b == b'=')?;
        let name = text[..equals].trim_ascii();
        let rest = text[equals + 1..].trim_ascii_start();
        let quote = *rest.first().filter(|q| matches!(q, b'"' | b'\''))?;
        let end = rest[1..].iter().position(|b| *b == quote)? + 1;
        text = &rest[end + 1..];
        Some((name, &rest[1..end]))
    })
}

/// The value of the attribute of this name, entities replaced.
pub fn attribute<'a>(text: &'a [u8], name: &str) -> Option<Cow<'a, [u8]>> {
    let value = attributes(text).find(|(n, _)| *n == name.as_bytes())?.1.trim_ascii();
    Some(if value.contains(&b'&') { Cow::Owned(unescaped(value)) } else { Cow::Borrowed(value) })
}

fn unescaped(value: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(value);
    let mut parts = text.split('&');
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (entity, rest) = part.split_once(';').unwrap_or(("", part));
        let number = entity.strip_prefix("#x").map(|h| u32::from_str_radix(h, 16));
        let number = number.or_else(|| entity.strip_prefix('#').map(str::parse)).and_then(Result::ok);
        out.push(match entity {
            "lt" => '<',
            "gt" => '>',
            "amp" => '&',
            "quot" => '"',
            "apos" => '\'',
            _ => number.and_then(char::from_u32).unwrap_or(char::REPLACEMENT_CHARACTER),
        });
        out.push_str(rest);
    }
    out.into_bytes()
}

/// Text as it may stand between tags, line ends as `\n`; characters that XML 1.0 cannot hold are left out.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // Readers turn every line end into \n, and not all of them know a character reference to keep it.
    for c in text.replace("\r\n", "\n").replace('\r', "\n").chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '\u{fffe}' | '\u{ffff}' => {}
            c if c < ' ' && c != '\n' && c != '\t' => {}
            c => out.push(c),
        }
    }
    out
}

/// An attribute that must be there and be a number.
pub fn required<T: core::str::FromStr>(s: &Scanner, text: &[u8], name: &str) -> Result<T, Fault> {
    let value = attribute(text, name).ok_or_else(|| s.fault(format!("the attribute {name} is missing")))?;
    let number = core::str::from_utf8(&value).ok().and_then(|v| v.parse().ok());
    number.ok_or_else(|| s.fault(format!("{name} = {} is not a number", shown(&value))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_attributes_and_entities() {
        let text = b"<?xml?><!-- <a> --><m:a x = 'a>b\"' y=\"1&#50;&amp;\"><b/>text<![CDATA[<c>]]></m:a >";
        let mut s = Scanner::new(text);
        let Some(Event::Start { name, attributes: a, empty: false }) = s.next().unwrap() else { panic!() };
        assert_eq!(name, b"m:a");
        assert_eq!(attribute(a, "x").unwrap().as_ref(), b"a>b\"");
        assert_eq!(attribute(a, "y").unwrap().as_ref(), b"12&");
        assert!(attribute(a, "z").is_none());
        assert!(matches!(s.next().unwrap(), Some(Event::Start { name: b"b", empty: true, .. })));
        assert!(matches!(s.next().unwrap(), Some(Event::End { name: b"m:a" })));
        assert!(s.next().unwrap().is_none());
        for n in 20..text.len() {
            let mut s = Scanner::new(&text[..n]);
            assert!((0..9).any(|_| s.next().is_err()), "cut at {n}");
        }
    }

    #[test]
    fn what_is_escaped_comes_back() {
        let text = "a < b && \"c\" > 'd'\n";
        assert_eq!(unescaped(escaped(text).as_bytes()), text.as_bytes());
        assert_eq!(escaped("a\r\nb\rc"), "a\nb\nc");
        assert_eq!(escaped("a\u{0}b\u{1b}"), "ab");
    }
}
