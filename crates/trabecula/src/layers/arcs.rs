//! The shape of contours: arcs of one surface between roots and corners, divided until chords follow the section.
//!
//! Points are first set where the cubic through both ends with their tangents needs them, then moved onto the surface. Every chord
//! is checked at its middle: the value there over the length of the gradient is how far the section is from it, and where that is
//! too far the section's point nearest to the middle is added. A surface with creases has corners inside arcs: where the tangents
//! at both ends meet in a point of the surface, that is added.

use super::roots::{IntersectionPoint, SurfacesAtHeight};
use geometry::layer::{Point, length};

/// A part of a contour on one surface, solid on its left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    /// Its ends, mm.
    pub ends: [Point; 2],
    /// The surface; none if it is a chord that is not on one.
    pub surface: Option<u32>,
    /// Gradients of the surface at the ends.
    pub gradients: [Point; 2],
    /// Whether the surfaces of a corner meet at its ends.
    pub corners: [bool; 2],
}

/// A point inside an arc.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArcPoint {
    pub arc: u32,
    /// Its position in the arc: 0 to 1, rising along it.
    pub at: f64,
    pub point: Point,
    /// Outward unit normal; zero at a corner.
    pub normal: Point,
}

/// A chord between adjacent points of an arc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Excess {
    pub arc: u32,
    /// The position where it begins.
    pub at: f64,
    /// The area by which the chord's polygon is larger than the section, mm².
    pub area: f64,
}

/// A chord that is still to be checked.
#[derive(Clone, Copy)]
struct UncheckedChord {
    arc: u32,
    at: [f64; 2],
    ends: [Point; 2],
    gradients: [Point; 2],
}

impl UncheckedChord {
    fn length(&self) -> f64 {
        let [a, b] = self.ends;
        length([b[0] - a[0], b[1] - a[1]])
    }

    fn middle(&self) -> Point {
        let [a, b] = self.ends;
        [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
    }

    /// The two pieces that a point makes of it, with the gradients of each there.
    fn divided(&self, point: Point, gradients: [Point; 2]) -> [UncheckedChord; 2] {
        let at = 0.5 * (self.at[0] + self.at[1]);
        let ([a, b], [g, h]) = (self.ends, self.gradients);
        [
            UncheckedChord { at: [self.at[0], at], ends: [a, point], gradients: [g, gradients[0]], ..*self },
            UncheckedChord { at: [at, self.at[1]], ends: [point, b], gradients: [gradients[1], h], ..*self },
        ]
    }
}

/// Rounds in which chords are halved.
const ROUNDS: usize = 14;

/// Divides all arcs so that their chords are within `most` (mm) of the surfaces at their middles; points are on the surfaces to
/// `accuracy` (mm). Gives points and chords, sorted along the arcs.
pub(super) fn divide(arcs: &[Arc], plane: SurfacesAtHeight, most: f64, accuracy: f64) -> (Vec<ArcPoint>, Vec<Excess>) {
    let (mut inner, mut excess) = (Vec::new(), Vec::new());
    let mut order: Vec<u32> = (0..arcs.len() as u32).filter(|a| arcs[*a as usize].surface.is_some()).collect();
    order.sort_by_key(|a| arcs[*a as usize].surface);
    for of in order.chunk_by(|a, b| arcs[*a as usize].surface == arcs[*b as usize].surface) {
        let Some(surface) = arcs[of[0] as usize].surface else { continue };
        let mut work = ArcRefinement { plane, surface, most, accuracy, inner: &mut inner };
        let mut pieces = work.first(arcs, of);
        for round in 0..ROUNDS {
            pieces = work.check(&pieces, round + 1 == ROUNDS, &mut excess);
            if pieces.is_empty() {
                break;
            }
        }
    }
    inner.sort_unstable_by(|a, b| a.arc.cmp(&b.arc).then(a.at.total_cmp(&b.at)));
    excess.sort_unstable_by(|a, b| a.arc.cmp(&b.arc).then(a.at.total_cmp(&b.at)));
    (inner, excess)
}

/// The work on the arcs of one surface.
struct ArcRefinement<'a> {
    plane: SurfacesAtHeight<'a>,
    surface: u32,
    most: f64,
    accuracy: f64,
    inner: &'a mut Vec<ArcPoint>,
}

