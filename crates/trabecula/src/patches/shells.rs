//! The connected parts of a boundary, put together to solids: each an outer shell, and the shells of its closed voids.

use geometry::math::{Vec3, dot, sub};
use geometry::union_find::{labels, singles, unite};

use super::bezier::{basis, cone_volume, sum};
use super::boundary::{Boundary, Carrier, contains, flat, outward};

/// The faces of a shell, by their numbers.
pub type Shell = Vec<u32>;

/// A solid: its outer shell, then those of its voids.
pub struct Shells {
    /// The shells.
    pub shells: Vec<Shell>,
}

impl Boundary {
    /// The volume (mm³) that faces enclose, exact; negative for a void.
    pub fn volume(&self, faces: &[u32]) -> f64 {
        let from = self.bounds.min;
        let of = |f: &u32| {
            let face = &self.faces[*f as usize];
            match &face.carrier {
                Carrier::Patch(patch) => cone_volume(patch, from),
                Carrier::Plane(plane) => {
                    let at = self.vertices[self.start(face.loops[0][0]) as usize];
                    let area: f64 = face.loops.iter().map(|l| self.area(l, *plane)).sum();
                    dot(outward(*plane), sub(at, from)) * area / 3.0
                }
            }
        };
        faces.iter().map(of).sum()
    }

    /// The solids, in the order of their first faces.
    pub fn solids(&self) -> Vec<Shells> {
        let mut root = singles(self.faces.len());
        let mut first = vec![u32::MAX; self.edges.len()];
        for (f, face) in self.faces.iter().enumerate() {
            for (edge, _) in face.loops.iter().flatten() {
                let known = &mut first[*edge as usize];
                if *known == u32::MAX {
                    *known = f as u32;
                } else {
                    unite(&mut root, *known, f as u32);
                }
            }
        }
        let (label, count) = labels(&mut root);
        let mut shells = vec![Shell::new(); count];
        label.iter().enumerate().for_each(|(f, s)| shells[*s as usize].push(f as u32));
        let is_void: Vec<bool> = shells.iter().map(|s| self.volume(s) < 0.0).collect();
        // A void belongs to the solid of the shell that is next in a direction from its farthest point there.
        let next: Vec<usize> =
            (0..count).map(|s| if is_void[s] { self.next_shell(&shells[s], s, &label) } else { s }).collect();
        let mut solids: Vec<Shells> = Vec::new();
        let mut number = vec![usize::MAX; count];
        for s in (0..count).filter(|s| !is_void[*s]) {
            number[s] = solids.len();
            solids.push(Shells { shells: vec![shells[s].clone()] });
        }
        for s in (0..count).filter(|s| is_void[*s]) {
            let mut outer = s;
            for _ in 0..count {
                outer = next[outer];
            }
            if let Some(solid) = solids.get_mut(number[outer]) {
                solid.shells.push(shells[s].clone());
            }
        }
        solids
    }

    /// The shell that a ray along x meets first, from the point of a shell that is farthest along x.
    fn next_shell(&self, shell: &Shell, own: usize, label: &[u32]) -> usize {
        let corners = shell.iter().flat_map(|f| &self.faces[*f as usize].loops[0]);
        let at = corners.map(|s| self.vertices[self.start(*s) as usize]).max_by(|a, b| a[0].total_cmp(&b[0]));
        let Some(at) = at else { return own };
        let mut nearest = (f64::INFINITY, own);
        for (f, face) in self.faces.iter().enumerate().filter(|(f, _)| label[*f] as usize != own) {
            let found = match &face.carrier {
                Carrier::Patch(patch) => {
                    let hull = patch.iter().flatten();
                    let ahead = hull.clone().any(|p| p[0] > at[0]);
                    let over = |a: usize| hull.clone().any(|p| p[a] >= at[a]) && hull.clone().any(|p| p[a] <= at[a]);
                    if !(ahead && over(1) && over(2)) { None } else { hit(patch, at) }
                }
                Carrier::Plane(1) if contains(&self.outline(&face.loops[0], 1), flat(at, 1)) => {
                    Some(self.bounds.max[0] - at[0])
                }
                Carrier::Plane(_) => None,
            };
            if let Some(along) = found.filter(|along| *along < nearest.0) {
                nearest = (along, label[f] as usize);
            }
        }
        nearest.1
    }
}

/// How far along x a ray meets a patch, by triangles.
fn hit(patch: &super::bezier::BicubicPatch, from: Vec3) -> Option<f64> {
    const PARTS: usize = 6;
    let at = |i: usize, j: usize| {
        let [u, v] = [i, j].map(|k| k as f64 / PARTS as f64);
        sum(&patch.map(|row| sum(&row, basis(v))), basis(u))
    };
    let mut nearest: Option<f64> = None;
    for i in 0..PARTS {
        for j in 0..PARTS {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for [p, q, r] in [[a, b, c], [a, c, d]] {
                let side = |p: Vec3, q: Vec3| (p[1] - from[1]) * (q[2] - from[2]) - (p[2] - from[2]) * (q[1] - from[1]);
                let w = [side(q, r), side(r, p), side(p, q)];
                let total: f64 = w.iter().sum();
                if total == 0.0 || !(w.iter().all(|w| *w >= 0.0) || w.iter().all(|w| *w <= 0.0)) {
                    continue;
                }
                let along = (w[0] * p[0] + w[1] * q[0] + w[2] * r[0]) / total - from[0];
                if along > 0.0 && nearest.is_none_or(|n| along < n) {
                    nearest = Some(along);
                }
            }
        }
    }
    nearest
}
