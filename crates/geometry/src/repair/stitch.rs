//! First repairs: duplicate and degenerate triangles, vertices and edges that just miss each other.

use std::collections::HashSet;

use crate::bvh::{Bvh, Split};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;
use crate::mesh::edges::{Edges, ends, open};
use crate::union_find::{find, singles, unite};

/// Vertices of open edges merge over at most this share of the mesh's diagonal: seams that exporters leave are far
/// narrower, and holes are wider.
const SEAM: f64 = 1e-3;
/// ... and over at most this share of the shortest edge at either vertex, so that no triangle loses its shape.
const OF_EDGE: f64 = 0.2;

/// Whether a triangle's normal is lost in the rounding of its coordinates' differences.
pub fn flat([a, b, c]: [Vec3; 3]) -> bool {
    let (u, v) = (sub(b, a), sub(c, a));
    norm(cross(u, v)) <= 4.0 * f64::EPSILON * norm(u) * norm(v)
}

/// Removes triangles of zero area; gives their number.
pub fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let before = mesh.triangles.len();
    let vertices = &mesh.vertices;
    mesh.triangles.retain(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && !flat(t.map(|v| vertices[v as usize])));
    before - mesh.triangles.len()
}

/// Removes duplicate triangles; gives their number.
///
/// Of copies of one orientation one is kept, unless two components share that surface: each needs its own there. Copies of
/// both orientations are either a wall drawn from both sides (one is kept) or a partition between two components that meet
/// there (none is kept): an edge of the wall has an odd number of other triangles, one of the partition an even number.
pub fn drop_duplicates(mesh: &mut Mesh) -> usize {
    let sorted = |t: &[u32; 3]| {
        let mut s = *t;
        s.sort_unstable();
        s
    };
    let even = |t: [u32; 3]| {
        let inversions = [(0, 1), (0, 2), (1, 2)].iter().filter(|(i, j)| t[*i] > t[*j]);
        inversions.count() % 2 == 0
    };
    let mut all: Vec<([u32; 3], u32)> = (0..).zip(&mesh.triangles).map(|(i, t)| (sorted(t), i)).collect();
    all.sort_unstable();
    if all.windows(2).all(|w| w[0].0 != w[1].0) {
        return 0;
    }
    // Distinct triangles at each edge.
    let distinct: Vec<[u32; 3]> = all.chunk_by(|a, b| a.0 == b.0).map(|g| g[0].0).collect();
    let edges = Edges::of(&distinct);
    let others = |a: u32, b: u32| edges.between(a, b) - 1;
    // The orientation of most copies, and their number.
    let most = |group: &[([u32; 3], u32)]| {
        let ups = group.iter().filter(|(_, i)| even(mesh.triangles[*i as usize]));
        let (ups, all) = (ups.count(), group.len());
        (2 * ups >= all, ups.max(all - ups))
    };
    let alike = all.chunk_by(|a, b| a.0 == b.0).filter(|g| most(g).1 > 1);
    let of_two_components = of_two_components(alike.map(|g| g[0].0).collect(), others);
    let mut keep = vec![true; mesh.triangles.len()];
    for group in all.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
        group.iter().for_each(|(_, i)| keep[*i as usize] = false);
        let (up, count) = most(group);
        let [a, b, c] = group[0].0;
        let odd = [others(a, b), others(b, c), others(a, c)].iter().filter(|n| *n % 2 == 1).count();
        let left = if of_two_components.contains(&group[0].0) {
            2
        } else {
            usize::from(count == group.len() || group.len() % 2 == 1 || odd >= 2)
        };
        let facing = group.iter().filter(|(_, i)| even(mesh.triangles[*i as usize]) == up);
        facing.take(left).for_each(|(_, i)| keep[*i as usize] = true);
    }
    let before = mesh.triangles.len();
    let mut kept = keep.iter();
    mesh.triangles.retain(|_| *kept.next().unwrap_or(&true));
    before - mesh.triangles.len()
}

/// Of triangles with several copies of one orientation, those that two components have in common.
///
/// A patch of them has edges along its boundary with an even number of other triangles where both copies continue, each in
/// its own component, and with an odd number where a copy just ends. `others`: their number, copies not counted.
fn of_two_components(patches: Vec<[u32; 3]>, others: impl Fn(u32, u32) -> usize) -> HashSet<[u32; 3]> {
    let (edges, mut root) = (Edges::of(&patches), singles(patches.len()));
    for edge in edges.each() {
        for other in &edge[1..] {
            unite(&mut root, edge[0] / 3, other / 3);
        }
    }
    // Along each patch's boundary, edges at which both copies continue minus those at which one ends.
    let mut votes = vec![0i64; patches.len()];
    for edge in edges.each().filter(|e| e.len() == 1) {
        let [a, b] = ends(&patches, edge[0]);
        let vote = if others(a.min(b), a.max(b)).is_multiple_of(2) { 1 } else { -1 };
        votes[find(&mut root, edge[0] / 3) as usize] += vote;
    }
    let found = (0..patches.len()).filter(|i| votes[find(&mut root, *i as u32) as usize] > 0);
    found.map(|i| patches[i]).collect()
}

