//! Text of ISO 10303-21, the clear text encoding of STEP: numbered entities in the order in which they are written.

use core::fmt::{self, Display, Write as _};
use std::collections::HashMap;
use std::io;

use geometry::math::Vec3;

/// The number of an entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Id(u64);

impl Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// A file that is being written.
pub(super) struct Part21<'a> {
    out: &'a mut dyn io::Write,
    last: u64,
    /// Entities that others share, by their text.
    shared: HashMap<String, Id>,
}

impl<'a> Part21<'a> {
    /// Starts a file of a schema, under a name. The time stamp is left empty, so that the same data give the same bytes.
    pub(super) fn new(out: &'a mut dyn io::Write, name: &str, schema: &str) -> io::Result<Part21<'a>> {
        write!(
            out,
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME({},'',(''),(''),'Trabecula {}','Trabecula','');\n\
             FILE_SCHEMA(('{schema}'));\nENDSEC;\nDATA;\n",
            string(name),
            env!("CARGO_PKG_VERSION")
        )?;
        Ok(Part21 { out, last: 0, shared: HashMap::new() })
    }

    /// Writes an entity.
    pub(super) fn entity(&mut self, text: &str) -> io::Result<Id> {
        self.last += 1;
        writeln!(self.out, "#{}={text};", self.last)?;
        Ok(Id(self.last))
    }

    /// An entity of this text: the one that was written before, if any was.
    pub(super) fn shared(&mut self, text: &str) -> io::Result<Id> {
        if let Some(known) = self.shared.get(text) {
            return Ok(*known);
        }
        let id = self.entity(text)?;
        self.shared.insert(text.to_string(), id);
        Ok(id)
    }

    /// Writes a point of two or three coordinates.
    pub(super) fn point(&mut self, at: &[f64]) -> io::Result<Id> {
        self.entity(&point(at))
    }

    /// A unit vector, shared.
    pub(super) fn direction(&mut self, along: Vec3) -> io::Result<Id> {
        self.shared(&format!("DIRECTION('',{})", list(along.map(real))))
    }

    /// Ends the file.
    pub(super) fn finish(self) -> io::Result<()> {
        self.out.write_all(b"ENDSEC;\nEND-ISO-10303-21;\n")?;
        self.out.flush()
    }
}

fn point(at: &[f64]) -> String {
    format!("CARTESIAN_POINT('',{})", list(at.iter().map(|v| real(*v))))
}

/// Items in parentheses.
pub(super) fn list<T: Display>(items: impl IntoIterator<Item = T>) -> String {
    let mut out = String::from("(");
    for (k, item) in items.into_iter().enumerate() {
        if k > 0 {
            out.push(',');
        }
        // Formatting into a string cannot fail.
        let _ = write!(out, "{item}");
    }
    out.push(')');
    out
}

/// A finite number in the fewest digits that read back as the same number.
pub(super) fn real(v: f64) -> String {
    let text = format!("{v:?}");
    match text.split_once('e') {
        None => text.strip_suffix('0').filter(|t| t.ends_with('.')).unwrap_or(&text).to_string(),
        Some((digits, power)) => format!("{digits}{}E{power}", if digits.contains('.') { "" } else { "." }),
    }
}

/// A string in quotes: apostrophes and backslashes doubled, other characters than printable ASCII as UTF-16.
pub(super) fn string(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        match c {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            _ => {
                out.push_str("\\X2\\");
                c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| out.push_str(&format!("{unit:04X}")));
                out.push_str("\\X0\\");
            }
        }
    }
    out.push('\'');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_read_back() {
        let cases =
            [(0.0, "0."), (1.0, "1."), (-2.5, "-2.5"), (1e-7, "1.E-7"), (1.25e300, "1.25E300"), (100.0, "100.")];
        for (v, text) in cases {
            assert_eq!(real(v), text);
        }
        for v in [0.1 + 0.2, core::f64::consts::PI * 1e-9, f64::MIN_POSITIVE, -1e22] {
            assert_eq!(real(v).parse::<f64>(), Ok(v));
        }
    }

    #[test]
    fn strings_are_printable_ascii() {
        assert_eq!(string("a 'b' \\"), "'a ''b'' \\\\'");
        assert_eq!(string("Ø"), "'\\X2\\00D8\\X0\\'");
    }
}
