//! A fillet or a corner cut into bands: pieces that two numbers run over, with the place analytic in both.
//!
//! Seen from a place inside its quadric, a face is swept by half planes through an axis. Between two half planes that pass
//! through vertices, or touch seams, it is a number of bands, each from one seam to another along every half plane; where a
//! half plane meets a seam is the root of a quadratic.
//!
//! The pair a, b of a fillet is a function of b/a along each of its conics, so its axis is the line a = b = 0. With n normal to
//! both beams' axes the section of the fillet by b = μa is h² = A g² + B g + C, with C > 0 where the line is inside the ball.
//! From the place in the middle of that line 1/s is (−B cos ψ + √((B² − 4AC) cos² ψ + 4C sin² ψ))/2C at latitude ψ. So the
//! whole of the fillet is seen from there and nothing is hidden, however wide it is. Corners are seen from the hub's centre.

mod section;

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::complex::{Complex, Face};
use super::hub::Hub;
use super::quadric::Quadric;
pub(super) use section::Section;

/// A place and an axis through it: longitude φ about the axis, latitude ψ towards the pole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// From the hub's centre.
    pub origin: Vec3,
    /// Directions of φ = 0, of φ = 90°, and of the pole.
    pub axes: [Vec3; 3],
    /// The quadric of the face, about the origin.
    pub quadric: Quadric,
    /// Whether half planes cut it in `Section`s.
    pub fillet: bool,
}

/// What ends a band along its half planes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Border {
    /// The pole, at this latitude.
    Pole(f64),
    /// Part of a seam.
    Seam(Part),
}

/// Part of an arc over which the longitude grows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// The arc.
    pub arc: u32,
    /// Cosines of its greatest angle and its least.
    cosines: [f64; 2],
}

impl Part {
    fn new(arc: u32, angles: [f64; 2]) -> Part {
        let [lo, hi] = [angles[0].min(angles[1]), angles[0].max(angles[1])];
        Part {
            arc,
            cosines: [hi.cos(), lo.cos()],
        }
    }
}

/// Part of a face between two half planes and two borders.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    /// Longitudes.
    pub along: [f64; 2],
    /// Whether a half plane touches a border at its first or last longitude.
    pub touch: [bool; 2],
    /// The lower border and the upper.
    pub borders: [Border; 2],
}

/// Longitudes nearer than this are one: above what merged vertices leave, and its square is nothing.
const SAME: f64 = 3e-7;

impl Frame {
    fn new(face: &Face, origin: Vec3, east: Vec3, pole: Vec3) -> Frame {
        let q = &face.quadric;
        let pole = unit(pole);
        let east = unit(sub(east, scale(pole, dot(east, pole))));
        Frame {
            origin,
            axes: [east, cross(pole, east), pole],
            quadric: Quadric {
                m: q.m,
                b: q.half_slope(origin),
                c: q.at(origin),
            },
            fillet: false,
        }
    }

    /// The direction of a longitude on the equator.
    #[inline]
    pub fn meridian(&self, phi: f64) -> Vec3 {
        let (s, c) = phi.sin_cos();
        add(scale(self.axes[0], c), scale(self.axes[1], s))
    }

    fn longitude(&self, x: Vec3) -> f64 {
        let d = sub(x, self.origin);
        dot(d, self.axes[1]).atan2(dot(d, self.axes[0]))
    }

