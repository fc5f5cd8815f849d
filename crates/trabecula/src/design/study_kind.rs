//! A sweep: which keys of a design vary, and how their values are chosen. What is made of it is a table, a row a design.

use std::collections::BTreeMap;

use super::Design;
use crate::kind::{Defs, DesignError, Fault, Key, Kind, Node, NodeCursor, Table, Value};
use geometry::fault::nearest;

/// What varies: keys of the design by their paths, such as "lattice.core.level.fraction" = [0.2, 0.3, 0.4].
#[derive(Clone, Debug, PartialEq)]
pub struct StudySweep {
    /// How values are chosen.
    pub settings: SweepSettings,
    /// The values of each path.
    pub parameters: BTreeMap<String, ParameterKind>,
}

/// How the values of a sweep are chosen.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "SweepSettings", noun = "a sweep")]
pub struct SweepSettings {
    /// Which combinations of values.
    #[kind(default)]
    pub sampling: Sampling,
    /// The number of designs; of a grid it follows from the values.
    #[kind(min = 1.0)]
    pub count: Option<u32>,
    /// Seed of the random choices; the same seed gives the same designs.
    #[kind(default = 0)]
    pub seed: u32,
    /// Conditions that designs keep, such as "region.box.size[0] >= 2 * lattice.core.map.affine.wavelength"; others are left out.
    #[kind(rename = "where", default)]
    pub conditions: Vec<String>,
}

/// Which combinations of values a sweep takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "sampling")]
pub enum Sampling {
    /// Every combination.
    #[default]
    #[kind(hints("full", "factorial", "product"))]
    Grid,
    /// A Latin hypercube: each range in `count` equal parts, a value in each.
    #[kind(hints("lhs", "latin_hypercube", "random"))]
    Latin,
    /// A Sobol sequence, shifted by the seed: even in all projections.
    #[kind(hints("quasi_random", "halton"))]
    Sobol,
}

/// The values of one key.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum ParameterKind {
    /// Each of a list.
    Values(Vec<AnyValue>),
    /// From one number to another.
    Range(RangeKind),
}

/// Numbers of a range.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "SweepRange", noun = "a range")]
pub struct RangeKind {
    /// The first number.
    pub from: f64,
    /// The last number.
    pub to: f64,
    /// How many in a grid, ends included.
    #[kind(min = 2.0)]
    pub count: Option<u32>,
    /// Equal steps, or equal ratios.
    #[kind(default)]
    pub scale: Scale,
}

/// How the numbers of a range follow each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "scale")]
pub enum Scale {
    /// In equal steps.
    #[default]
    Linear,
    /// In equal ratios; both ends are greater than 0.
    Log,
}

/// Whatever can stand in a design.
#[derive(Clone, Debug, PartialEq)]
pub struct AnyValue(pub Node);

impl Kind for AnyValue {
    fn expected() -> String {
        "a value".into()
    }

    fn fits(_: &Node) -> u8 {
        1
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        Ok(AnyValue(at.node.clone()))
    }

    fn write(&self) -> Node {
        self.0.clone()
    }

    fn check(&self, _: &Key) -> Result<(), Fault> {
        Ok(())
    }

    fn schema(_: &Key, _: &mut Defs) -> Node {
        Value::Table(Vec::new()).into()
    }
}

impl Kind for StudySweep {
    const DOC: &'static str = "What varies in a sweep: keys of the design by their paths, each with its values.";

    fn expected() -> String {
        "a sweep (a table of paths of keys, each with a list of values or a range { from, to })".into()
    }

    fn fits(node: &Node) -> u8 {
        u8::from(matches!(node.value, Value::Table(_)))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        let known: Vec<&str> = SweepSettings::keys().iter().map(|k| k.name).collect();
        let entries = at.entries(&Self::expected())?;
        let (own, varied): (Vec<_>, Vec<_>) = entries.into_iter().partition(|(key, _)| known.contains(key));
        let own = own.into_iter().map(|(key, at)| (key.to_string(), at.node.line, at.node.clone())).collect();
        let own = Node { value: Value::Table(own), line: at.node.line };
        let settings = SweepSettings::read(&NodeCursor::alone(&own, &at.path))?;
        let mut parameters = BTreeMap::new();
        for (path, at) in varied {
            top_level(path, &at, &known)?;
            collect(path, &at, &mut parameters)?;
        }
        if parameters.is_empty() {
            let message = "nothing varies; give a key of the design by its path, such as \"lattice.core.level.fraction\" = [0.2, 0.3]";
            return Err(at.error(message));
        }
        Ok(StudySweep { settings, parameters })
    }

