//! Words and lines of text files, as bytes: names may be in any encoding.

/// A number as text files write it.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| b.is_ascii_whitespace() || *b == 0x0b).filter(|w| !w.is_empty())
}

/// A word for a message: cut when long.
pub(super) fn show(word: &[u8]) -> String {
    const MOST: usize = 24;
    let text = String::from_utf8_lossy(&word[..word.len().min(4 * MOST)]);
    let text: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().count() <= MOST {
        return format!("\"{text}\"");
    }
    format!("\"{}…\"", text.chars().take(MOST).collect::<String>())
}

/// Words of a text one by one, with the line where each stands.
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Line of the last word, from 1.
    pub(super) line: u64,
}

impl<'a> Words<'a> {
    /// The words of `bytes`, whose first line is `line`.
    pub(super) fn new(bytes: &'a [u8], line: u64) -> Self {
        Words { bytes, at: 0, line }
    }

    /// Moves to the end of the line.
    pub(super) fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
    }

    /// Bytes not yet read.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let blank = |b: u8| b.is_ascii_whitespace() || b == 0x0b;
        while let Some(&b) = self.bytes.get(self.at).filter(|&&b| blank(b)) {
            self.line += u64::from(b == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let word = &rest[..rest.iter().position(|&b| blank(b)).unwrap_or(rest.len())];
        self.at += word.len();
        (!word.is_empty()).then_some(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_lines() {
        let mut w = Words::new(b"  a b\r\n\n c rest of it\nd", 1);
        let mut next = |skip: bool| {
            let word = w.next().map(<[u8]>::to_vec);
            if skip {
                w.skip_line();
            }
            (word, w.line)
        };
        assert_eq!(next(false), (Some(b"a".to_vec()), 1));
        assert_eq!(next(false), (Some(b"b".to_vec()), 1));
        assert_eq!(next(true), (Some(b"c".to_vec()), 3));
        assert_eq!(next(false), (Some(b"d".to_vec()), 4));
        assert_eq!(next(false).0, None);
    }

    #[test]
    fn shown_words_are_short_and_printable() {
        assert_eq!(show(b"vertex"), "\"vertex\"");
        assert!(show(&[0; 1000]).chars().count() < 30);
        assert!(show(&[0xff; 1000]).chars().count() < 30);
    }
}
