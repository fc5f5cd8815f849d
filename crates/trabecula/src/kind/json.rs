//! JSON to tree, with the line of every key and no key given twice.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::io::{self, Read};

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use super::error::DesignError;
use super::node::{Node, Value};

impl Node {
    /// Reads JSON.
    pub fn from_json(text: &str) -> Result<Node, DesignError> {
        read(text)
    }
}

fn read(text: &str) -> Result<Node, DesignError> {
    let line = Cell::new(1);
    let counted = Counted { bytes: text.as_bytes(), line: &line };
    let refused = RefCell::new(None);
    let mut reader = serde_json::Deserializer::from_reader(counted);
    let root = NodeSeed { path: String::new(), line: &line, refused: &refused };
    let read = root.deserialize(&mut reader).and_then(|node| reader.end().map(|()| node));
    read.map_err(|e| {
        refused.take().unwrap_or_else(|| DesignError {
            line: Some(e.line()),
            ..DesignError::new("", format!("not readable as JSON: {e}"))
        })
    })
}

/// Bytes handed over one by one, so that the line is that of the reader.
struct Counted<'a> {
    bytes: &'a [u8],
    line: &'a Cell<usize>,
}

impl Read for Counted<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let n = self.bytes.len().min(out.len()).min(1);
        out[..n].copy_from_slice(&self.bytes[..n]);
        if self.bytes.first() == Some(&b'\n') && n == 1 {
            self.line.set(self.line.get() + 1);
        }
        self.bytes = &self.bytes[n..];
        Ok(n)
    }
}

/// A value about to be read, and the path to it.
struct NodeSeed<'a> {
    path: String,
    line: &'a Cell<usize>,
    refused: &'a RefCell<Option<DesignError>>,
}

impl<'de> DeserializeSeed<'de> for NodeSeed<'_> {
    type Value = Node;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Node, D::Error> {
        let line = Some(self.line.get());
        let value = from.deserialize_any(self)?;
        Ok(Node { value, line })
    }
}

impl<'de> Visitor<'de> for NodeSeed<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_bool<E>(self, v: bool) -> Result<Value, E> {
        Ok(Value::Bool(v))
    }

    fn visit_i64<E>(self, v: i64) -> Result<Value, E> {
        Ok(Value::Number(v as f64))
    }

    fn visit_u64<E>(self, v: u64) -> Result<Value, E> {
        Ok(Value::Number(v as f64))
    }

    fn visit_f64<E>(self, v: f64) -> Result<Value, E> {
        Ok(Value::Number(v))
    }

    fn visit_str<E>(self, v: &str) -> Result<Value, E> {
        Ok(Value::Text(v.to_string()))
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Other("null".into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<Value, A::Error> {
        let mut items = Vec::new();
        let item = |i| NodeSeed { path: format!("{}[{i}]", self.path), ..self };
        while let Some(node) = from.next_element_seed(item(items.len()))? {
            items.push(node);
        }
        Ok(Value::List(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut from: A) -> Result<Value, A::Error> {
        let mut entries: Vec<(String, Option<usize>, Node)> = Vec::new();
        while let Some(key) = from.next_key::<String>()? {
            let line = Some(self.line.get());
            let path = if self.path.is_empty() { key.clone() } else { format!("{}.{key}", self.path) };
            if let Some((_, first, _)) = entries.iter().find(|e| e.0 == key) {
                let first = first.map_or(String::new(), |l| format!(" (first on line {l})"));
                let message = format!("the key \"{key}\" is given twice{first}; keep one");
                *self.refused.borrow_mut() = Some(DesignError { line, ..DesignError::new(path, message).found(key) });
                return Err(A::Error::custom("a key is given twice"));
            }
            let value = from.next_value_seed(NodeSeed { path, ..self })?;
            entries.push((key, line, value));
        }
        Ok(Value::Table(entries))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_lines_and_stand_once() {
        let node = read("{\n  \"a\": 1,\n  \"b\": [1,\n    {\"c\": null}],\n \"d\": 1e3\n}").expect("readable");
        let lines = node.lines();
        for (path, line) in [("a", 2), ("b", 3), ("b[1].c", 4), ("d", 5)] {
            assert_eq!(lines.line(path), Some(line), "{path}");
        }
        let e = read("{\"a\": {\n\"b\": 1,\n\"c\": [{\"x\": 1, \"x\": 2}],\n\"b\": 2}}").expect_err("twice");
        assert_eq!((e.path.as_str(), e.line), ("a.c[0].x", Some(3)));
        let e = read("{\"a\": {\n\"b\": 1,\n\"b\": 2}}").expect_err("twice");
        assert_eq!((e.path.as_str(), e.line), ("a.b", Some(3)));
        assert!(e.message.contains("\"b\" is given twice (first on line 2)"));
        assert!(read("{} 1").is_err() && read(&"[".repeat(100_000)).is_err());
    }
}