impl ArcRefinement<'_> {
    fn creased(&self) -> bool {
        self.plane.surfaces[self.surface as usize].has_creases
    }

    /// The first division of arcs, by the cubics through their ends.
    fn first(&mut self, arcs: &[Arc], of: &[u32]) -> Vec<UncheckedChord> {
        let (mut guesses, mut counts) = (Vec::new(), Vec::new());
        for &a in of {
            let arc = &arcs[a as usize];
            let before = guesses.len();
            if !self.creased() {
                cubic_points(arc, 0.8 * self.most, &mut guesses);
            }
            counts.push(guesses.len() - before);
        }
        let gradients = self.project(&mut guesses);
        let (mut pieces, mut next) = (Vec::new(), 0);
        for (&a, &count) in of.iter().zip(&counts) {
            let arc = &arcs[a as usize];
            let (mut from, mut slope, mut begin) = (arc.ends[0], arc.gradients[0], 0.0);
            for k in 0..count {
                let (point, gradient, at) = (guesses[next], gradients[next], (k + 1) as f64 / (count + 1) as f64);
                next += 1;
                self.inner.push(ArcPoint { arc: a, at, point, normal: unit(gradient) });
                pieces.push(UncheckedChord {
                    arc: a,
                    at: [begin, at],
                    ends: [from, point],
                    gradients: [slope, gradient],
                });
                (from, slope, begin) = (point, gradient, at);
            }
            let last = [slope, arc.gradients[1]];
            pieces.push(UncheckedChord { arc: a, at: [begin, 1.0], ends: [from, arc.ends[1]], gradients: last });
        }
        pieces
    }

    /// Moves points onto the surface; gives the gradients there.
    fn project(&self, points: &mut [Point]) -> Vec<Point> {
        let mut gradients = vec![[0.0; 2]; points.len()];
        // Newton's method squares the error, if the surface is smooth: of a step that short nothing is left.
        let enough = if self.creased() { self.accuracy } else { (0.1 * self.accuracy).sqrt() };
        let mut open: Vec<usize> = (0..points.len()).collect();
        for _ in 0..8 {
            let found = self.plane.evaluate(self.surface, open.iter().map(|i| points[*i]));
            let mut n = 0;
            open.retain(|&i| {
                let (value, gradient, length) = found.at(n);
                n += 1;
                gradients[i] = gradient;
                let by = -value / (length * length);
                if !by.is_finite() {
                    return false;
                }
                points[i] = [0, 1].map(|k| points[i][k] + by * gradient[k]);
                (by * length).abs() > enough
            });
            if open.is_empty() {
                break;
            }
        }
        gradients
    }

    /// Checks chords at their middles; gives those into which the ones that are too far off are divided.
    fn check(&mut self, pieces: &[UncheckedChord], last: bool, excess: &mut Vec<Excess>) -> Vec<UncheckedChord> {
        let found = self.plane.evaluate(self.surface, pieces.iter().map(UncheckedChord::middle));
        let mut far = Vec::new();
        for (i, piece) in pieces.iter().enumerate() {
            let (value, _, slope) = found.at(i);
            let (off, length) = (value / slope, piece.length());
            // A section that turns within a chord's length is followed to that length.
            let off = if off.is_finite() { off.clamp(-0.5 * length, 0.5 * length) } else { 0.0 };
            if off.abs() <= self.most || last || length <= self.most {
                // The area between an arc and its chord is two thirds of height times length, but for the fourth order.
                excess.push(Excess { arc: piece.arc, at: piece.at[0], area: 2.0 / 3.0 * off * length });
            } else {
                far.push(*piece);
            }
        }
        let corners = if self.creased() { self.creases(&far) } else { far.iter().map(|_| None).collect() };
        let mut middles: Vec<Point> = far.iter().map(UncheckedChord::middle).collect();
        let gradients = self.project(&mut middles);
        let mut next = Vec::new();
        for (i, piece) in far.iter().enumerate() {
            let at = 0.5 * (piece.at[0] + piece.at[1]);
            let beyond = (0..2).map(|k| (middles[i][k] - piece.middle()[k]).abs()).fold(0.0, f64::max) > piece.length();
            let (point, normal, both) = match &corners[i] {
                Some(corner) => (corner.point, [0.0; 2], corner.tangents.map(|t| t.1)),
                // Newton's method went astray, where the gradient vanishes.
                None if beyond => {
                    excess.push(Excess { arc: piece.arc, at: piece.at[0], area: 0.0 });
                    continue;
                }
                None => (middles[i], unit(gradients[i]), [gradients[i]; 2]),
            };
            self.inner.push(ArcPoint { arc: piece.arc, at, point, normal });
            next.extend(piece.divided(point, both));
        }
        next
    }

    /// For each piece the corner of the section between its ends, if there is one: where the tangents of both meet, taken ever nearer
    /// to the corner.
    fn creases(&self, pieces: &[UncheckedChord]) -> Vec<Option<Crease>> {
        let mut found: Vec<Option<Crease>> = pieces.iter().map(|p| Crease::of(p.ends, p)).collect();
        for halving in 1..=HALVINGS {
            let near = |(crease, piece): (&Crease, &UncheckedChord)| {
                let share = 0.5f64.powi(halving);
                piece.ends.map(|e| [0, 1].map(|k| crease.point[k] + share * (e[k] - crease.point[k])))
            };
            let open: Vec<usize> = (0..pieces.len()).filter(|i| found[*i].is_some()).collect();
            let points: Vec<[Point; 2]> =
                open.iter().filter_map(|&i| Some(near((found[i].as_ref()?, &pieces[i])))).collect();
            let values = self.plane.evaluate(self.surface, points.iter().flatten().copied());
            for (n, (&i, at)) in open.iter().zip(&points).enumerate() {
                found[i] = found[i].as_ref().and_then(|c| {
                    let tangents = [0, 1].map(|k| {
                        let (value, gradient, length) = values.at(2 * n + k);
                        let foot = [0, 1].map(|a| at[k][a] - value / (length * length) * gradient[a]);
                        // Beyond the crease it is the other arc's.
                        let [own, other] = [k, 1 - k].map(|j| dot(unit(gradient), unit(pieces[i].gradients[j])));
                        if own > other { (foot, gradient) } else { (c.tangents[k].0, c.tangents[k].1) }
                    });
                    Crease::between(tangents, &pieces[i])
                });
            }
        }
        let values = self.plane.evaluate(self.surface, found.iter().flatten().map(|c| c.point));
        let mut n = 0;
        let mut on_surface = |_: &Crease| {
            let (value, _, length) = values.at(n);
            n += 1;
            value.abs() <= 0.1 * self.most * length.max(1e-3)
        };
        found.into_iter().map(|c| c.filter(&mut on_surface)).collect()
    }
}

