//! Sets of volume meshes that a design names: all surface within a region, to hold or to load.

use std::cell::RefCell;
use std::collections::BTreeMap;

use super::{Design, Loader};
use crate::environment;
use crate::kind::{DesignError, Kind, NodeCursor, Table};
use crate::region::{Notes, Region, RegionKind};
use crate::volume_mesh::is_own_name;
use geometry::fault::number;

/// Regions whose surface is a set of volume meshes, by name.
#[derive(Clone, Debug, Default, PartialEq, Kind)]
#[kind(before = names)]
pub struct SetSpecs(pub BTreeMap<String, RegionKind>);

/// Checks names: programs that read sets take letters, digits and underscores, and many do not tell capitals from small letters.
fn names(at: &NodeCursor) -> Result<(), DesignError> {
    let mut before: Vec<&str> = Vec::new();
    for (name, at) in at.entries("regions by name, such as [set.bolt.cylinder]")? {
        if RegionKind::keys().iter().any(|k| k.name == name) && RegionKind::read(&at).is_err() {
            let message = format!("a name comes first, such as [set.bolt.{name}]: {name} is a kind of region");
            return Err(at.error(message));
        }
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !plain || !name.starts_with(|c: char| c.is_ascii_alphabetic()) || name.len() > 64 {
            let rule = "a name of a set has letters, digits and underscores, at most 64, and starts with a letter";
            return Err(at.error(format!("{rule}; found \"{name}\"")));
        }
        if is_own_name(name) {
            return Err(at.error(format!("{name} is a set that every volume mesh has by itself; use another name")));
        }
        if let Some(same) = before.iter().find(|n| n.eq_ignore_ascii_case(name)) {
            let message = format!("{same} and {name} differ in capitals alone, which solvers ignore; rename one");
            return Err(at.error(message));
        }
        before.push(name);
    }
    Ok(())
}

/// The regions of the sets. What is nowhere near the part is refused here, what holds none of its surface once it is meshed.
pub(super) fn sets(
    d: &Design,
    region: &Region,
    loader: &dyn Loader,
    notes: &RefCell<Notes>,
) -> Result<Vec<(String, Region)>, DesignError> {
    let mut made = Vec::new();
    for (name, spec) in &d.set.0 {
        let path = format!("set.{name}");
        let zone = environment::region(spec, &path, loader, Some(region), notes)?;
        let (b, r) = (zone.bounds(), region.bounds());
        if (0..3).any(|k| b.min[k] > r.max[k] || b.max[k] < r.min[k]) || b.is_empty() {
            let corner = |v: [f64; 3]| v.map(number).join(", ");
            let message = format!(
                "the set is empty: it reaches from ({}) to ({}) mm, the region from ({}) to ({}) mm",
                corner(b.min),
                corner(b.max),
                corner(r.min),
                corner(r.max)
            );
            return Err(DesignError::new(path, message));
        }
        made.push((name.clone(), zone));
    }
    Ok(made)
}
