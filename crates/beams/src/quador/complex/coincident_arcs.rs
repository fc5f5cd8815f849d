//! Arcs that bound a face of zero width.

use geometry::math::{Vec3, add, dot, norm, scale, sub};

use super::{COLLAPSE_LENGTH, Complex};

/// An arc that coincides with an earlier one.
#[derive(Clone, Copy, Debug)]
pub(in crate::quador) struct CoincidentArc {
    /// The earlier arc.
    pub of: u32,
    /// Whether both have the same orientation.
    pub same: bool,
    /// The face of zero width between them.
    pub face: usize,
}

impl Complex {
    /// For each arc an earlier one that coincides with it, if any: both bound a face of zero width, such as the fillet
    /// between equal collinear cylinders on the side without other beams. The radius is that of the hub, mm.
    pub(in crate::quador) fn coincident_arcs(&self, radius: f64) -> Vec<Option<CoincidentArc>> {
        let arcs = &self.arcs;
        let mut coincident_arcs = vec![None; arcs.len()];
        for (number, face) in self.faces.iter().enumerate() {
            let walked = face.loops.concat();
            let (&[(a, there), (b, back)], None) = (&walked[..], face.end_circle) else {
                continue;
            };
            let (earlier, later) = (a.min(b), a.max(b));
            let point_on = |arc: u32, t: f64| {
                let conic = &arcs[arc as usize].conic;
                conic.at(t * conic.end)
            };
            // Traversed there and back: if both have the same orientation, one is traversed backwards.
            let same = there != back;
            let near = |p: Vec3, q: Vec3| norm(sub(p, q)) < COLLAPSE_LENGTH * radius;
            let closed = face.loops.len() == 2;
            let coincident = [0.0, 0.25, 0.5].into_iter().all(|t| {
                let both = [earlier, later].map(|arc| [t, 1.0 - t].map(|t| point_on(arc, t)));
                let [[p, q], [r, s]] = both;
                if closed {
                    // Closed arcs may start anywhere: they coincide if they have the same centre and plane.
                    let center = |arc: u32| add(point_on(arc, 0.0), point_on(arc, 0.5));
                    let plane = &arcs[earlier as usize].plane;
                    let off = (dot(plane.a, r) + plane.b).abs() / norm(plane.a);
                    near(scale(center(earlier), 0.5), scale(center(later), 0.5)) && off < COLLAPSE_LENGTH * radius
                } else if same {
                    near(p, r) && near(q, s)
                } else {
                    near(p, s) && near(q, r)
                }
            });
            if a != b && coincident {
                coincident_arcs[later as usize] = Some(CoincidentArc { of: earlier, same, face: number });
            }
        }
        coincident_arcs
    }
}
