//! Kinds without keys: numbers, words, lists, maps; and small types that many kinds use.

use std::collections::BTreeMap;

use super::{Defs, DesignError, Fault, Key, Kind, Node, NodeCursor, Value};
use geometry::fault::counted;

impl Kind for f64 {
    fn expected() -> String {
        "a number".into()
    }

    fn fits(node: &Node) -> u8 {
        u8::from(matches!(node.value, Value::Number(_) | Value::Whole(_)))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        at.number()
    }

    fn write(&self) -> Node {
        (*self).into()
    }

    fn check(&self, key: &Key) -> Result<(), Fault> {
        key.admit(*self)
    }

    fn schema(key: &Key, _: &mut Defs) -> Node {
        let mut node = Node::table([("type", "number".into())]);
        let limits = [
            ("exclusiveMinimum", key.above),
            ("minimum", key.min),
            ("exclusiveMaximum", key.below),
            ("maximum", key.max),
        ];
        for (word, limit) in limits.into_iter().filter(|l| l.1.is_finite()) {
            node = node.with(word, limit.into());
        }
        node
    }
}

macro_rules! whole {
    ($($type:ty),*) => {$(
        impl Kind for $type {
            fn expected() -> String {
                "a whole number".into()
            }

            fn fits(node: &Node) -> u8 {
                f64::fits(node)
            }

            fn read(at: &NodeCursor) -> Result<Self, DesignError> {
                let v = at.number()?;
                let inside = v >= f64::from(<$type>::MIN) && v <= f64::from(<$type>::MAX);
                if v.fract() == 0.0 && inside { Ok(v as $type) } else { Err(at.expected(&Self::expected())) }
            }

            fn write(&self) -> Node {
                Value::Whole(i64::from(*self)).into()
            }

            fn check(&self, key: &Key) -> Result<(), Fault> {
                key.admit(f64::from(*self))
            }

            fn schema(key: &Key, defs: &mut Defs) -> Node {
                let min = if <$type>::MIN == 0 { key.min.max(0.0) } else { key.min };
                f64::schema(&Key { min, ..*key }, defs).with("type", "integer".into())
            }
        }
    )*};
}
whole!(u32, i32);

impl Kind for bool {
    fn expected() -> String {
        "true or false".into()
    }

    fn fits(node: &Node) -> u8 {
        u8::from(matches!(node.value, Value::Bool(_)))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        at.truth()
    }

    fn write(&self) -> Node {
        (*self).into()
    }

    fn check(&self, _: &Key) -> Result<(), Fault> {
        Ok(())
    }

    fn schema(_: &Key, _: &mut Defs) -> Node {
        Node::table([("type", "boolean".into())])
    }
}

impl Kind for String {
    fn expected() -> String {
        "text".into()
    }

    fn fits(node: &Node) -> u8 {
        u8::from(matches!(node.value, Value::Text(_)))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        at.text(&Self::expected()).map(str::to_string)
    }

    fn write(&self) -> Node {
        self.as_str().into()
    }

    fn check(&self, _: &Key) -> Result<(), Fault> {
        Ok(())
    }

    fn schema(_: &Key, _: &mut Defs) -> Node {
        Node::table([("type", "string".into())])
    }
}

impl<T: Kind> Kind for Box<T> {
    const DOC: &'static str = T::DOC;

    fn expected() -> String {
        T::expected()
    }

    fn fits(node: &Node) -> u8 {
        T::fits(node)
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        T::read(at).map(Box::new)
    }

    fn write(&self) -> Node {
        (**self).write()
    }

    fn check(&self, key: &Key) -> Result<(), Fault> {
        (**self).check(key)
    }

    fn schema(key: &Key, defs: &mut Defs) -> Node {
        T::schema(key, defs)
    }
}

/// Checks each item; a fault is at its index.
fn each<T: Kind>(items: &[T], key: &Key) -> Result<(), Fault> {
    items.iter().enumerate().try_for_each(|(i, item)| item.check(key).map_err(|f| f.under(&format!("[{i}]"))))
}

fn list_schema<T: Kind>(key: &Key, defs: &mut Defs) -> Node {
    Node::table([("type", "array".into()), ("items", T::schema(&Key { least: 0, ..*key }, defs))])
}

impl<T: Kind> Kind for Vec<T> {
    fn expected() -> String {
        format!("a list, each {}", T::expected())
    }

    fn fits(node: &Node) -> u8 {
        2 * u8::from(matches!(node.value, Value::List(_)))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        at.list(&Self::expected())?.iter().map(T::read).collect()
    }

    fn write(&self) -> Node {
        self.iter().map(Kind::write).collect::<Vec<Node>>().into()
    }

    fn check(&self, key: &Key) -> Result<(), Fault> {
        if self.len() < key.least {
            let message = format!("at least {} needed, found {}", counted(key.least, "item"), self.len());
            return Err(Fault::new("", message));
        }
        each(self, key)
    }

    fn schema(key: &Key, defs: &mut Defs) -> Node {
        let node = list_schema::<T>(key, defs);
        if key.least == 0 { node } else { node.with("minItems", Value::Whole(key.least as i64).into()) }
    }
}

impl<T: Kind, const N: usize> Kind for [T; N] {
    fn expected() -> String {
        let words = ["no", "one", "two", "three", "four", "five", "six"];
        let count = words.get(N).map_or(N.to_string(), |w| w.to_string());
        match (T::expected().as_str(), N) {
            ("a number", 3) => "three numbers [x, y, z]".into(),
            ("a number", _) => format!("{count} numbers"),
            ("a whole number", _) => format!("{count} whole numbers"),
            (of, _) if of.len() < 40 => format!("a list of {count}, each {of}"),
            _ => format!("a list of {count}"),
        }
    }

