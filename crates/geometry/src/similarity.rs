//! Similarity transforms: rotations, reflections, scalings and translations, and what is made of them.

use crate::math::{Aabb, IDENTITY, Mat3, Vec3, add, apply, determinant, norm, product, scale, sub, transpose};

/// Entries of a rotation that are this close to −1, 0 or 1 in all places are these: a hundred times their rounding.
const ROUNDING: f64 = 2e-14;
/// Most powers among which one is searched for that is the identity.
const LONGEST_PERIOD: u32 = 100_000;

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
    /// The identity.
    pub const IDENTITY: Similarity = Similarity { scale: 1.0, turn: IDENTITY, from: [0.0; 3], to: [0.0; 3] };

    /// x ↦ s R (x − about) + about + by, with an orthogonal R; lengths in mm.
    pub fn new(s: f64, turn: Mat3, about: Vec3, by: Vec3) -> Similarity {
        Similarity { scale: s, turn: sharp(turn), from: about, to: add(about, by) }
    }

    /// x ↦ x + by.
    pub fn translation(by: Vec3) -> Similarity {
        Similarity { to: by, ..Similarity::IDENTITY }
    }

    /// The factor on lengths.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether it is the identity.
    pub fn is_identity(&self) -> bool {
        self.scale == 1.0 && self.turn == IDENTITY && self.from == self.to
    }

    /// By what it shifts all points, mm, if it is a translation.
    #[inline]
    pub fn shift(&self) -> Option<Vec3> {
        (self.scale == 1.0 && self.turn == IDENTITY).then(|| sub(self.to, self.from))
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
        self.inverse().point(p)
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
        let [lo, hi] = [sub(b.min, self.from), sub(b.max, self.from)];
        if self.shift().is_some() {
            return Aabb { min: add(lo, self.to), max: add(hi, self.to) };
        }
        // A coordinate without weight does not count, infinite or not.
        let end = |upper: bool| {
            [0, 1, 2].map(|i| {
                let term = |j: usize| match self.turn[i][j] {
                    0.0 => 0.0,
                    w => w * if (w > 0.0) == upper { hi[j] } else { lo[j] },
                };
                self.scale * (0..3).map(term).sum::<f64>() + self.to[i]
            })
        };
        Aabb { min: end(false), max: end(true) }
    }

    /// A box that holds all points whose images lie in a box, rounding included.
    pub fn back_bounds(&self, b: &Aabb) -> Aabb {
        let terms = (norm(b.min) + norm(b.max) + norm(self.to)) / self.scale + norm(self.from);
        self.inverse().bounds(b).grown(8.0 * f64::EPSILON * terms)
    }

    /// The inverse.
    pub fn inverse(&self) -> Similarity {
        Similarity { scale: 1.0 / self.scale, turn: transpose(&self.turn), from: self.to, to: self.from }
    }

    /// The powers 0 to `count` − 1.
    pub fn powers(&self, count: usize) -> Vec<Similarity> {
        let next = |p: &Similarity| Some(self.after(p));
        std::iter::successors(Some(Similarity::IDENTITY), next).take(count).collect()
    }

    /// Angle of the rotation, degrees.
    pub fn angle(&self) -> f64 {
        let r = &self.turn;
        let sine = norm([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]);
        sine.atan2(r[0][0] + r[1][1] + r[2][2] - 1.0).to_degrees()
    }

    /// The first power below `count` that is the identity, within rounding at points up to `size` (mm) from the origin.
    pub fn period(&self, count: u32, size: f64) -> Option<u32> {
        if self.scale != 1.0 || self.shift().is_some_and(|by| by != [0.0; 3]) {
            return None;
        }
        let far = size + norm(self.to) + norm(self.from);
        let mut power = *self;
        (1..count.min(LONGEST_PERIOD)).find(|n| {
            let off = 1e-12 + 1e-15 * f64::from(*n);
            let same = power.is_near(&Similarity::IDENTITY, off, far);
            power = self.after(&power);
            same
        })
    }

    /// Whether the two commute, within rounding at points up to `size` (mm) from the origin.
    pub fn commutes(&self, other: &Similarity, size: f64) -> bool {
        let (a, b) = (self.after(other), other.after(self));
        a.is_near(&b, 1e-12, size + norm(a.point([0.0; 3])))
    }

    /// Whether rotations differ by no more than `off`, and images of the origin by no more than `off` times `far` (mm).
    fn is_near(&self, other: &Similarity, off: f64, far: f64) -> bool {
        let turned = (0..9).any(|n| (self.turn[n / 3][n % 3] - other.turn[n / 3][n % 3]).abs() > off);
        let between = sub(self.point([0.0; 3]), other.point([0.0; 3]));
        !turned && between.iter().all(|t| t.abs() <= off * far)
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
    use crate::math::rotation;
    use crate::random::random;

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
        let undone = oblique.inverse().after(&oblique);
        assert!(!oblique.keeps_axes() && undone.is_identity());
    }

    #[test]
    fn endless_boxes_stay_endless_along_the_axes_that_they_are_turned_onto() {
        let slab = Aabb { min: [f64::NEG_INFINITY, -1.0, f64::NEG_INFINITY], max: [f64::INFINITY, 1.0, 0.0] };
        let b = Similarity::new(2.0, rotation([0.0, 0.0, 90.0]), [0.0; 3], [3.0, 0.0, 0.0]).bounds(&slab);
        assert_eq!((b.min, b.max), ([1.0, f64::NEG_INFINITY, f64::NEG_INFINITY], [5.0, f64::INFINITY, 0.0]));
    }
}
