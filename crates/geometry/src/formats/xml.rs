//! XML documents, element by element (crate `quick-xml`). Document types are refused, so no entity can be defined.

use std::borrow::Cow;
use std::io::BufRead;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Error, Reader, XmlVersion};

use super::text::shown;
use crate::fault::Fault;

/// Reads UTF-8 XML one event after the other.
pub struct Scanner<R> {
    reader: Reader<R>,
    depth: usize,
    what: &'static str,
}

impl<R: BufRead> Scanner<R> {
    /// Reads a document that is called `what` in faults.
    pub fn new(source: R, what: &'static str) -> Self {
        Scanner { reader: Reader::from_reader(source), depth: 0, what }
    }

    /// The byte after the last event.
    pub fn at(&self) -> usize {
        self.reader.buffer_position() as usize
    }

    /// A fault at the present byte.
    pub fn fault(&self, message: impl core::fmt::Display) -> Fault {
        Fault::new("", format!("{}, byte {}: {message}", self.what, self.at()))
    }

    /// The next event, held in `buffer`; `Eof` once all elements have ended.
    ///
    /// **Errors**: what is not well-formed, not UTF-8 or ends early; document types.
    pub fn next<'b>(&mut self, buffer: &'b mut Vec<u8>) -> Result<Event<'b>, Fault> {
        buffer.clear();
        let event = self.reader.read_event_into(buffer).map_err(|e| match e {
            Error::Syntax(_) => self.fault("the document ends early: truncated"),
            e => self.fault(format!("damaged: {e}")),
        })?;
        match &event {
            Event::Start(_) => self.depth += 1,
            Event::End(_) => self.depth -= 1,
            Event::DocType(_) => return Err(self.fault("document types are not allowed")),
            Event::Eof if self.depth > 0 => return Err(self.fault("the document ends early: truncated")),
            _ => {}
        }
        Ok(event)
    }

    /// An attribute that must be there and be a number.
    pub fn required<T: core::str::FromStr>(&self, tag: &BytesStart, name: &str) -> Result<T, Fault> {
        let value = attribute(tag, name).ok_or_else(|| self.fault(format!("the attribute {name} is missing")))?;
        value.parse().map_err(|_| self.fault(format!("{name} = {} is not a number", shown(value.as_bytes()))))
    }
}

/// The value of the first attribute whose name (with its prefix) fits, without spaces about it, entities replaced.
pub fn attribute_where<'a>(tag: &'a BytesStart, fits: impl Fn(&str) -> bool) -> Option<Cow<'a, str>> {
    let found = tag.attributes().with_checks(false).flatten().find(|a| fits(a.key.into_inner()))?;
    Some(match found.normalized_value(XmlVersion::Implicit1_0) {
        Ok(Cow::Borrowed(value)) => Cow::Borrowed(value.trim_ascii()),
        Ok(Cow::Owned(value)) => Cow::Owned(value.trim_ascii().to_string()),
        // An entity that is not known: the text as it stands.
        Err(_) => found.value,
    })
}

/// The value of the attribute of this name.
pub fn attribute<'a>(tag: &'a BytesStart, name: &str) -> Option<Cow<'a, str>> {
    attribute_where(tag, |n| n == name)
}

/// Text as it may stand between tags, line ends as `\n`; characters that XML 1.0 cannot hold are left out.
pub fn escaped(text: &str) -> String {
    // Readers turn every line end into \n, and not all of them know a character reference to keep it.
    let mut text = text.replace("\r\n", "\n").replace('\r', "\n");
    text.retain(|c| !matches!(c, '\u{fffe}' | '\u{ffff}') && (c >= ' ' || c == '\n' || c == '\t'));
    quick_xml::escape::partial_escape(text).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_attributes_and_entities() {
        let text =
            b"<?xml version='1.0'?><!-- <a> --><m:a x = 'a>b\"' y=\"1&#50;&amp;\" u='&no;'><b/>t<![CDATA[<c>]]></m:a >";
        let (mut buffer, mut s) = (Vec::new(), Scanner::new(&text[..], "test"));
        let mut tags = Vec::new();
        loop {
            match s.next(&mut buffer).unwrap() {
                Event::Start(a) => {
                    assert_eq!(a.name().into_inner(), "m:a");
                    assert_eq!(attribute(&a, "x").unwrap(), "a>b\"");
                    assert_eq!(attribute(&a, "y").unwrap(), "12&");
                    assert_eq!(attribute(&a, "u").unwrap(), "&no;");
                    assert!(attribute(&a, "z").is_none());
                    let wrong = s.required::<f32>(&a, "y").unwrap_err().message;
                    assert!(
                        wrong.contains("y = ") && wrong.contains("is not a number") && !wrong.contains("12&"),
                        "{wrong}"
                    );
                }
                Event::Empty(b) => tags.push(b.name().into_inner().to_string()),
                Event::Eof => break,
                _ => {}
            }
        }
        assert_eq!(tags, ["b"]);
        let taken = |text: &[u8]| {
            let (mut buffer, mut s) = (Vec::new(), Scanner::new(text, "test"));
            while !matches!(s.next(&mut buffer)?, Event::Eof) {}
            Ok::<(), Fault>(())
        };
        for n in 40..text.len() {
            assert!(taken(&text[..n]).is_err(), "cut at {n}");
        }
        let bomb = b"<!DOCTYPE a [<!ENTITY b \"bb\">]><a>&b;</a>";
        assert!(taken(bomb).unwrap_err().message.contains("document types"));
        assert!(taken(b"<a></b>").is_err() && taken(b"<a/></a>").is_err() && taken(b"<a b='\xff'/>").is_err());
    }

    #[test]
    fn what_is_escaped_comes_back() {
        let text = "a < b && \"c\" > 'd'\n";
        assert_eq!(quick_xml::escape::unescape(&escaped(text)).unwrap(), text);
        assert_eq!(escaped("a\r\nb\rc"), "a\nb\nc");
        assert_eq!(escaped("a\u{0}b\u{1b}"), "ab");
    }
}
