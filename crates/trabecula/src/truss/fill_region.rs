//! Filling of a box with a periodic graph by a map: nodes are mapped, struts stay straight.

use std::collections::HashMap;

use crate::map::{Map, Phase};
use beams::graph::{MAX_STRUTS, PeriodicGraph, Wireframe};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3, add, determinant};

/// Samples of a map's Jacobian along each axis, to estimate the number of cells.
const SAMPLES: usize = 9;

/// Estimated number of struts of a mapped periodic graph in a box.
fn expected_struts(graph: &PeriodicGraph, map: &Map, bounds: &Aabb) -> f64 {
    let size = bounds.size();
    let at = |i: usize, a: usize| bounds.min[a] + size[a] * (i as f64 + 0.5) / SAMPLES as f64;
    let mean = (0..SAMPLES.pow(3))
        .map(|n| {
            let p = [at(n % SAMPLES, 0), at(n / SAMPLES % SAMPLES, 1), at(n / SAMPLES / SAMPLES, 2)];
            determinant(&map.jacobian(p)).abs()
        })
        .sum::<f64>()
        / SAMPLES.pow(3) as f64;
    mean * size.iter().product::<f64>() * graph.beams.len() as f64
}

/// The wireframe of a mapped periodic graph: all struts of which a part may lie within `reach` (mm) of the box.
///
/// # Errors
/// More than [`MAX_STRUTS`] struts; a map whose inverse is not found.
pub fn fill(graph: &PeriodicGraph, map: &Map, bounds: &Aabb, reach: f64) -> Result<Wireframe, Fault> {
    let about = expected_struts(graph, map, bounds);
    if about.is_nan() || about > MAX_STRUTS {
        return Err(Fault::new(
            "",
            format!(
                "about {} beams are needed to fill the region's bounds; the maximum is {}: use larger cells, or a pattern",
                number(about.round()),
                number(MAX_STRUTS)
            ),
        ));
    }
    let bounds = bounds.grown(reach);
    let cells = map.cells(&bounds);
    let mut wireframe = Wireframe::default();
    let mut numbers: HashMap<([i32; 3], usize), u32> = HashMap::new();
    let mut register = |cell: [i32; 3], node: usize, position: Vec3, nodes: &mut Vec<Vec3>| {
        *numbers.entry((map.canonical(cell), node)).or_insert_with(|| {
            nodes.push(position);
            (nodes.len() - 1) as u32
        })
    };
    let phase = |cell: [i32; 3], node: usize| add(graph.nodes[node], cell.map(f64::from));
    for (cell, near) in cells {
        let positions: Vec<Option<Vec3>> = (0..graph.nodes.len()).map(|n| map.position(phase(cell, n), near)).collect();
        for beam in &graph.beams {
            let [a, b] = beam.ends;
            let there: [i32; 3] = core::array::from_fn(|i| cell[i] + beam.shift[i]);
            let Some(from) = positions[a] else { continue };
            // Phases that grow round holes are continued from where the cell was found.
            let start = if map.solved().is_some_and(Phase::winds) { near } else { from };
            let to = if beam.shift == [0; 3] { positions[b] } else { map.position(phase(there, b), start) };
            let Some(to) = to else { continue };
            if Aabb::EMPTY.with(from).with(to).intersection(bounds).is_empty() {
                continue;
            }
            let from = register(cell, a, from, &mut wireframe.nodes);
            let to = register(there, b, to, &mut wireframe.nodes);
            wireframe.struts.push([from, to]);
        }
    }
    Ok(wireframe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{Affine, Round};
    use beams::graph::{GivenRadii, catalogue, named};
    use geometry::math::{norm, sub};
    use std::sync::Arc;

    fn affine(w: f64) -> Map {
        Arc::new(Affine::rigid([w; 3], [10.0, 20.0, 30.0], [0.3, 0.1, 0.2], &[]).expect("map"))
    }

    #[test]
    fn inner_nodes_have_the_valence_of_the_cell_and_lengths_are_those_of_the_cell() {
        let bounds = Aabb { min: [-5.0; 3], max: [5.0; 3] };
        for unit in catalogue() {
            let graph = unit.graph().expect("a graph");
            let mut wireframe = fill(&graph, &affine(4.0), &bounds, 0.0).expect("a wireframe");
            let done = wireframe.clean(1e-9, &mut GivenRadii::default());
            assert_eq!(done, Default::default(), "{}", unit.name);
            let report = wireframe.report(&wireframe.whole(), std::iter::empty());
            let mut lengths = graph.lengths([4.0; 3]);
            lengths.sort_by(f64::total_cmp);
            let [least, most] = report.length.expect("struts");
            assert!((least - lengths[0]).abs() < 1e-9, "{}", unit.name);
            assert!((most - lengths[lengths.len() - 1]).abs() < 1e-9);
            // A node deeper than the longest strut has all its struts.
            let deep = bounds.grown(-lengths[lengths.len() - 1]);
            let mut valence = vec![0; wireframe.nodes.len()];
            wireframe.struts.iter().flatten().for_each(|n| valence[*n as usize] += 1);
            let known = graph.valences();
            for (p, v) in wireframe.nodes.iter().zip(&valence) {
                if deep.distance(*p) == 0.0 {
                    assert!(known.contains(v), "{}: {v}", unit.name);
                }
            }
            let about = expected_struts(&graph, &affine(4.0), &bounds);
            assert!(wireframe.struts.len() as f64 > about);
        }
    }

    #[test]
    fn a_cylinder_closes() {
        let graph = named("sc").and_then(|u| u.graph().ok()).expect("a graph");
        let round = Round::cylinder([0.0; 3], [0.0, 0.0, 1.0], [2.0; 2], 12.0, [0.0, 4.0, 6.0]);
        let map: Map = Arc::new(round.expect("map"));
        let bounds = Aabb { min: [-6.0, -6.0, -0.5], max: [6.0, 6.0, 1.5] };
        let mut wireframe = fill(&graph, &map, &bounds, 0.0).expect("a wireframe");
        let done = wireframe.clean(1e-6, &mut GivenRadii::default());
        // On the axis twelve nodes coincide, and the struts between them have zero length.
        assert_eq!((done.merged, done.zero_length, done.duplicates), (33, 12, 22));
        for s in &wireframe.struts {
            let [a, b] = s.map(|n| wireframe.nodes[n as usize]);
            assert!(norm(sub(a, b)) > 0.9);
        }
    }

    #[test]
    fn a_huge_frame_is_refused_before_it_is_made() {
        let graph = named("octet").and_then(|u| u.graph().ok()).expect("a graph");
        let bounds = Aabb { min: [0.0; 3], max: [1000.0; 3] };
        let fault = fill(&graph, &affine(0.1), &bounds, 0.0).expect_err("refused");
        assert!(fault.message.contains("beams"), "{fault}");
    }
}
