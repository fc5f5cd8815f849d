//! What a mesh must be to have an inside: every defect counted, one sentence for all of them.

use rayon::slice::ParallelSliceMut;

use crate::fault::Fault;
use crate::math::{Aabb, Vec3, cross, dot, norm, sub};
use crate::mesh::Mesh;

/// What the checks learn about a sound mesh.
#[derive(Debug)]
pub(super) struct Topology {
    /// For each triangle, the triangle across its edge from corner k to corner k + 1.
    pub neighbours: Vec<[u32; 3]>,
    /// Enclosed volume, cavities taken off (mm³).
    pub volume: f64,
}

/// Checks that the mesh is one closed body, with or without cavities, and oriented outwards.
///
/// # Errors
/// One fault with the number of every kind of defect found.
pub(super) fn check(mesh: &Mesh) -> Result<Topology, Fault> {
    let mut found = Defects::default();
    if mesh.triangles.is_empty() {
        return found.note("no triangles").fault();
    }
    if mesh.triangles.len() > (u32::MAX / 3) as usize {
        return found.note("more than 1431655765 triangles").fault();
    }
    let used = mesh.vertices.len();
    let stray = mesh
        .triangles
        .iter()
        .flatten()
        .filter(|&&v| v as usize >= used)
        .count();
    if stray > 0 {
        return found.count(stray, "vertex number", "out of range").fault();
    }
    let bad = mesh
        .vertices
        .iter()
        .filter(|p| !p.iter().all(|v| v.is_finite()))
        .count();
    found.count(bad, "vertex", "not finite");

    let neighbours = edges(mesh, bad == 0, &mut found);
    if !found.list.is_empty() {
        return found.fault();
    }
    let pinched = pinched(mesh, &neighbours);
    found.count(pinched, "vertex", "where the surface touches itself");
    let volume = bodies(mesh, &neighbours, &mut found);
    if found.list.is_empty() {
        Ok(Topology { neighbours, volume })
    } else {
        found.fault()
    }
}

/// Defects so far, in words.
#[derive(Default)]
struct Defects {
    list: Vec<String>,
}

impl Defects {
    /// Notes `n` defects of a kind, unless there are none.
    fn count(&mut self, n: usize, what: &str, how: &str) -> &mut Self {
        let plural = match what.strip_suffix("body") {
            _ if n == 1 => what.to_string(),
            Some(kind) => format!("{kind}bodies"),
            None if what == "vertex" => "vertices".to_string(),
            None => format!("{what}s"),
        };
        if n > 0 {
            self.list
                .push(format!("{n} {plural} {how}").trim_end().to_string());
        }
        self
    }

    fn note(&mut self, what: &str) -> &mut Self {
        self.list.push(what.to_string());
        self
    }

    fn fault<T>(&self) -> Result<T, Fault> {
        Err(Fault::new(
            "",
            format!(
                "the mesh is not one clean, closed body: {}. Allowed is a closed surface that bounds one body \
                 (cavities may lie inside it), triangles counter-clockwise seen from outside. Repairing comes \
                 with a later version; repair the mesh first.",
                self.list.join(", ")
            ),
        ))
    }
}

/// Whether a triangle has no direction: a repeated vertex, or an area of zero to rounding.
fn is_degenerate(mesh: &Mesh, i: usize) -> bool {
    let [a, b, c] = mesh.corners(i);
    let (u, v) = (sub(b, a), sub(c, a));
    let area = norm(cross(u, v));
    area <= 4.0 * f64::EPSILON * norm(u) * norm(v)
}

/// Counts defects of triangles and edges, and gives the triangle across each edge.
///
/// Every edge of every triangle becomes one number, lower vertex, higher vertex, third vertex, triangle and
/// side from the top down. Sorted, the triangles at an edge are neighbours, and so are duplicates.
fn edges(mesh: &Mesh, finite: bool, found: &mut Defects) -> Vec<[u32; 3]> {
    let mut sides: Vec<u128> = Vec::with_capacity(3 * mesh.triangles.len());
    let mut degenerate = 0;
    for (i, t) in mesh.triangles.iter().enumerate() {
        let repeated = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        if repeated || (finite && is_degenerate(mesh, i)) {
            degenerate += 1;
        }
        if repeated {
            continue;
        }
        for k in 0..3 {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            let edge = u128::from(a.min(b)) << 96 | u128::from(a.max(b)) << 64;
            sides.push(edge | u128::from(c) << 32 | (3 * i + k) as u128);
        }
    }
    sides.par_sort_unstable();

    let (mut open, mut crowded, mut flipped, mut duplicate) = (0, 0, 0, 0);
    let mut neighbours = vec![[u32::MAX; 3]; mesh.triangles.len()];
    let side_of = |s: u128| ((s as u32 / 3) as usize, (s as u32 % 3) as usize);
    for group in sides.chunk_by(|a, b| a >> 64 == b >> 64) {
        let higher = (group[0] >> 64) as u32;
        // A duplicate shows on all three edges; the one between its two lowest vertices counts it.
        duplicate += group
            .windows(2)
            .filter(|w| w[0] >> 32 == w[1] >> 32 && (w[0] >> 32) as u32 > higher)
            .count();
        match group {
            [_] => open += 1,
            [s, t] => {
                let ((i, k), (j, l)) = (side_of(*s), side_of(*t));
                if mesh.triangles[i][k] == mesh.triangles[j][l] {
                    flipped += 1;
                }
                neighbours[i][k] = j as u32;
                neighbours[j][l] = i as u32;
            }
            _ => crowded += 1,
        }
    }
    found
        .count(
            degenerate,
            "degenerate triangle",
            "(repeated vertex or zero area)",
        )
        .count(duplicate, "duplicate triangle", "")
        .count(open, "open edge", "")
        .count(crowded, "edge", "with more than two triangles")
        .count(
            flipped,
            "edge",
            "with flipped triangles (both run the same way along it)",
        );
    neighbours
}