/// Merges vertices of open edges that lie close together, at their mean; gives the number of vertices removed.
pub fn join_seams(mesh: &mut Mesh) -> usize {
    let open_before = open(mesh);
    if open_before.is_empty() {
        return 0;
    }
    let mut shortest = vec![f64::INFINITY; mesh.vertices.len()];
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
            let d = norm(sub(mesh.vertices[a], mesh.vertices[b]));
            shortest[a] = shortest[a].min(d);
            shortest[b] = shortest[b].min(d);
        }
    }
    let reach = SEAM * norm(mesh.bounds().size());
    let allowed = |v: u32| reach.min(OF_EDGE * shortest[v as usize]);
    let mut boundary: Vec<u32> = open_before.iter().flat_map(|h| ends(&mesh.triangles, *h)).collect();
    boundary.sort_unstable();
    boundary.dedup();
    let boxes: Vec<Aabb> =
        boundary.iter().map(|v| Aabb::EMPTY.with(mesh.vertices[*v as usize]).grown(allowed(*v) / 2.0)).collect();
    let mut pairs: Vec<(f64, u32, u32)> = Vec::new();
    near(&boxes, &boxes, |i, j| {
        if i < j {
            let (a, b) = (boundary[i], boundary[j]);
            let d = norm(sub(mesh.vertices[a as usize], mesh.vertices[b as usize]));
            if d <= allowed(a).min(allowed(b)) {
                pairs.push((d, a, b));
            }
        }
    });
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut root = singles(mesh.vertices.len());
    for (_, a, b) in &pairs {
        unite(&mut root, *a, *b);
    }
    let mut sum = vec![([0.0; 3], 0usize); mesh.vertices.len()];
    for &v in &boundary {
        let s = &mut sum[find(&mut root, v) as usize];
        *s = (add(s.0, mesh.vertices[v as usize]), s.1 + 1);
    }
    let mut joined = mesh.clone();
    for t in &mut joined.triangles {
        *t = t.map(|v| find(&mut root, v));
    }
    for (v, (s, n)) in joined.vertices.iter_mut().zip(&sum).filter(|(_, s)| s.1 > 1) {
        *v = scale(*s, 1.0 / *n as f64);
    }
    drop_degenerate(&mut joined);
    if open(&joined).len() >= open_before.len() {
        return 0;
    }
    *mesh = joined;
    sum.iter().map(|s| s.1.saturating_sub(1)).sum()
}

/// Calls `f` with every pair of boxes, one of each list, that touch.
fn near(a: &[Aabb], b: &[Aabb], mut f: impl FnMut(usize, usize)) {
    let tree = Bvh::new(b, (0..b.len() as u32).collect(), Split::Median);
    for (i, bounds) in a.iter().enumerate() {
        tree.overlapping(bounds, |near| near.iter().for_each(|j| f(i, *j as usize)));
    }
}

/// Splits open edges at vertices of other open edges that lie on them to within `tolerance` (mm): a T-junction, where a long
/// edge meets two short ones, is no hole. Gives the number of splits.
pub fn split_at_corners(mesh: &mut Mesh, tolerance: f64) -> usize {
    let sides = open(mesh);
    let mut boundary: Vec<u32> = sides.iter().flat_map(|h| ends(&mesh.triangles, *h)).collect();
    boundary.sort_unstable();
    boundary.dedup();
    let at = |v: u32| mesh.vertices[v as usize];
    let points: Vec<Aabb> = boundary.iter().map(|v| Aabb::EMPTY.with(at(*v))).collect();
    let boxes: Vec<Aabb> = sides
        .iter()
        .map(|h| {
            let [a, b] = ends(&mesh.triangles, *h);
            Aabb::EMPTY.with(at(a)).with(at(b)).grown(tolerance)
        })
        .collect();
    // Half-edge, position along it, vertex.
    let mut found: Vec<(u32, f64, u32)> = Vec::new();
    near(&boxes, &points, |i, j| {
        let ([a, b], v) = (ends(&mesh.triangles, sides[i]), boundary[j]);
        if mesh.triangles[sides[i] as usize / 3].contains(&v) {
            return;
        }
        let (u, w) = (sub(at(b), at(a)), sub(at(v), at(a)));
        let t = dot(u, w) / dot(u, u);
        let off = norm(sub(w, scale(u, t)));
        let length = norm(u);
        if off <= tolerance && t * length > tolerance && (1.0 - t) * length > tolerance {
            found.push((sides[i], t, v));
        }
    });
    found.sort_unstable_by(|a, b| (a.0).cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut done = 0;
    let mut changed: Vec<(usize, [Vec<u32>; 3])> = Vec::new();
    for side in found.chunk_by(|a, b| a.0 == b.0) {
        let (t, k) = (side[0].0 as usize / 3, side[0].0 as usize % 3);
        if changed.last().is_none_or(|c| c.0 != t) {
            changed.push((t, Default::default()));
        }
        if let Some(c) = changed.last_mut() {
            c.1[k] = side.iter().map(|s| s.2).collect();
            done += side.len();
        }
    }
    for (t, lists) in changed {
        let mut pieces = Vec::new();
        pieces_of(mesh.triangles[t], lists, &mut pieces);
        mesh.triangles[t] = pieces[0];
        mesh.triangles.extend(&pieces[1..]);
    }
    done
}

/// The triangles of a triangle with vertices on its edges.
fn pieces_of(t: [u32; 3], lists: [Vec<u32>; 3], out: &mut Vec<[u32; 3]>) {
    let mut work = vec![(t, lists)];
    while let Some((t, mut lists)) = work.pop() {
        let k = (1..3).fold(0, |m, k| if lists[k].len() > lists[m].len() { k } else { m });
        if lists[k].is_empty() {
            out.push(t);
            continue;
        }
        let [a, b, c] = [0, 1, 2].map(|i| t[(k + i) % 3]);
        let middle = lists[k].len() / 2;
        let after = lists[k].split_off(middle + 1);
        let m = lists[k].pop().unwrap_or(a);
        let [before, bc, ca] = [0, 1, 2].map(|i| core::mem::take(&mut lists[(k + i) % 3]));
        work.push(([m, b, c], [after, bc, Vec::new()]));
        work.push(([a, m, c], [before, Vec::new(), ca]));
    }
}
