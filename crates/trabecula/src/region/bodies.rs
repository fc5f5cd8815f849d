//! Connectivity of a union of regions.

use super::{Context, Region};

/// Boxes that are examined before two regions are taken to touch.
const BOXES: usize = 2000;

/// Warns of a part that is a union of bodies that do not touch; `what` are those.
pub(super) fn warn(of: &[Region], what: &str, context: &mut Context) {
    let groups = if context.is_part() { groups(of) } else { 1 };
    if groups > 1 {
        context.warn(format!("these {} {what} are {groups} bodies that do not touch: the part is in pieces", of.len()));
    }
}

/// The volume (mm³) of a union of regions that surely have no point in common, if that of each is known.
pub(super) fn volume<'a>(of: impl Iterator<Item = &'a Region>) -> Option<f64> {
    let of: Vec<&Region> = of.collect();
    let each: Vec<f64> = of.iter().map(|r| r.volume()).collect::<Option<_>>()?;
    let meets = |i: usize| of[..i].iter().any(|r| may_meet(r, of[i]));
    (!(1..of.len()).any(meets)).then(|| each.iter().sum())
}

/// How many bodies regions surely are when united, at least.
fn groups(of: &[Region]) -> usize {
    let mut left: Vec<usize> = (0..of.len()).collect();
    let mut count = 0;
    while let Some(first) = left.pop() {
        count += 1;
        let mut reached = vec![first];
        while let Some(i) = reached.pop() {
            let (met, rest) = left.iter().partition(|j| may_meet(&of[i], &of[**j]));
            left = rest;
            reached.extend::<Vec<usize>>(met);
        }
    }
    count
}

/// Whether two regions have a point in common. Only that they have none is proven, by boxes of which each is outside one of them.
fn may_meet(a: &Region, b: &Region) -> bool {
    let both = a.bounds().intersection(b.bounds());
    if !both.is_finite() {
        return !both.is_empty();
    }
    let mut boxes = if both.is_empty() { vec![] } else { vec![both] };
    for _ in 0..BOXES {
        let Some(part) = boxes.pop() else {
            return false;
        };
        if a.bound(&part).lo > 0.0 || b.bound(&part).lo > 0.0 {
            continue;
        }
        let (middle, size) = (part.center(), part.size());
        if a.value(middle) <= 0.0 && b.value(middle) <= 0.0 {
            return true;
        }
        let longest = (0..3).fold(0, |l, c| if size[c] > size[l] { c } else { l });
        let (mut below, mut above) = (part, part);
        (below.max[longest], above.min[longest]) = (middle[longest], middle[longest]);
        boxes.extend([below, above]);
    }
    true
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::region::{Cuboid, Cylinder, Sphere};
    use std::sync::Arc;

    #[test]
    fn bodies_of_a_union() {
        let ball = |x: f64, radius| Arc::new(Sphere::new([x, 0.0, 0.0], radius).unwrap()) as Region;
        let post = |x: f64| Arc::new(Cylinder::new([x, x, -5.0], [0.0, 0.0, 1.0], 1.0, 10.0).unwrap()) as Region;
        assert_eq!(groups(&[ball(0.0, 1.0), ball(3.0, 1.0), ball(1.5, 1.0)]), 1);
        assert_eq!(groups(&[ball(0.0, 1.0), ball(3.0, 1.0), ball(9.0, 1.0)]), 3);
        // Their bounds overlap, they do not: the diagonal is √2 · 1.5 mm, the radii 2 mm together; or 1.3 mm.
        assert_eq!(groups(&[post(0.0), post(1.5)]), 2);
        assert_eq!(groups(&[post(0.0), post(1.3)]), 1);
        // Faces in common touch.
        let cube = |x: f64| Arc::new(Cuboid::new([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]).unwrap()) as Region;
        assert_eq!(groups(&[cube(0.0), cube(1.0)]), 1);
        assert_eq!(groups(&[cube(0.0), cube(1.001)]), 2);
    }
}