/// Number of vertices with more than one fan of triangles around them.
fn pinched(mesh: &Mesh, neighbours: &[[u32; 3]]) -> usize {
    let mut seen = vec![[false; 3]; mesh.triangles.len()];
    let mut fans = vec![0u8; mesh.vertices.len()];
    for i in 0..mesh.triangles.len() {
        for k in 0..3 {
            let v = mesh.triangles[i][k];
            let (mut t, mut c) = (i, k);
            if !seen[i][k] {
                fans[v as usize] = fans[v as usize].saturating_add(1);
            }
            // Around the vertex, each time across the edge that leaves it.
            while !seen[t][c] {
                seen[t][c] = true;
                t = neighbours[t][c] as usize;
                c = (0..3).find(|&c| mesh.triangles[t][c] == v).unwrap_or(0);
            }
        }
    }
    fans.iter().filter(|&&n| n > 1).count()
}

/// One connected piece of surface.
struct Body {
    triangles: Vec<u32>,
    bounds: Aabb,
    volume: f64,
}

/// Parts the surface into bodies, counts those out of place, and gives the volume of all.
fn bodies(mesh: &Mesh, neighbours: &[[u32; 3]], found: &mut Defects) -> f64 {
    let origin = mesh.bounds().center();
    let mut seen = vec![false; mesh.triangles.len()];
    let mut bodies: Vec<Body> = Vec::new();
    for start in 0..mesh.triangles.len() {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut triangles = vec![start as u32];
        let (mut bounds, mut six, mut scale, mut next) = (Aabb::EMPTY, 0.0, 0.0, 0);
        while let Some(&t) = triangles.get(next) {
            next += 1;
            let [a, b, c] = mesh.corners(t as usize);
            bounds = bounds.with(a).with(b).with(c);
            let [a, b, c] = [a, b, c].map(|p| sub(p, origin));
            let term = dot(a, cross(b, c));
            six += term;
            scale += norm(a) * norm(b) * norm(c);
            for &n in &neighbours[t as usize] {
                if !std::mem::replace(&mut seen[n as usize], true) {
                    triangles.push(n);
                }
            }
        }
        // A volume within rounding of the sum is none.
        let volume = if six.abs() <= 8.0 * f64::EPSILON * scale {
            0.0
        } else {
            six / 6.0
        };
        bodies.push(Body {
            triangles,
            bounds,
            volume,
        });
    }
    let solid = bodies.iter().filter(|b| b.volume > 0.0).count();
    let flat = bodies.iter().filter(|b| b.volume == 0.0).count();
    let volume: f64 = bodies.iter().map(|b| b.volume).sum();
    found.count(flat, "body", "of zero volume");
    if solid > 1 {
        found.count(solid, "separate body", "");
    } else if volume < 0.0 {
        found.note(&format!("inside out (volume {volume:.6} mm³)"));
    } else if flat == 0 {
        let lost = (0..bodies.len())
            .filter(|&i| !is_in_place(mesh, &bodies, i))
            .count();
        found.count(
            lost,
            "inward-facing body",
            "that is not inside the part, or is inside another cavity",
        );
    }
    volume
}

/// Whether a body is solid, or a cavity with the solid around it and no other cavity.
fn is_in_place(mesh: &Mesh, bodies: &[Body], i: usize) -> bool {
    let body = &bodies[i];
    let p = mesh.corners(body.triangles[0] as usize)[0];
    body.volume > 0.0
        || bodies
            .iter()
            .enumerate()
            .filter(|&(j, _)| j != i)
            .all(|(_, other)| {
                let within = |b: &Aabb| b.intersection(body.bounds) == body.bounds;
                let inside = within(&other.bounds) && winding(mesh, other, p).abs() > 0.5;
                inside == (other.volume > 0.0)
            })
}

