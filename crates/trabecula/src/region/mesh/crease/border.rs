//! The borders of patches: how triangles touch them, and which patches they are common to.

use std::collections::HashMap;

use super::super::MeshRegion;
use super::super::patches::{Patches, TURN};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};

/// A triangle or corner that touches no border.
pub(super) const INNER: u32 = u32::MAX;

/// How a triangle touches the border of its patch.
#[derive(Clone, Copy)]
pub(super) struct Rim {
    /// For each edge on the border how far its continuation leans away, per mm; not a number for the others.
    pub(super) lean: [f64; 3],
    /// For each corner on the border its fan.
    pub(super) fan: [u32; 3],
}

/// The triangles of a patch at a corner on its border.
#[derive(Clone, Copy)]
pub(super) struct Fan {
    pub(super) normal: Vec3,
    /// Along the patch, away from its border.
    pub(super) inward: Vec3,
    pub(super) lean: f64,
}

/// The common border of two patches.
pub(super) struct Seam {
    pub(super) bounds: Aabb,
    /// Middles of its edges, and how much the solid bends inwards there: turn times length.
    pub(super) edges: Vec<(Vec3, f64)>,
    /// Whether it is concave; none if it is so in part only.
    pub(super) concave: Option<bool>,
}

/// The borders that patches have in common.
pub(super) fn seams(region: &MeshRegion, patches: &Patches) -> HashMap<(u32, u32), Seam> {
    /// The share of a border that may bend the other way.
    const STRAY: f64 = 0.02;
    let mut seams: HashMap<(u32, u32), Seam> = HashMap::new();
    for e in &patches.borders {
        let [a, b] = e.halves.map(|h| patches.of[h as usize / 3]);
        let (corners, k) = (
            region.mesh.corners(e.halves[0] as usize / 3),
            e.halves[0] as usize % 3,
        );
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let seam = seams.entry((a.min(b), a.max(b))).or_insert(Seam {
            bounds: Aabb::EMPTY,
            edges: Vec::new(),
            concave: None,
        });
        seam.bounds = seam.bounds.with(p).with(q);
        seam.edges
            .push((scale(add(p, q), 0.5), -e.turn * norm(sub(p, q))));
    }
    // Patches that have a corner in common only.
    let mut about: HashMap<u32, Vec<u32>> = HashMap::new();
    for e in &patches.borders {
        for h in e.halves {
            let (t, k) = (region.mesh.triangles[h as usize / 3], h as usize % 3);
            for v in [t[k], t[(k + 1) % 3]] {
                about.entry(v).or_default().push(patches.of[h as usize / 3]);
            }
        }
    }
    for (v, list) in &mut about {
        list.sort_unstable();
        list.dedup();
        for (i, a) in list.iter().enumerate() {
            for b in &list[..i] {
                let seam = seams.entry((*b, *a)).or_insert(Seam {
                    bounds: Aabb::EMPTY,
                    edges: Vec::new(),
                    concave: None,
                });
                seam.bounds = seam.bounds.with(region.mesh.vertices[*v as usize]);
            }
        }
    }
    for s in seams.values_mut().filter(|s| !s.edges.is_empty()) {
        let sum = |sign: f64| s.edges.iter().map(|e| (sign * e.1).max(0.0)).sum::<f64>();
        let (inwards, outwards) = (sum(1.0), sum(-1.0));
        if inwards.min(outwards) <= STRAY * (inwards + outwards) {
            s.concave = Some(inwards > outwards);
            s.edges = Vec::new();
        }
    }
    seams
}

/// The triangles that touch borders, in the tree's order; which one each triangle is; and the fans at the corners.
pub(super) fn rims(region: &MeshRegion, patches: &Patches) -> (Vec<Rim>, Vec<u32>, Vec<Fan>) {
    let (mesh, tree) = (&region.mesh, &region.tree);
    let mut leans: HashMap<u32, f64> = HashMap::new();
    let mut on_border = vec![false; mesh.vertices.len()];
    for e in &patches.borders {
        // What turns less than it takes to be a crease is made to, so that the other patch leaves the surface.
        let more = (TURN.tan() - e.turn.abs().min(TURN).tan()).max(0.0);
        let lean = if e.turn >= 0.0 { -more } else { more };
        for h in e.halves {
            leans.insert(h, lean);
            let (t, k) = (mesh.triangles[h as usize / 3], h as usize % 3);
            on_border[t[k] as usize] = true;
            on_border[t[(k + 1) % 3] as usize] = true;
        }
    }
    let mut fans: Vec<Fan> = Vec::new();
    let mut counts: Vec<f64> = Vec::new();
    let mut names: HashMap<(u32, u32), u32> = HashMap::new();
    let (mut rims, mut rim) = (Vec::new(), vec![INNER; mesh.triangles.len()]);
    for (i, &t) in region.order.iter().enumerate() {
        let corners = mesh.triangles[t as usize];
        if !corners.iter().any(|v| on_border[*v as usize]) {
            continue;
        }
        let face = &tree.faces()[i];
        let lean = [0, 1, 2].map(|k| leans.get(&(3 * t + k)).copied().unwrap_or(f64::NAN));
        let mut fan = [INNER; 3];
        for k in 0..3 {
            if !on_border[corners[k] as usize] {
                continue;
            }
            let name = names
                .entry((corners[k], patches.of[t as usize]))
                .or_insert(fans.len() as u32);
            fan[k] = *name;
            if *name as usize == fans.len() {
                fans.push(Fan {
                    normal: [0.0; 3],
                    inward: [0.0; 3],
                    lean: 0.0,
                });
                counts.push(0.0);
            }
            let f = &mut fans[*name as usize];
            let [a, b, c] = [0, 1, 2].map(|j| face.corners[(k + j) % 3]);
            let (u, v) = (sub(b, a), sub(c, a));
            let angle = norm(cross(u, v)).atan2(dot(u, v));
            f.normal = add(f.normal, scale(face.normal, angle));
            f.inward = add(f.inward, scale(add(unit(u), unit(v)), angle));
            for l in [lean[k], lean[(k + 2) % 3]]
                .into_iter()
                .filter(|l| !l.is_nan())
            {
                f.lean += l;
                counts[*name as usize] += 1.0;
            }
        }
        rim[i] = rims.len() as u32;
        rims.push(Rim { lean, fan });
    }
    for (f, count) in fans.iter_mut().zip(counts) {
        f.normal = unit(f.normal);
        f.inward = unit(sub(f.inward, scale(f.normal, dot(f.inward, f.normal))));
        f.lean = if count > 0.0 { f.lean / count } else { 0.0 };
    }
    (rims, rim, fans)
}