    /// Where on a part of a seam the half plane of a longitude meets it: the place, and the cosine of its angle.
    #[inline]
    pub fn meet(&self, complex: &Complex, part: &Part, meridian: Vec3) -> (Vec3, f64) {
        let conic = &complex.arcs[part.arc as usize].conic;
        let across = cross(self.axes[2], meridian);
        let d = sub(conic.v, self.origin);
        let f = [
            dot(across, d),
            dot(across, conic.e[0]),
            dot(across, conic.e[1]),
        ];
        // c₀ cos² + c₁ sin cos + c₂ sin² = 0, as in `Conic::roots`.
        let m = &conic.m;
        let c = [
            f[0] * m[0],
            2.0 * f[0] * m[1] - conic.q * f[1],
            f[0] * m[2] - conic.q * f[2],
        ];
        let root = (c[1] * c[1] - 4.0 * c[0] * c[2]).max(0.0).sqrt();
        let q = -(c[1] + root.copysign(c[1])) / 2.0;
        let [least, most] = part.cosines;
        let mut best = (f64::INFINITY, 0.0, 1.0);
        for [s, c] in [[q, c[2]], [c[0], q]] {
            let length = (s * s + c * c).sqrt().copysign(s);
            let (s, c) = (s / length, c / length);
            // The start of an arc is at 0 and at half a turn.
            let (s, c) = if s < 1e-14 && most == 1.0 {
                (0.0, 1.0)
            } else {
                (s, c)
            };
            let mut off = (c - most).max(least - c).max(0.0);
            let f = -conic.q * s / (m[0] * c * c + 2.0 * m[1] * s * c + m[2] * s * s);
            let x = add(d, add(scale(conic.e[0], f * c), scale(conic.e[1], f * s)));
            if dot(meridian, x) < 0.0 {
                off += 4.0;
            }
            if off < best.0 {
                best = (off, s, c);
            }
        }
        let (_, mut s, mut c) = best;
        // Half planes that just miss it, by rounding or at merged vertices, meet its end.
        if c > most || c < least || best.0 > 1.0 {
            c = if (c - most).abs() < (c - least).abs() {
                most
            } else {
                least
            };
            s = (1.0 - c * c).max(0.0).sqrt();
        }
        let f = -conic.q * s / (m[0] * c * c + 2.0 * m[1] * s * c + m[2] * s * s);
        let x = add(
            conic.v,
            add(scale(conic.e[0], f * c), scale(conic.e[1], f * s)),
        );
        (x, c)
    }

    /// The latitude at which a half plane meets a border.
    #[inline]
    pub fn latitude(&self, complex: &Complex, border: &Border, meridian: Vec3) -> f64 {
        match border {
            Border::Pole(psi) => *psi,
            Border::Seam(part) => {
                let x = sub(self.meet(complex, part, meridian).0, self.origin);
                dot(x, self.axes[2]).atan2(dot(x, meridian))
            }
        }
    }
}

/// The seams of a stub by longitude about its axis: where each begins and ends, the part, and −1 where it turns back.
pub(super) fn girdle(
    complex: &Complex,
    face: &Face,
    axis: Vec3,
) -> (Frame, Vec<(Band, Part, f64)>) {
    let east = if axis[0].abs() < 0.6 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let frame = Frame::new(face, [0.0; 3], east, axis);
    let band = |p: Piece| {
        let band = Band {
            along: p.longitudes,
            touch: p.touch,
            borders: [Border::Seam(p.part), Border::Pole(FRAC_PI_2)],
        };
        (band, p.part, if p.lower { 1.0 } else { -1.0 })
    };
    let all = pieces(complex, face, &frame)
        .0
        .into_iter()
        .map(band)
        .collect();
    (frame, all)
}

/// A piece of a seam over which the longitude grows or falls.
struct Piece {
    part: Part,
    longitudes: [f64; 2],
    touch: [bool; 2],
    /// Whether the face lies above.
    lower: bool,
}

/// The bands of a face that is neither a stub's nor the ball's; `None` if its seams do not bound it.
pub(super) fn bands(hub: &Hub, complex: &Complex, face: &Face) -> Option<(Frame, Vec<Band>)> {
    if face.label.count_ones() == 2
        && let Some(frame) = pair(hub, complex, face)
        && let Some(bands) = cut(complex, face, &frame)
    {
        return Some((frame, bands));
    }
    corner(complex, face)
        .into_iter()
        .find_map(|frame| cut(complex, face, &frame).map(|b| (frame, b)))
}

/// The frame of a fillet: about the line where both stubs' G vanish, if the ball holds its middle.
fn pair(hub: &Hub, complex: &Complex, face: &Face) -> Option<Frame> {
    let i = face.label.trailing_zeros() as usize;
    let j = 63 - face.label.leading_zeros() as usize;
    let (p, q) = (&hub.stubs[i], &hub.stubs[j]);
    let cos = dot(p.axis, q.axis);
    let across = sub(q.axis, scale(p.axis, cos));
    let sin = norm(across);
    if sin < 1e-6 {
        return None;
    }
    let across = scale(across, 1.0 / sin);
    let away = (q.contact - cos * p.contact) / sin;
    let origin = add(scale(p.axis, p.contact), scale(across, away));
    if norm(origin) > 0.999 * hub.radius {
        return None;
    }
    // Towards the middle of its seams with the stubs.
    let seam = |bit: u64| {
        face.loops.iter().flatten().find_map(|&(a, _)| {
            let a = &complex.arcs[a as usize];
            a.sides
                .contains(&bit)
                .then(|| a.conic.at(a.conic.end / 2.0))
        })
    };
    let pole = cross(p.axis, across);
    let flat = |x: Vec3| {
        let d = sub(x, origin);
        unit(sub(d, scale(pole, dot(d, pole))))
    };
    let east = match (seam(1 << i), seam(1 << j)) {
        (Some(a), Some(b)) => add(flat(a), flat(b)),
        _ => add(p.axis, q.axis),
    };
    Some(Frame {
        fillet: true,
        ..Frame::new(face, origin, east, pole)
    })
}