    fn write(&self) -> Node {
        let mut entries = Vec::new();
        self.settings.put(&mut entries);
        entries.extend(self.parameters.iter().map(|(path, of)| (path.clone(), None, of.write())));
        Value::Table(entries).into()
    }

    fn check(&self, key: &Key) -> Result<(), Fault> {
        self.settings.check(key)?;
        if self.settings.sampling != Sampling::Grid && self.settings.count.is_none() {
            return Err(Fault::new("count", "the number of designs is missing: only a grid has one by itself"));
        }
        if self.settings.sampling == Sampling::Grid && self.settings.count.is_some() {
            let message = "a grid is every combination of the values: leave the number of designs out, or choose sampling = \"latin\" or \
                           \"sobol\"";
            return Err(Fault::new("count", message));
        }
        for (path, of) in &self.parameters {
            of.check(&Key::NONE).and_then(|()| self.possible(of)).map_err(|f| f.under(path))?;
        }
        Ok(())
    }

    fn schema(_: &Key, defs: &mut Defs) -> Node {
        let values = ParameterKind::schema(&Key::NONE, defs);
        let words = "The keys of a path that is written without quotes, each a table in another.";
        let nested =
            defs.named("StudyTable", |_| Node::table([("type", "object".into()), ("description", words.into())]));
        defs.named("Study", |defs| {
            let settings = crate::kind::OpenTable::of::<SweepSettings>(defs).closed();
            settings
                .with("description", Self::DOC.into())
                .with("additionalProperties", crate::kind::any_schema("", vec![values, nested]))
        })
    }
}

impl StudySweep {
    /// Refuses values that the sampling cannot take.
    fn possible(&self, of: &ParameterKind) -> Result<(), Fault> {
        match of {
            ParameterKind::Values(values) if values.is_empty() => {
                Err(Fault::new("", "at least one value needed, found none"))
            }
            ParameterKind::Range(range) if range.scale == Scale::Log && !(range.from > 0.0 && range.to > 0.0) => {
                Err(Fault::new("scale", "a range in equal ratios has both ends greater than 0"))
            }
            ParameterKind::Range(range) if self.settings.sampling == Sampling::Grid && range.count.is_none() => {
                let message = "count is missing: how many values a grid takes from the range, or choose sampling = \"latin\" or \"sobol\"";
                Err(Fault::new("", message))
            }
            _ => Ok(()),
        }
    }

    /// Values that stand for all of each path: those of a list, the ends of a range.
    pub(super) fn samples(&self) -> impl Iterator<Item = (&str, Vec<Node>)> {
        self.parameters.iter().map(|(path, of)| {
            let values = match of {
                ParameterKind::Values(values) => values.iter().take(64).map(|v| v.0.clone()).collect(),
                ParameterKind::Range(range) => vec![range.from.into(), range.to.into()],
            };
            (path.as_str(), values)
        })
    }
}

/// Refuses what is neither a setting nor the path of a key of a design.
fn top_level(path: &str, at: &NodeCursor, settings: &[&str]) -> Result<(), DesignError> {
    let first = path.split(['.', '[']).next().unwrap_or_default();
    let keys = Design::keys();
    let allowed: Vec<&str> = keys.iter().map(|k| k.name).filter(|n| *n != "sweep").collect();
    if allowed.contains(&first) {
        return Ok(());
    }
    let words: Vec<&str> = settings.iter().chain(&allowed).copied().collect();
    let unknown = DesignError::unknown_but("sweep", "key", first, &words, nearest(first, words.iter().copied()));
    Err(DesignError { line: at.node.line, ..unknown })
}

/// Adds the values of a path; tables without `from` are paths without quotes.
fn collect(path: &str, at: &NodeCursor, out: &mut BTreeMap<String, ParameterKind>) -> Result<(), DesignError> {
    if matches!(at.node.value, Value::Table(_)) && at.node.get("from").is_none() && at.node.get("to").is_none() {
        let below = at.entries("values")?;
        return below.into_iter().try_for_each(|(key, at)| collect(&format!("{path}.{key}"), &at, out));
    }
    match out.insert(path.to_string(), ParameterKind::read(at)?) {
        None => Ok(()),
        Some(_) => Err(at.error("given twice")),
    }
}
