//! The vertices of plain cells: which grid edges have one, and where on its edge it lies.

use std::ops::Range;

use multiversion::multiversion;

use super::{BATCH, BlockNodes, EdgeVertex, TileBuffers, VertexNumbers};
use crate::extract::sign_words::{Signs, below};
use crate::field::Field;
use geometry::math::unit;
use geometry::roots::Bracket;

/// Lists the vertices of plain cells, surface by surface.
pub(super) fn list_vertices(s: &mut TileBuffers, nodes: &BlockNodes) {
    let TileBuffers { signs, numbers, vertices, edges, .. } = s;
    vertices.clear();
    numbers.resize_with(signs.negative.len(), VertexNumbers::default);
    let any_feature = signs.has_features();
    for (surface, numbers) in numbers.iter_mut().enumerate() {
        let features = if any_feature { Some(edges.claims.features(signs, surface)) } else { None };
        list_surface(signs, numbers, vertices, nodes, surface, features.as_deref());
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+popcnt+lzcnt", "aarch64+neon"))]
fn list_surface(
    signs: &Signs,
    numbers: &mut VertexNumbers,
    vertices: &mut Vec<EdgeVertex>,
    nodes: &BlockNodes,
    surface: usize,
    features: Option<&[u64]>,
) {
    let [nx, ny, nz] = nodes.shape;
    let inner = below(nx - 1);
    let n = &signs.negative[surface];
    for axis in 0..3 {
        numbers.crossed[axis].clear();
        numbers.offset[axis].clear();
        for k in 0..nz {
            for j in 0..ny {
                let row = k * ny + j;
                let w = n[row];
                let change = match axis {
                    0 => (w ^ (w >> 1)) & inner,
                    1 if j + 1 < ny => w ^ n[row + 1],
                    2 if k + 1 < nz => w ^ n[row + ny],
                    _ => 0,
                };
                let used = change & signs.edges_of(&signs.plain[surface], axis, j, k);
                numbers.crossed[axis].push(used);
                numbers.offset[axis].push(vertices.len() as u32);
                let fixed = features.map_or(0, |features| signs.edges_of(features, axis, j, k));
                let mut bits = used;
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let node = [i, j, k];
                    vertices.push(EdgeVertex {
                        node: node.map(|n| n as u8),
                        axis: axis as u8,
                        surface: surface as u8,
                        up: w >> i & 1 == 1,
                        fixed: fixed >> i & 1 == 1,
                        t: 1.0,
                    });
                }
            }
        }
    }
}

/// A root along an edge: its bracket, below which is solid, and the next guess.
#[derive(Clone, Copy)]
struct EdgeRoot {
    vertex: u32,
    bracket: Bracket,
    t: f64,
}

impl EdgeRoot {
    /// Takes the value at the guess, and its slope along the edge; gives the step to the next guess, or halves what is left.
    #[inline]
    fn narrow(&mut self, value: f64, slope: f64, halve: bool) -> f64 {
        // A surface may run along the edge: then there is no slope, and no step to either side.
        if value == 0.0 {
            return 0.0;
        }
        self.bracket.narrow(self.t, value);
        let newton = self.t - value / slope;
        let next = if halve {
            self.bracket.middle()
        } else if newton >= self.bracket.below[0] && newton <= self.bracket.above[0] {
            newton
        } else {
            self.bracket.chord()
        };
        let step = next - self.t;
        self.t = next;
        step.abs()
    }
}

/// A step this small (as a share of the edge) ends the iteration: its square is the error that is left.
const SETTLED: f64 = 1e-3;
/// Rounds in which a smooth function's root is found. Those left cross an edge of the surface, where slopes say little: every
/// other round halves what is left of these.
const SMOOTH: usize = 6;
/// Most rounds of the iteration: by halves alone the last come as near as those that settle.
const ROUNDS: usize = SMOOTH + 20;

/// Finds where a surface crosses the edges of its vertices, and its normals there.
pub(super) fn solve(s: &mut TileBuffers, nodes: &BlockNodes, f: &dyn Field, surface: usize, which: Range<usize>) {
    let TileBuffers { samples, points, values, gradients, vertices, normals, .. } = s;
    normals.resize(vertices.len(), [0.0; 3]);
    let samples = &samples[surface];
    let mut roots = Vec::with_capacity(BATCH);
    for from in which.clone().step_by(BATCH) {
        roots.clear();
        for (i, v) in (from..which.end).zip(&vertices[from..which.end]).take(BATCH) {
            let low = v.low(nodes);
            let high = low + nodes.stride[usize::from(v.axis)];
            let (a, b) = if v.up { (low, high) } else { (high, low) };
            let (a, b) = (f64::from(samples[a]), f64::from(samples[b]));
            let bracket = Bracket { below: [0.0, a], above: [1.0, b] };
            roots.push(EdgeRoot { vertex: i as u32, bracket, t: bracket.chord() });
        }
        for round in 0..ROUNDS {
            points.clear();
            let position = |r: &EdgeRoot| vertices[r.vertex as usize].at(nodes, r.t);
            points.extend(roots.iter().map(position));
            values.resize(roots.len(), 0.0);
            gradients.resize(roots.len(), [0.0; 3]);
            f.gradients(points, values, gradients);
            let mut open = 0;
            for n in 0..roots.len() {
                let mut r = roots[n];
                let v = &mut vertices[r.vertex as usize];
                let slope = gradients[n][usize::from(v.axis)] * v.reach(nodes);
                let halve = round >= SMOOTH && round % 2 == 0;
                if r.narrow(values[n], slope, halve) > SETTLED && round + 1 < ROUNDS {
                    roots[open] = r;
                    open += 1;
                } else {
                    v.t = r.t as f32;
                    normals[r.vertex as usize] = unit(gradients[n]).map(|x| x as f32);
                }
            }
            roots.truncate(open);
            if roots.is_empty() {
                break;
            }
        }
    }
}