/// Frames for a corner, about the hub's centre: an axis across it, and one through it.
fn corner(complex: &Complex, face: &Face) -> Vec<Frame> {
    let arcs = || {
        face.loops
            .iter()
            .flatten()
            .map(|&(a, _)| &complex.arcs[a as usize].conic)
    };
    let places = || arcs().flat_map(|c| [0.0, 0.25, 0.5, 0.75, 1.0].map(|s| unit(c.at(s * c.end))));
    let m = middle(complex, face);
    let m = unit(m);
    let side = unit(cross(
        m,
        if m[0].abs() < 0.6 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        },
    ));
    let other = cross(m, side);
    // The direction in which it is narrowest.
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in places() {
        let (x, y) = (dot(p, side), dot(p, other));
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let wide = 0.5 * (2.0 * xy).atan2(xx - yy);
    let pole = sub(scale(other, wide.cos()), scale(side, wide.sin()));
    let highest = places().map(|p| dot(p, pole).abs()).fold(0.0, f64::max);
    let across = Frame::new(face, [0.0; 3], m, pole);
    let through = Frame::new(face, [0.0; 3], side, m);
    if highest < 0.97 {
        vec![across, through]
    } else {
        vec![through, across]
    }
}

/// Pieces of a face's seams between the places where half planes touch them.
fn pieces(complex: &Complex, face: &Face, frame: &Frame) -> (Vec<Piece>, Vec<f64>) {
    let (mut out, mut stops) = (Vec::new(), Vec::new());
    let (o, e) = (frame.origin, frame.axes[2]);
    let q = &face.quadric;
    for &(number, forward) in face.loops.iter().flatten() {
        let arc = &complex.arcs[number as usize];
        let conic = &arc.conic;
        if frame.fillet && arc.sides.iter().any(|s| s.count_ones() == 1) {
            // Half planes all along.
            stops.push(frame.longitude(conic.at(conic.end / 2.0)));
            continue;
        }
        // Tangents from where the axis meets the seam's plane touch it on the polar of that place.
        let weight = dot(arc.plane.a, e);
        let place = sub(scale(o, weight), scale(e, arc.plane.at(o)));
        let polar = [
            dot(place, q.half_slope(conic.v)) + weight * (dot(q.b, conic.v) + q.c),
            q.form(place, conic.e[0]) + weight * dot(q.b, conic.e[0]),
            q.form(place, conic.e[1]) + weight * dot(q.b, conic.e[1]),
        ];
        let mut cuts = vec![(0.0, false)];
        cuts.extend(
            conic
                .roots(polar, false)
                .filter(|t| *t > 1e-9 && *t < conic.end - 1e-9)
                .map(|t| (t, true)),
        );
        cuts.push((conic.end, false));
        for w in cuts.windows(2) {
            let ((a, soft_a), (b, soft_b)) = (w[0], w[1]);
            // Followed in steps of less than half a turn.
            let first = frame.longitude(conic.at(a));
            let mut last = first;
            for k in 1..=8 {
                let next = frame.longitude(conic.at(a + (b - a) * f64::from(k) / 8.0));
                let d = next - last;
                last += d - TAU * (d / TAU).round();
            }
            let up = last > first;
            let piece = Piece {
                part: Part::new(number, if up { [a, b] } else { [b, a] }),
                longitudes: [first.min(last), first.max(last)],
                touch: if up {
                    [soft_a, soft_b]
                } else {
                    [soft_b, soft_a]
                },
                lower: up == forward,
            };
            stops.extend([first, last]);
            out.push(piece);
        }
    }
    (out, stops)
}

