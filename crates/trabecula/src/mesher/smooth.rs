//! Shape improvement: nodes of badly shaped tetrahedra are moved to improve the worst of them.

use super::tet_shape::shape;
use super::work::Work;
use crate::field::Field;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;
use geometry::tetmesh::FACES;

/// Shapes better than this are not changed: dihedral angles of about 26 to 142 degrees.
const GOOD: f64 = 6.0;
/// Number of passes over all nodes.
const ROUNDS: usize = 4;
/// Step lengths tried, as fractions of the mean edge length at the node.
const STEPS: [f64; 4] = [0.3, 0.15, 0.07, 0.03];

/// Moves nodes, those on the surface along it, those on feature edges not at all. No tetrahedron gets worse than the
/// worst at its node was.
pub(super) fn smooth(work: &mut Work) {
    for _ in 0..ROUNDS {
        let mut moved = false;
        for n in 0..work.mesh.nodes.len() {
            checkpoint();
            if work.held[n] == 0 && !work.around.of(n).is_empty() {
                moved |= improve(work, n);
            }
        }
        if !moved {
            return;
        }
    }
}

/// Moves one node if that improves the worst of its tetrahedra.
pub(super) fn improve(work: &mut Work, n: usize) -> bool {
    let (mut best, tet) = work.worst(n);
    if best >= GOOD || work.bars(work.mesh.nodes[n]) {
        return false;
    }
    let (region, on, around, mesh) = (work.region, work.on[n], &work.around, &mut work.mesh);
    let start = mesh.nodes[n];
    let (mut sum, mut length, mut count) = ([0.0; 3], 0.0, 0.0);
    for t in around.of(n) {
        for m in mesh.tets[*t as usize].into_iter().filter(|m| *m as usize != n) {
            let d = sub(mesh.nodes[m as usize], start);
            (sum, length, count) = (add(sum, d), length + norm(d), count + 1.0);
        }
    }
    let edge = length / count;
    // Towards the centroid of the neighbours; away from, towards and along the opposite face of the worst tetrahedron.
    let middle = unit(sum);
    let t = mesh.tets[tet as usize];
    let here = t.iter().position(|m| *m as usize == n).unwrap_or(0);
    let [a, b, c] = FACES[here].map(|k| mesh.nodes[t[k] as usize]);
    let off = unit(cross(sub(b, a), sub(c, a)));
    let along = unit(sub(scale(add(add(a, b), c), 1.0 / 3.0), start));
    let along = unit(sub(along, scale(off, dot(along, off))));
    let mut directions = vec![middle, off, scale(off, -1.0), along, scale(along, -1.0)];
    let mut normal = [0.0; 3];
    if on {
        let (mut v, mut g) = ([0.0], [[0.0; 3]]);
        region.gradients(&[start], &mut v, &mut g);
        normal = unit(g[0]);
        for d in &mut directions {
            *d = unit(sub(*d, scale(normal, dot(*d, normal))));
        }
    }
    let mut best_position = start;
    for step in STEPS {
        for d in &directions {
            let mut p = add(start, scale(*d, step * edge));
            if on {
                match onto(region, p, normal, edge) {
                    Some(q) => p = q,
                    None => continue,
                }
            }
            mesh.nodes[n] = p;
            let mut worst = f64::INFINITY;
            for t in around.of(n) {
                worst = worst.min(shape(mesh.corners(*t as usize)));
                if worst <= best {
                    break;
                }
            }
            if worst > best * 1.001 {
                (best, best_position) = (worst, p);
            }
        }
    }
    mesh.nodes[n] = best_position;
    best_position != start
}

/// The surface point near `p`, if a few gradient steps lead there on the same sheet of the surface (by this normal).
fn onto(region: &dyn Field, mut p: Vec3, normal: Vec3, edge: f64) -> Option<Vec3> {
    let (mut v, mut g) = ([0.0], [[0.0; 3]]);
    for _ in 0..6 {
        region.gradients(&[p], &mut v, &mut g);
        let steep = dot(g[0], g[0]);
        if dot(unit(g[0]), normal) < 0.7 {
            return None;
        }
        if v[0].abs() < 1e-10 * edge {
            return Some(p);
        }
        p = sub(p, scale(g[0], v[0] / steep));
    }
    None
}
