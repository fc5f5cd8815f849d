//! Zones of a tetrahedral mesh that have cells of their own: named in the design by number, or by name in the mesh's file.

use std::collections::{BTreeMap, BTreeSet};

use super::data::TetCellName;
use crate::kind::DesignError;
use crate::map::CarrierMesh;

/// Zones that are listed in an error, at most.
const LISTED: usize = 12;

/// A zone with a cell of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellZone {
    /// Its number or name, as in the design.
    pub name: String,
    /// The name of its cell.
    pub cell: String,
    /// Its numbers in the mesh.
    pub numbers: Vec<i64>,
}

/// The zones of a mesh that the keys of a design mean: a name of `names`, or else a number; every zone of the mesh has one.
pub(super) fn resolved(
    cells: &BTreeMap<String, TetCellName>,
    map: &CarrierMesh,
    names: &[(i64, String)],
    path: &str,
) -> Result<Vec<CellZone>, DesignError> {
    let found: BTreeSet<i64> = (0..map.len()).map(|t| map.zone(t)).collect();
    let called = |zone: i64| {
        let of: Vec<&str> = names.iter().filter(|(n, _)| *n == zone).map(|(_, name)| name.as_str()).collect();
        if of.is_empty() { zone.to_string() } else { format!("{zone} ({})", of.join(", ")) }
    };
    let listed = |of: &[i64]| {
        let texts: Vec<String> = of.iter().take(LISTED).map(|z| called(*z)).collect();
        let more = if of.len() > LISTED { format!(" and {} more", of.len() - LISTED) } else { String::new() };
        texts.join(", ") + &more
    };
    let all: Vec<i64> = found.iter().copied().collect();
    let mut taken: BTreeMap<i64, &str> = BTreeMap::new();
    let mut out = Vec::new();
    for (key, cell) in cells {
        let at = || format!("{path}.{key}");
        let mut numbers: BTreeSet<i64> =
            names.iter().filter(|(n, name)| name == key && found.contains(n)).map(|(n, _)| *n).collect();
        if numbers.is_empty() {
            numbers.extend(key.parse::<i64>().ok().filter(|n| n.to_string() == *key && found.contains(n)));
        }
        if numbers.is_empty() {
            let message = format!("no tetrahedron of the mesh is of zone {key}; its zones are {}", listed(&all));
            return Err(DesignError::new(at(), message));
        }
        for zone in &numbers {
            if let Some(other) = taken.insert(*zone, key) {
                let message = format!(
                    "tetrahedra of zone {} are in both {other} and {key}; name groups that have none in common",
                    called(*zone)
                );
                return Err(DesignError::new(at(), message));
            }
        }
        out.push(CellZone { name: key.clone(), cell: cell.0.clone(), numbers: numbers.into_iter().collect() });
    }
    let without: Vec<i64> = found.into_iter().filter(|z| !taken.contains_key(z)).collect();
    match without[..] {
        [] => Ok(out),
        [zone] => {
            let message = format!("the mesh has a zone {}, which has no cell; give it one", called(zone));
            Err(DesignError::new(path, message))
        }
        _ => {
            let message = format!("the mesh has zones {}, which have no cell; give each one", listed(&without));
            Err(DesignError::new(path, message))
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use geometry::tetmesh::{CUBE, TetMesh};

    /// A cube whose six tetrahedra are of these zones.
    fn cube(zones: [i64; 6]) -> CarrierMesh {
        let nodes = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|v| v as f64)).collect();
        let tets = CUBE.map(|t| t.map(|v| v as u32)).to_vec();
        CarrierMesh::new(&TetMesh { nodes, tets, zones: zones.to_vec() }, 0.0).unwrap()
    }

    #[test]
    fn zones_are_named_by_number_or_by_name() {
        let map = cube([-1, -1, -2, -2, 3, 3]);
        let names =
            [(-1, "core"), (-2, "shell"), (3, "shell"), (3, "top"), (9, "nodes")].map(|(n, s)| (n, s.to_string()));
        let of = |keys: &[&str]| {
            let cells = keys.iter().map(|k| (k.to_string(), TetCellName("diamond".into()))).collect();
            resolved(&cells, &map, &names, "zones").map(|z| z.into_iter().map(|z| z.numbers).collect::<Vec<_>>())
        };
        assert_eq!(of(&["core", "shell"]).unwrap(), [vec![-1], vec![-2, 3]]);
        assert_eq!(of(&["-1", "-2", "top"]).unwrap(), [vec![-1], vec![-2], vec![3]]);
        let wrong = |keys: &[&str], path: &str, message: &str| {
            let e = of(keys).unwrap_err();
            assert_eq!((e.path.as_str(), e.message.as_str()), (path, message));
        };
        let all = "its zones are -2 (shell), -1 (core), 3 (shell, top)";
        wrong(&["core", "nodes"], "zones.nodes", &format!("no tetrahedron of the mesh is of zone nodes; {all}"));
        wrong(&["+3"], "zones.+3", &format!("no tetrahedron of the mesh is of zone +3; {all}"));
        wrong(&["core"], "zones", "the mesh has zones -2 (shell), 3 (shell, top), which have no cell; give each one");
        let both = "tetrahedra of zone 3 (shell, top) are in both shell and top; name groups that have none in common";
        wrong(&["core", "shell", "top"], "zones.top", both);
    }
}
