//! Similarity transforms: rotations, reflections, scalings and translations, and what is made of them.

use geometry::math::{Aabb, IDENTITY, Mat3, Vec3, add, apply, determinant, norm, product, scale, sub, transpose};

/// Entries of a rotation that are this close to −1, 0 or 1 in all places are these: a hundred times their rounding.
const ROUNDING: f64 = 2e-14;

/// A similarity transform x ↦ s R (x − c) + d.
///
/// Where R takes axes to axes, coordinates are only negated, scaled and shifted: planes normal to an axis stay such planes, and a
/// plane through c comes to lie at d exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// s, positive.
    scale: f64,
    /// R, orthogonal; its determinant is −1 if it mirrors.
    turn: Mat3,
    /// c, mm.
    from: Vec3,
    /// d, mm.
    to: Vec3,
}

impl Similarity {
    /// x ↦ s R (x − about) + about + by, with an orthogonal R; lengths in mm.
    pub fn new(s: f64, turn: Mat3, about: Vec3, by: Vec3) -> Similarity {
        Similarity { scale: s, turn: sharp(turn), from: about, to: add(about, by) }
    }

    /// The factor on lengths.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether it is the identity.
    pub fn is_identity(&self) -> bool {
        self.scale == 1.0 && self.turn == IDENTITY && self.from == self.to
    }

    /// Whether it reverses orientation.
    pub fn mirrors(&self) -> bool {
        determinant(&self.turn) < 0.0
    }

    /// Whether it takes the coordinate axes to coordinate axes.
    pub fn keeps_axes(&self) -> bool {
        self.turn.iter().flatten().all(|v| v.fract() == 0.0)
    }

    /// The image of a point, mm.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        add(scale(apply(&self.turn, sub(p, self.from)), self.scale), self.to)
    }

    /// The point whose image this is, mm.
    #[inline]
    pub fn back(&self, p: Vec3) -> Vec3 {
        add(scale(apply(&transpose(&self.turn), sub(p, self.to)), 1.0 / self.scale), self.from)
    }

    /// The image of a direction, of the same length.
    pub fn direction(&self, d: Vec3) -> Vec3 {
        apply(&self.turn, d)
    }

    /// The bounds of the image of a box, which may have no end.
    pub fn bounds(&self, b: &Aabb) -> Aabb {
        if b.is_empty() {
            return Aabb::EMPTY;
        }
        let (lo, hi) = (sub(b.min, self.from), sub(b.max, self.from));
        self.hull(&self.turn, self.scale, self.to, [lo, hi])
    }

    /// A box that holds all points whose images lie in a box, rounding included.
    pub fn back_bounds(&self, b: &Aabb) -> Aabb {
        let (lo, hi) = (sub(b.min, self.to), sub(b.max, self.to));
        let hull = self.hull(&transpose(&self.turn), 1.0 / self.scale, self.from, [lo, hi]);
        let far = |v: Vec3| norm(v);
        let terms = (far(b.min) + far(b.max) + far(self.to)) / self.scale + far(self.from);
        hull.grown(8.0 * f64::EPSILON * terms)
    }

    /// Σⱼ s Mᵢⱼ dⱼ + o over a box of d; a coordinate without weight does not count, infinite or not.
    fn hull(&self, m: &Mat3, s: f64, o: Vec3, [lo, hi]: [Vec3; 2]) -> Aabb {
        let end = |upper: bool| {
            [0, 1, 2].map(|i| {
                let term = |j: usize| match m[i][j] {
                    0.0 => 0.0,
                    w => w * if (w > 0.0) == upper { hi[j] } else { lo[j] },
                };
                s * (0..3).map(term).sum::<f64>() + o[i]
            })
        };
        Aabb { min: end(false), max: end(true) }
    }

    /// This after another.
    pub fn after(&self, first: &Similarity) -> Similarity {
        Similarity {
            scale: self.scale * first.scale,
            turn: sharp(product(&self.turn, &first.turn)),
            from: first.from,
            to: self.point(first.to),
        }
    }
}

/// An orthogonal matrix, exact if it takes axes to axes.
fn sharp(m: Mat3) -> Mat3 {
    let near = m.map(|row| row.map(f64::round));
    let close = (0..9).all(|n| (m[n / 3][n % 3] - near[n / 3][n % 3]).abs() <= ROUNDING);
    if close { near.map(|row| row.map(|v| v + 0.0)) } else { m }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::rotation;
    use geometry::random::random;

    fn some(seed: &mut u64) -> Similarity {
        let v = |seed: &mut u64, reach: f64| [0; 3].map(|_| reach * random(seed));
        let mut mirror = IDENTITY;
        mirror[1][1] = if random(seed) > 0.0 { -1.0 } else { 1.0 };
        let turn = product(&rotation(v(seed, 180.0)), &mirror);
        Similarity::new(2f64.powf(random(seed)), turn, v(seed, 5.0), v(seed, 5.0))
    }

    #[test]
    fn transforms_are_undone_and_composed() {
        let mut seed = 3;
        for _ in 0..500 {
            let (a, b) = (some(&mut seed), some(&mut seed));
            let p = [0; 3].map(|_| 9.0 * random(&mut seed));
            assert!(norm(sub(a.back(a.point(p)), p)) < 1e-13);
            assert!(norm(sub(b.after(&a).point(p), b.point(a.point(p)))) < 1e-12);
            let q = add(p, [1.0, 2.0, -0.5]);
            let long = norm(sub(a.point(q), a.point(p)));
            assert!((long - a.scale() * norm(sub(q, p))).abs() < 1e-12);
            assert_eq!(b.after(&a).mirrors(), a.mirrors() != b.mirrors());
            let box_ = Aabb::EMPTY.with(p).with(q);
            assert!(a.bounds(&box_).grown(1e-12).distance(a.point(scale(add(p, q), 0.5))) == 0.0);
            assert!(a.back_bounds(&a.bounds(&box_)).distance(p) == 0.0);
        }
    }

    #[test]
    fn turns_onto_axes_are_exact() {
        let turn = Similarity::new(1.0, rotation([0.0, 0.0, -90.0]), [0.1, 0.2, 0.3], [0.0; 3]);
        assert_eq!(turn.point([0.1, 0.2, 7.7]), [0.1, 0.2, 7.7]);
        assert!(turn.keeps_axes() && !turn.mirrors());
        let oblique = Similarity::new(1.0, rotation([31.0, 22.0, 13.0]), [0.0; 3], [0.0; 3]);
        let undone = Similarity { turn: transpose(&oblique.turn), ..oblique }.after(&oblique);
        assert!(!oblique.keeps_axes() && undone.is_identity());
    }

    #[test]
    fn endless_boxes_stay_endless_along_the_axes_that_they_are_turned_onto() {
        let slab = Aabb { min: [f64::NEG_INFINITY, -1.0, f64::NEG_INFINITY], max: [f64::INFINITY, 1.0, 0.0] };
        let b = Similarity::new(2.0, rotation([0.0, 0.0, 90.0]), [0.0; 3], [3.0, 0.0, 0.0]).bounds(&slab);
        assert_eq!((b.min, b.max), ([1.0, f64::NEG_INFINITY, f64::NEG_INFINITY], [5.0, f64::INFINITY, 0.0]));
    }
}
