//! A unit cell placed over a box by a map: nodes are carried, struts stay straight.

use std::collections::HashMap;

use crate::map::Map;
use beams::graph::{MOST, Net, Wire};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3, add, determinant};

/// Steps of the grid along an axis on which a map is looked at to count cells.
const LOOKS: usize = 9;

/// How many struts a cell placed by a map has in a box, about.
pub fn expected(net: &Net, map: &Map, bounds: &Aabb) -> f64 {
    let size = bounds.size();
    let at = |i: usize, a: usize| bounds.min[a] + size[a] * (i as f64 + 0.5) / LOOKS as f64;
    let mean = (0..LOOKS.pow(3))
        .map(|n| {
            let p = [at(n % LOOKS, 0), at(n / LOOKS % LOOKS, 1), at(n / LOOKS / LOOKS, 2)];
            determinant(&map.jacobian(p)).abs()
        })
        .sum::<f64>()
        / LOOKS.pow(3) as f64;
    mean * size.iter().product::<f64>() * net.beams.len() as f64
}

/// The frame of a cell placed by a map: all struts of which a part within `reach` (mm) may lie in the box.
///
/// # Errors
/// More than [`MOST`] struts; a map whose inverse is not found.
pub fn fill(net: &Net, map: &Map, bounds: &Aabb, reach: f64) -> Result<Wire, Fault> {
    let about = expected(net, map, bounds);
    if about.is_nan() || about > MOST {
        return Err(Fault::new(
            "",
            format!(
                "about {} beams would fill the region's bounds; at most {} are made: use larger cells, or a pattern",
                number(about.round()),
                number(MOST)
            ),
        ));
    }
    let bounds = bounds.grown(reach);
    let cells = map.cells(&bounds);
    let mut wire = Wire::default();
    let mut numbers: HashMap<([i32; 3], usize), u32> = HashMap::new();
    let mut register = |cell: [i32; 3], node: usize, place: Vec3, nodes: &mut Vec<Vec3>| {
        *numbers.entry((map.canonical(cell), node)).or_insert_with(|| {
            nodes.push(place);
            (nodes.len() - 1) as u32
        })
    };
    let phase = |cell: [i32; 3], node: usize| add(net.nodes[node], cell.map(f64::from));
    for (cell, near) in cells {
        let places: Vec<Option<Vec3>> = (0..net.nodes.len()).map(|n| map.position(phase(cell, n), near)).collect();
        for link in &net.beams {
            let [a, b] = link.ends;
            let there: [i32; 3] = core::array::from_fn(|i| cell[i] + link.shift[i]);
            let Some(from) = places[a] else { continue };
            let to = if link.shift == [0; 3] { places[b] } else { map.position(phase(there, b), from) };
            let Some(to) = to else { continue };
            if Aabb::EMPTY.with(from).with(to).intersection(bounds).is_empty() {
                continue;
            }
            let from = register(cell, a, from, &mut wire.nodes);
            let to = register(there, b, to, &mut wire.nodes);
            wire.struts.push([from, to]);
        }
    }
    Ok(wire)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{Affine, Round};
    use beams::graph::{catalogue, named};
    use geometry::math::{norm, sub};

    fn affine(w: f64) -> Map {
        Map::Affine(Affine::rigid([w; 3], [10.0, 20.0, 30.0], [0.3, 0.1, 0.2], &[]).expect("map"))
    }

    #[test]
    fn inner_nodes_have_the_valence_of_the_cell_and_lengths_are_those_of_the_cell() {
        let bounds = Aabb { min: [-5.0; 3], max: [5.0; 3] };
        for unit in catalogue() {
            let net = unit.net().expect("net");
            let mut wire = fill(&net, &affine(4.0), &bounds, 0.0).expect("frame");
            let done = wire.clean(1e-9, &mut Vec::new());
            assert_eq!(done, Default::default(), "{}", unit.name);
            let facts = wire.facts(&|_| true);
            let mut lengths = net.lengths([4.0; 3]);
            lengths.sort_by(f64::total_cmp);
            assert!((facts.length[0] - lengths[0]).abs() < 1e-9, "{}", unit.name);
            assert!((facts.length[1] - lengths[lengths.len() - 1]).abs() < 1e-9);
            // A node deeper than the longest strut has all its struts.
            let deep = bounds.grown(-lengths[lengths.len() - 1]);
            let mut valence = vec![0; wire.nodes.len()];
            wire.struts.iter().flatten().for_each(|n| valence[*n as usize] += 1);
            let known = net.valences();
            for (p, v) in wire.nodes.iter().zip(&valence) {
                if deep.distance(*p) == 0.0 {
                    assert!(known.contains(v), "{}: {v}", unit.name);
                }
            }
            let about = expected(&net, &affine(4.0), &bounds);
            assert!(wire.struts.len() as f64 > about);
        }
    }

    #[test]
    fn a_cylinder_closes() {
        let net = named("sc").and_then(|u| u.net().ok()).expect("net");
        let round = Round::cylinder([0.0; 3], [0.0, 0.0, 1.0], [2.0; 2], 12.0, [0.0, 4.0, 6.0]);
        let map = Map::Round(round.expect("map"));
        let bounds = Aabb { min: [-6.0, -6.0, -0.5], max: [6.0, 6.0, 1.5] };
        let mut wire = fill(&net, &map, &bounds, 0.0).expect("frame");
        let done = wire.clean(1e-6, &mut Vec::new());
        // On the axis twelve nodes are one, and the struts between them have no length.
        assert_eq!((done.merged, done.short, done.duplicates), (33, 12, 22));
        for s in &wire.struts {
            let [a, b] = s.map(|n| wire.nodes[n as usize]);
            assert!(norm(sub(a, b)) > 0.9);
        }
    }

    #[test]
    fn a_huge_frame_is_refused_before_it_is_made() {
        let net = named("octet").and_then(|u| u.net().ok()).expect("net");
        let bounds = Aabb { min: [0.0; 3], max: [1000.0; 3] };
        let fault = fill(&net, &affine(0.1), &bounds, 0.0).expect_err("refused");
        assert!(fault.message.contains("beams"), "{fault}");
    }
}
