//! Blends: tree to data.

use std::collections::BTreeMap;

use super::Read;
use super::grade::grade;
use crate::design::data::*;
use crate::kind::At;
use crate::kind::DesignError;
use geometry::fault::counted;

/// The blend of lattices with these names.
pub(super) fn blend(at: &At, names: &[&str]) -> Read<BlendSpec> {
    let f = at.fields("a blend", &["between", "weight", "of", "by"])?;
    let by = f.read("by", BySpec::Fraction, |at| {
        at.word("word", &[("fraction", BySpec::Fraction), ("value", BySpec::Value)])
    })?;
    let lattices = match (f.get("between"), f.get("of")) {
        (Some(_), Some(of)) => {
            return Err(of.error(
                "a blend is between two lattices with one weight, or of any number with a weight each; found both",
            ));
        }
        (Some(between), None) => BlendKind::Between(BetweenSpec {
            between: pair(between, names)?,
            weight: grade(f.need("weight", "how much the second counts, from 0 to 1")?)?,
        }),
        (None, Some(of)) => {
            if let Some(weight) = f.get("weight") {
                return Err(weight.error("weight goes with between; under of each lattice has its own"));
            }
            let mut each = BTreeMap::new();
            for (name, at) in of.entries("weights by the names of lattices")? {
                known(&at, name, names)?;
                each.insert(name.to_string(), grade(&at)?);
            }
            if each.len() < 2 {
                let message = format!("a blend is of at least two lattices, found {}", each.len());
                return Err(of.error(message));
            }
            BlendKind::Of(OfSpec { of: each })
        }
        (None, None) => {
            let message = "the lattices are missing; give between = [\"a\", \"b\"] with a weight, or of = { a = WEIGHT, b = WEIGHT }";
            return Err(f.at.error(message));
        }
    };
    Ok(BlendSpec { lattices, by })
}

fn pair(at: &At, names: &[&str]) -> Read<[String; 2]> {
    let items = at.list("the names of two lattices")?;
    let [a, b] = items.as_slice() else {
        let found = counted(items.len(), "name");
        return Err(at.error(format!("expected the names of two lattices, found {found}")));
    };
    let mut both = [String::new(), String::new()];
    for (at, own) in [a, b].into_iter().zip(&mut both) {
        let name = at.text("the name of a lattice")?;
        known(at, name, names)?;
        *own = name.to_string();
    }
    if both[0] == both[1] {
        return Err(b.error(format!("\"{}\" is named twice; a blend is between two lattices", both[0])));
    }
    Ok(both)
}

/// Refuses a name that no lattice has.
fn known(at: &At, name: &str, names: &[&str]) -> Read<()> {
    if names.contains(&name) {
        return Ok(());
    }
    let at = at.error("");
    Err(DesignError { line: at.line, ..DesignError::unknown(&at.path, "lattice", name, names) })
}