/// How often a body's surface goes around `p`: the sum of solid angles over 4π.
///
/// Source: Van Oosterom & Strackee, The solid angle of a plane triangle (1983).
fn winding(mesh: &Mesh, body: &Body, p: Vec3) -> f64 {
    let half: f64 = body
        .triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = mesh.corners(t as usize).map(|q| sub(q, p));
            let [la, lb, lc] = [norm(a), norm(b), norm(c)];
            let y = dot(a, cross(b, c));
            let x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
            y.atan2(x)
        })
        .sum();
    half / (2.0 * core::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::super::shapes::*;
    use super::*;

    /// The message of a refused mesh.
    fn refusal(mesh: &Mesh) -> String {
        match check(mesh) {
            Ok(t) => panic!("taken, volume {}", t.volume),
            Err(fault) => fault.message,
        }
    }

    fn cube() -> Mesh {
        cuboid([0.0; 3], [1.0; 3])
    }

    #[track_caller]
    fn refused(mesh: &Mesh, what: &str) {
        let message = refusal(mesh);
        let list = message
            .split(": ")
            .nth(1)
            .and_then(|s| s.split(". ").next());
        assert_eq!(list, Some(what), "{message}");
        assert!(message.contains("repair the mesh first"));
    }

    #[test]
    fn sound_meshes_are_taken_with_their_volume() {
        let volume = |m: &Mesh| check(m).map(|t| t.volume).unwrap_or(f64::NAN);
        assert_eq!(volume(&cube()), 1.0);
        let hollow = joined(
            joined(
                cuboid([0.0; 3], [10.0; 3]),
                flipped(moved(cube(), 2.0, [1.0; 3])),
            ),
            flipped(moved(cube(), 3.0, [5.0; 3])),
        );
        assert!((volume(&hollow) - (1000.0 - 8.0 - 27.0)).abs() < 1e-9);
        // A vertex that no triangle uses does no harm.
        let mut spare = cube();
        spare.vertices.push([9.0; 3]);
        assert_eq!(volume(&spare), 1.0);
    }

    #[test]
    fn the_neighbours_share_the_edge() {
        let mesh = torus(3.0, 1.0, 12, 8);
        let Ok(topology) = check(&mesh) else {
            panic!("refused")
        };
        for (t, n) in mesh.triangles.iter().zip(&topology.neighbours) {
            for k in 0..3 {
                let across = mesh.triangles[n[k] as usize];
                assert!((0..3).any(|j| across[j] == t[(k + 1) % 3] && across[(j + 1) % 3] == t[k]));
            }
        }
    }

    #[test]
    fn every_defect_is_counted() {
        refused(&Mesh::default(), "no triangles");
        let mut m = cube();
        m.triangles[3][1] = 8;
        refused(&m, "1 vertex number out of range");
        let mut m = cube();
        m.vertices[3][1] = f64::NAN;
        m.vertices[4][0] = f64::INFINITY;
        refused(&m, "2 vertices not finite");
        let mut m = cube();
        m.triangles.truncate(11);
        refused(&m, "3 open edges");
        let mut m = cube();
        m.triangles[5].swap(0, 1);
        refused(
            &m,
            "3 edges with flipped triangles (both run the same way along it)",
        );
        let mut m = cube();
        m.triangles.push(m.triangles[2]);
        refused(
            &m,
            "1 duplicate triangle, 3 edges with more than two triangles",
        );
        let mut m = cube();
        m.triangles.push([0, 0, 1]);
        refused(&m, "1 degenerate triangle (repeated vertex or zero area)");
        // Vertices in one line: a triangle split at a point on its edge.
        let mut m = cube();
        let [a, b, c] = m.triangles[0];
        m.vertices.push(m.corners(0)[0].map(|v| v / 2.0));
        m.vertices[8] =
            std::array::from_fn(|k| (m.vertices[a as usize][k] + m.vertices[b as usize][k]) / 2.0);
        m.triangles[0] = [a, 8, c];
        m.triangles.extend([[8, b, c], [a, b, 8]]);
        refused(&m, "1 degenerate triangle (repeated vertex or zero area)");
    }

    #[test]
    fn bodies_out_of_place_are_counted() {
        let away = |x: f64| moved(cube(), 1.0, [x, 0.0, 0.0]);
        refused(
            &joined(joined(cube(), away(2.0)), away(4.0)),
            "3 separate bodies",
        );
        refused(&flipped(cube()), "inside out (volume -1.000000 mm³)");
        let lost = "inward-facing body that is not inside the part, or is inside another cavity";
        let big = || cuboid([0.0; 3], [10.0; 3]);
        refused(&joined(big(), flipped(away(20.0))), &format!("1 {lost}"));
        let twice = joined(
            flipped(moved(cube(), 4.0, [2.0; 3])),
            flipped(moved(cube(), 1.0, [3.0; 3])),
        );
        refused(&joined(big(), twice), &format!("1 {lost}"));
        let flat = Mesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 0, 3], [1, 3, 2]],
        };
        refused(&flat, "1 body of zero volume");
    }

    #[test]
    fn a_surface_that_touches_itself_is_found() {
        // Two cubes that share one corner.
        let mut m = joined(cube(), moved(cube(), 1.0, [1.0; 3]));
        for v in m.triangles.iter_mut().flatten() {
            if *v == 8 {
                *v = 7;
            }
        }
        refused(
            &m,
            "1 vertex where the surface touches itself, 2 separate bodies",
        );
    }
}