/// Times that the tangents of a corner are taken at half the distance: what is left of the curvature of an arc is a thousandth.
const HALVINGS: i32 = 5;
/// How far from its ends the corner of a chord may be, in its lengths.
const FARTHEST: f64 = 16.0;

/// A corner of the section on one surface.
struct Crease {
    point: Point,
    /// A point of each of the two tangents that meet in it, with the gradient there.
    tangents: [(Point, Point); 2],
}

impl Crease {
    /// Where the tangents at the ends of a piece meet.
    fn of(ends: [Point; 2], piece: &UncheckedChord) -> Option<Crease> {
        Crease::between([0, 1].map(|k| (ends[k], piece.gradients[k])), piece)
    }

    /// Where two tangents meet, if that is ahead of both ends of a piece.
    fn between(tangents: [(Point, Point); 2], piece: &UncheckedChord) -> Option<Crease> {
        let [t, u] = tangents.map(|(_, g)| tangent(unit(g)));
        let turn = t[0] * u[1] - t[1] * u[0];
        let [p, q] = tangents.map(|(p, _)| p);
        let d = [q[0] - p[0], q[1] - p[1]];
        let along = (d[0] * u[1] - d[1] * u[0]) / turn;
        let point = [0, 1].map(|k| p[k] + along * t[k]);
        let ahead = |k: usize, t: Point| dot([0, 1].map(|a| point[a] - piece.ends[k][a]), t);
        let (ahead, behind, most) = (ahead(0, t), -ahead(1, u), FARTHEST * piece.length());
        // Bends of less than a degree are curvature, or end soon by halving.
        let is_corner = turn.abs() > 0.02 && ahead > 0.0 && behind > 0.0 && ahead < most && behind < most;
        is_corner.then_some(Crease { point, tangents })
    }
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Points of the cubic through an arc's ends with its tangents, where chords need them to be within `most`.
fn cubic_points(arc: &Arc, most: f64, out: &mut Vec<Point>) {
    let [a, b] = arc.ends;
    let d = [b[0] - a[0], b[1] - a[1]];
    let length = length(d);
    let slopes = arc.gradients.map(|g| {
        let t = tangent(unit(g));
        (t[0] * d[1] - t[1] * d[0]) / (t[0] * d[0] + t[1] * d[1])
    });
    let [p, q] = slopes;
    if !(p.abs() < 2.0 && q.abs() < 2.0 && length > 0.0) {
        return;
    }
    // Height y(u) = p (u − 2u² + u³) + q (u³ − u²) in units of the length, over the share u of the chord.
    let bend = (4.0 * p + 2.0 * q).abs().max((2.0 * p + 4.0 * q).abs()) * length;
    let count = (bend / (8.0 * most)).sqrt().ceil().clamp(1.0, 64.0) as usize;
    for k in 1..count {
        let u = k as f64 / count as f64;
        let y = p * u * (1.0 - u) * (1.0 - u) - q * u * u * (1.0 - u);
        out.push([a[0] + u * d[0] + y * d[1], a[1] + u * d[1] - y * d[0]]);
    }
}

/// The corner between two chords, to be looked for between them.
pub(super) fn intersection_guess(
    ends: [Point; 2],
    surfaces: [u32; 2],
    gradients: [Point; 2],
    bounds: [Point; 2],
) -> IntersectionPoint {
    let [t, u] = gradients.map(|g| tangent(unit(g)));
    let turn = t[0] * u[1] - t[1] * u[0];
    let d = [0, 1].map(|k| ends[1][k] - ends[0][k]);
    let along = (d[0] * u[1] - d[1] * u[0]) / turn;
    let inside = |p: &Point| (0..2).all(|k| p[k] >= bounds[0][k] && p[k] <= bounds[1][k]);
    let tangents = [0, 1].map(|k| ends[0][k] + along * t[k]);
    let middle = [0, 1].map(|k| 0.5 * (ends[0][k] + ends[1][k]));
    let point = Some(tangents).filter(inside).unwrap_or(middle);
    IntersectionPoint { surfaces, point, bounds, gradients, found: false }
}

/// The direction along a contour, solid on its left, where the outward normal is this.
pub(super) fn tangent([x, y]: Point) -> Point {
    [-y, x]
}

/// The unit vector along a gradient; zero if it vanishes.
pub(super) fn unit([x, y]: Point) -> Point {
    let length = length([x, y]);
    if length > 0.0 { [x / length, y / length] } else { [0.0; 2] }
}