fn cut(complex: &Complex, face: &Face, frame: &Frame) -> Option<Vec<Band>> {
    let (pieces, mut stops) = pieces(complex, face, frame);
    if stops.iter().any(|s| !s.is_finite()) {
        return None;
    }
    // Around the whole axis if a seam goes there, else between the outermost.
    let around = !frame.fillet
        && pieces
            .iter()
            .any(|p| p.longitudes[0] < -PI || p.longitudes[1] > PI);
    if around {
        stops
            .iter_mut()
            .for_each(|s| *s -= TAU * (*s / TAU).floor());
        stops.sort_by(f64::total_cmp);
        stops.push(stops[0] + TAU);
    } else {
        stops.sort_by(f64::total_cmp);
    }
    let mut events: Vec<f64> = Vec::with_capacity(stops.len());
    for s in stops {
        if events.last().is_none_or(|e| s - e > SAME) {
            events.push(s);
        }
    }
    let mut out = Vec::new();
    let mut crossed: Vec<(f64, &Piece, [bool; 2])> = Vec::new();
    for w in events.windows(2) {
        let along = [w[0], w[1]];
        let middle = (w[0] + w[1]) / 2.0;
        let meridian = frame.meridian(middle);
        crossed.clear();
        for p in &pieces {
            // How many turns on the piece is looked at; those that end at an event end there to within what is one.
            let turns = if around {
                ((middle - p.longitudes[0]) / TAU).floor() * TAU
            } else {
                0.0
            };
            let [from, to] = p.longitudes.map(|l| l + turns);
            if middle <= from || middle >= to {
                continue;
            }
            let psi = frame.latitude(complex, &Border::Seam(p.part), meridian);
            let soft = [
                p.touch[0] && (from - along[0]).abs() <= 2.0 * SAME,
                p.touch[1] && (to - along[1]).abs() <= 2.0 * SAME,
            ];
            crossed.push((psi, p, soft));
        }
        crossed.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Two seams that coincide may come in either order.
        for k in 1..crossed.len() {
            let want = crossed[0].1.lower == (k % 2 == 0);
            if crossed[k].1.lower != want
                && k + 1 < crossed.len()
                && crossed[k + 1].0 - crossed[k].0 < 1e-6
            {
                crossed.swap(k, k + 1);
            }
        }
        let border = |k: usize| (Border::Seam(crossed[k].1.part), crossed[k].2);
        let pole = |psi: f64| (Border::Pole(psi), [false; 2]);
        let mut ends = Vec::with_capacity(crossed.len() + 2);
        if crossed.first().is_some_and(|c| !c.1.lower) || crossed.is_empty() && frame.fillet {
            ends.push((false, pole(-FRAC_PI_2)));
        }
        ends.extend((0..crossed.len()).map(|k| (!crossed[k].1.lower, border(k))));
        if ends.len() % 2 == 1 {
            ends.push((true, pole(FRAC_PI_2)));
        }
        for pair in ends.chunks(2) {
            let [(upper, low), (above, high)] = [pair[0], pair[1]];
            if upper || !above {
                return None;
            }
            out.push(Band {
                along,
                touch: [low.1[0] || high.1[0], low.1[1] || high.1[1]],
                borders: [low.0, high.0],
            });
        }
    }
    Some(out)
}

impl Band {
    /// The longitude at u of 0 to 1, and its derivative: slow at ends where a half plane touches a border, so that what is
    /// like a root there is smooth.
    #[inline]
    pub fn longitude(&self, u: f64) -> (f64, f64) {
        let [a, b] = self.along;
        let (s, ds) = match self.touch {
            [false, false] => (u, 1.0),
            [true, false] => (u * u, 2.0 * u),
            [false, true] => (u * (2.0 - u), 2.0 - 2.0 * u),
            [true, true] => (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u)),
        };
        (a + (b - a) * s, (b - a) * ds)
    }
}

/// A place on a face, in the middle of its seams: on the ball the far side of a lone cap.
pub(super) fn middle(complex: &Complex, face: &Face) -> Vec3 {
    let (mut sum, mut arrow) = ([0.0; 3], [0.0; 3]);
    for &(arc, forward) in face.loops.iter().flatten() {
        let conic = &complex.arcs[arc as usize].conic;
        for &(t, w) in super::integral::gauss(4) {
            let (x, dx) = conic.with_slope(t * conic.end);
            let turn = w * conic.end * if forward { 1.0 } else { -1.0 };
            sum = add(sum, scale(unit(x), w * conic.end * norm(dx)));
            arrow = add(arrow, scale(cross(x, dx), turn));
        }
    }
    // On the ball seams may go round half the sphere or more: their area as a vector points to the face all the same.
    let p = if face.label == 0 && norm(arrow) > 1e-3 * norm(sum) || norm(sum) < 1e-9 {
        arrow
    } else {
        sum
    };
    let p = unit(p);
    let at = face.quadric.exit(p);
    scale(p, if at.is_finite() { at } else { 1.0 })
}