    fn fits(node: &Node) -> u8 {
        match &node.value {
            Value::List(items) => 1 + u8::from(items.len() == N),
            _ => 0,
        }
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        let items = at.list(&Self::expected())?;
        let wrong = || at.error(format!("expected {}, found {}", Self::expected(), counted(items.len(), "value")));
        if items.len() != N {
            return Err(wrong());
        }
        let read = items.iter().map(T::read).collect::<Result<Vec<T>, DesignError>>()?;
        read.try_into().map_err(|_| wrong())
    }

    fn write(&self) -> Node {
        self.iter().map(Kind::write).collect::<Vec<Node>>().into()
    }

    fn check(&self, key: &Key) -> Result<(), Fault> {
        each(self, key)
    }

    fn schema(key: &Key, defs: &mut Defs) -> Node {
        let count = || Value::Whole(N as i64).into();
        list_schema::<T>(key, defs).with("minItems", count()).with("maxItems", count())
    }
}

/// The name of an entry: text, or a whole number.
pub(crate) trait Name: Ord + Sized + ToString {
    /// What a table of such names is.
    const TABLE: &'static str;
    /// A regular expression that all names match.
    const PATTERN: Option<&'static str>;

    /// The name, if it is one.
    fn of(word: &str) -> Option<Self>;
}

impl Name for String {
    const TABLE: &'static str = "a table of names";
    const PATTERN: Option<&'static str> = None;

    fn of(word: &str) -> Option<Self> {
        Some(word.into())
    }
}

impl Name for u32 {
    const TABLE: &'static str = "a table of whole numbers";
    const PATTERN: Option<&'static str> = Some("^(0|[1-9][0-9]*)$");

    fn of(word: &str) -> Option<Self> {
        word.parse::<u32>().ok().filter(|n| n.to_string() == word)
    }
}

impl<N: Name, T: Kind> Kind for BTreeMap<N, T> {
    fn expected() -> String {
        N::TABLE.into()
    }

    fn fits(node: &Node) -> u8 {
        u8::from(matches!(node.value, Value::Table(_)))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        let entry = |(name, at): (&str, NodeCursor)| match N::of(name) {
            Some(name) => Ok((name, T::read(&at)?)),
            None => Err(at.error(format!("expected a whole number from 0, found \"{name}\""))),
        };
        at.entries(&Self::expected())?.into_iter().map(entry).collect()
    }

    fn write(&self) -> Node {
        Value::Table(self.iter().map(|(name, of)| (name.to_string(), None, of.write())).collect()).into()
    }

    fn check(&self, key: &Key) -> Result<(), Fault> {
        if self.len() < key.least {
            let message = format!("at least {} needed, found {}", counted(key.least, "item"), self.len());
            return Err(Fault::new("", message));
        }
        self.iter().try_for_each(|(name, of)| of.check(key).map_err(|f| f.under(&name.to_string())))
    }

    fn schema(key: &Key, defs: &mut Defs) -> Node {
        let of = T::schema(&Key { least: 0, ..*key }, defs);
        let mut node = Node::table([("type", "object".into()), ("additionalProperties", of)]);
        if let Some(pattern) = N::PATTERN {
            node = node.with("propertyNames", Node::table([("pattern", pattern.into())]));
        }
        if key.least == 0 { node } else { node.with("minProperties", Value::Whole(key.least as i64).into()) }
    }
}

/// A number, or three of them along x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum OneOrThree {
    /// The same along all three axes.
    One(f64),
    /// Along x, y, z.
    Three([f64; 3]),
}

impl OneOrThree {
    /// The three numbers.
    pub fn three(self) -> [f64; 3] {
        match self {
            OneOrThree::One(v) => [v; 3],
            OneOrThree::Three(v) => v,
        }
    }
}

/// A number, or two.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum OneOrTwo {
    /// The same for both.
    One(f64),
    /// One for each.
    Two([f64; 2]),
}

impl OneOrTwo {
    /// The two numbers.
    pub fn two(self) -> [f64; 2] {
        match self {
            OneOrTwo::One(v) => [v; 2],
            OneOrTwo::Two(v) => v,
        }
    }
}

/// A unit of length in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
pub enum Unit {
    /// Millimetre.
    Mm,
    /// 0.001 mm.
    Micron,
    /// 10 mm.
    Cm,
    /// 1000 mm.
    M,
    /// 25.4 mm.
    Inch,
    /// 304.8 mm.
    Foot,
}

impl Unit {
    /// Its length in mm.
    pub fn in_mm(self) -> f64 {
        match self {
            Unit::Micron => 0.001,
            Unit::Mm => 1.0,
            Unit::Cm => 10.0,
            Unit::M => 1000.0,
            Unit::Inch => 25.4,
            Unit::Foot => 304.8,
        }
    }

    /// All units.
    pub const ALL: [Unit; 6] = [Unit::Mm, Unit::Micron, Unit::Cm, Unit::M, Unit::Inch, Unit::Foot];

    /// Whether a word is one of its names, letter case not counted.
    pub fn has_name(self, word: &str) -> bool {
        self.names().iter().any(|name| name.eq_ignore_ascii_case(word))
    }

    /// Its names in headings of tables, that of designs first.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Unit::Micron => &["micron", "um", "µm", "μm"],
            Unit::Mm => &["mm", "millimetre", "millimeter"],
            Unit::Cm => &["cm", "centimetre", "centimeter"],
            Unit::M => &["m", "metre", "meter"],
            Unit::Inch => &["inch", "in"],
            Unit::Foot => &["foot", "ft"],
        }
    }
}

impl core::str::FromStr for Unit {
    type Err = DesignError;

    fn from_str(word: &str) -> Result<Unit, DesignError> {
        Unit::read(&NodeCursor::root(&word.into()))
    }
}
