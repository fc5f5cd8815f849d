//! The grid that carries the wanted gradients between its nodes.
//!
//! The solution knows a target K at nodes alone and takes it to be linear between them. Whether it is does not depend on where the
//! nodes are: at a point p, for a spacing h along an axis e, what a grid misses is |K(p) − (K(p − e h/2) + K(p + e h/2))/2| / |K|,
//! h² |K″| / 8 where K is smooth. It is taken at points throughout the region, and for a spacing of 0.618 h as well, so that no period of
//! K can hide from it: the nodes' own shows at the second.

use super::frame::Orientation;
use super::phase_grid::PhaseGrid;
use super::phase_request::PhaseRequest;
use super::phase_target::wavelengths;
use super::spline;
use crate::field::Field;
use crate::grade::Grade;
use geometry::fault::{Fault, number, position};
use geometry::math::{Aabb, IDENTITY, Mat3, Vec3, add, dot, norm, scale, sub};
use geometry::progress::checkpoint;
use geometry::random::low_discrepancy;

/// Most nodes of a grid that is chosen, and of one that the design requests.
const NODES: [f64; 2] = [2.2e6, 4e7];
/// Nodes on a wavelength.
const FINE: f64 = 4.0;
/// The greatest ratio of wavelengths at adjacent nodes.
const ABRUPT: f64 = 1.5;
/// Points at which is found what a grid misses, and most positions that are tried for them.
const POINTS: [usize; 2] = [2000, 40_000];
/// What a grid misses of a target (three degrees, or 5 % of a wavelength) and at what share of the points, beyond which it is made
/// finer.
const MISSED: [f64; 2] = [0.05, 0.05];
/// The same (eleven degrees) beyond which a map has little to do with the target.
const FALSE: [f64; 2] = [0.2, 0.1];
/// Halvings of a step that are tried.
const HALVINGS: usize = 6;

/// The grid, and what it misses.
pub(super) struct ChosenGrid {
    pub grid: PhaseGrid,
    /// A target that varies faster than cells of this size can, in words.
    pub undersampled: Option<String>,
    /// A target that has little to do with what the nodes see.
    lost: Option<Fault>,
}

/// The grid that resolves the least wavelength and what varies, or has the requested spacing `step` (mm).
pub(super) fn choose(
    bounds: &Aabb,
    wanted: &PhaseRequest,
    step: Option<f64>,
    region: Option<&dyn Field>,
) -> Result<ChosenGrid, Fault> {
    let first = start(bounds, wanted, step)?;
    let Some(probe) = Probe::new(bounds, wanted, region)? else {
        return Ok(ChosenGrid { grid: first, undersampled: None, lost: None });
    };
    let missed = probe.missed(first.step)?;
    if !missed.iter().any(SamplingError::much) {
        return Ok(ChosenGrid { grid: first, undersampled: None, lost: None });
    }
    let (grid, left) = probe.refined(bounds, first, missed)?;
    // In words: of the axis along which most is missed.
    let axis = (0..3).fold(0, |m, a| if missed[a].share > missed[m].share { a } else { m });
    let what = missed[axis].description(first.step[axis]);
    let enough = grid.step.into_iter().fold(f64::INFINITY, f64::min);
    let enough = rounded_down(enough);
    let fits = count(bounds.size().map(|s| nodes_along(s, enough))) <= NODES[1];
    let of = &wanted.orientation;
    let slower = match of {
        Orientation::Angles(_) => "let it vary more slowly",
        _ if wanted.averaged().is_some() || missed[axis].key != of.key() => "let it vary more slowly",
        _ => "smooth it over about a wavelength (smooth, in mm), or let it vary more slowly",
    };
    let remedy = match (left.iter().any(SamplingError::much), step) {
        (false, _) if fits => format!("{slower}, or give step = {}", number(enough)),
        (false, Some(_)) => format!("{slower}, or leave step out"),
        _ => slower.to_string(),
    };
    let lost = |missed: &[SamplingError; 3]| {
        let wrong = missed.iter().any(|m| m.lost > FALSE[1]);
        let message = format!("{what}: the grid does not see how it varies; {remedy}");
        wrong.then(|| Fault::new(missed[axis].key, message))
    };
    if step.is_some() {
        let undersampled = format!("{what}: between its nodes the map follows the target roughly; {remedy}");
        return Ok(ChosenGrid { grid: first, undersampled: Some(undersampled), lost: lost(&missed) });
    }
    let [x, y, z] = grid.step.map(|h| number((h * 1e4).round() / 1e4));
    let undersampled = format!(
        "{what}; the phases are solved with steps of {x}, {y} and {z} mm, but cells can hardly follow what varies within them: let it \
         vary more slowly, or use smaller cells"
    );
    Ok(ChosenGrid { grid, undersampled: Some(undersampled), lost: lost(&left) })
}

impl ChosenGrid {
    /// Refuses a target that has little to do with what the nodes see.
    pub fn refuse(&self) -> Result<(), Fault> {
        self.lost.clone().map_or(Ok(()), Err)
    }
}

/// The grid that resolves the least wavelength, or has the requested spacing `step` (mm).
fn start(bounds: &Aabb, wanted: &PhaseRequest, step: Option<f64>) -> Result<PhaseGrid, Fault> {
    let size = bounds.size();
    let coarse: Vec<Vec3> = {
        let g = PhaseGrid::over(bounds, [13; 3]);
        (0..g.len()).map(|n| g.node(n)).collect()
    };
    let all = wavelengths(&wanted.wavelength, &coarse)?;
    let least = all.iter().flatten().fold(f64::INFINITY, |m: f64, w| m.min(*w));
    let shape = |h: f64| size.map(|s| nodes_along(s, h));
    match step {
        Some(h) => {
            if !(h > 0.0 && h.is_finite()) {
                return Err(Fault::new(
                    "step",
                    format!("{} mm; the spacing of the grid is a positive, finite length", number(h)),
                ));
            }
            let rough = size.iter().map(|s| s / h).product::<f64>();
            if rough > NODES[1] || count(shape(h)) > NODES[1] {
                let enough = (size.iter().product::<f64>() / NODES[1]).cbrt();
                return Err(Fault::new(
                    "step",
                    format!(
                        "{} mm makes a grid of {rough:.1e} nodes; at most {:.0e} are possible: use a step above {enough:.3} mm, or leave it out",
                        number(h),
                        NODES[1]
                    ),
                ));
            }
            Ok(PhaseGrid::over(bounds, shape(h)))
        }
        None => {
            let mut h = (least / FINE).max((size.iter().product::<f64>() / NODES[0]).cbrt());
            while count(shape(h)) > 1.3 * NODES[0] {
                h *= 1.05;
            }
            Ok(PhaseGrid::over(bounds, shape(h)))
        }
    }
}

/// The number of nodes along a side of length `s` (mm) that are at most `h` apart.
fn nodes_along(s: f64, h: f64) -> usize {
    PhaseGrid::fft_friendly(((s / h - 1e-6).ceil().max(0.0) as usize + 1).max(spline::LEAST))
}

fn count(shape: [usize; 3]) -> f64 {
    shape.map(|n| n as f64).iter().product()
}

/// To two digits, so that a step that is named is as fine as the one that was found.
fn rounded_down(v: f64) -> f64 {
    let unit = 10f64.powf(v.log10().floor() - 1.0);
    ((v / unit * (1.0 + 1e-9)).floor() * unit * 1e12).round() / 1e12
}

/// What a step along an axis misses.
#[derive(Clone, Copy)]
struct SamplingError {
    /// The share of the points at which it is more than `MISSED`, and more than `FALSE`.
    share: f64,
    lost: f64,
    /// Where it is most: the place, and the distance from there at which the target differs, mm.
    at: Vec3,
    within: f64,
    key: &'static str,
    /// The greatest angle (degrees) between the targets there, and the wavelengths whose ratio is greatest.
    turn: f64,
    lengths: [f64; 2],
}

impl SamplingError {
    fn much(&self) -> bool {
        self.share > MISSED[1]
    }

    /// What varies, how much, how fast and where.
    fn description(&self, step: f64) -> String {
        let (half, place) = (number((self.within * 1000.0).round() / 1000.0), position(self.at));
        let step = number((step * 1000.0).round() / 1000.0);
        let what = if self.key == "wavelength" {
            let [a, b] = self.lengths.map(|v| number((v * 1000.0).round() / 1000.0));
            format!("the wavelength goes from {a} to {b} mm")
        } else {
            format!("the orientation turns by {:.0} degrees", self.turn)
        };
        format!("{what} within {half} mm at {place}, and nodes of the phase grid are {step} mm apart")
    }
}

/// The golden section: no fraction is further from simple ones.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The target at points throughout the region.
struct Probe<'a> {
    wanted: &'a PhaseRequest,
    bounds: Aabb,
    points: Vec<Vec3>,
    /// The greatest difference of two principal values of a stress.
    range: f64,
}

impl<'a> Probe<'a> {
    /// `None` where the target does not vary.
    fn new(bounds: &Aabb, wanted: &'a PhaseRequest, region: Option<&dyn Field>) -> Result<Option<Probe<'a>>, Fault> {
        if wanted.orientation.is_constant() && wanted.wavelength.iter().all(|g| g.constant().is_some()) {
            return Ok(None);
        }
        let mut points: Vec<Vec3> = (0..POINTS[1]).map(|i| bounds.at(low_discrepancy(i + 1))).collect();
        if let Some(region) = region {
            let mut depth = vec![0.0; points.len()];
            region.values(&points, &mut depth);
            let mut depth = depth.into_iter();
            points.retain(|_| depth.next().is_some_and(|d| d <= 0.0));
        }
        points.truncate(POINTS[0]);
        let range = wanted.orientation.stress_range(&points)?;
        Ok((!points.is_empty()).then_some(Probe { wanted, bounds: *bounds, points, range }))
    }

    /// The wavelengths and the frames at points; of frames that are alike, those nearest to `like`.
    fn target(&self, points: &[Vec3], like: &[Mat3]) -> Result<Vec<(Vec3, Mat3)>, Fault> {
        // What is smoothed varies no faster than the grid can carry.
        let frames = match self.wanted.averaged() {
            Some(_) => like.to_vec(),
            None => self.wanted.orientation.frames_near(points, like, self.range)?,
        };
        Ok(wavelengths(&self.wanted.wavelength, points)?.into_iter().zip(frames).collect())
    }

    /// What each axis' step of a grid misses.
    fn missed(&self, step: Vec3) -> Result<[SamplingError; 3], Fault> {
        Ok([self.missed_along(0, step[0])?, self.missed_along(1, step[1])?, self.missed_along(2, step[2])?])
    }

    /// What is missed within half a step, and within a part of it: what has the period of the nodes, or half of it, shows there only.
    fn missed_along(&self, axis: usize, step: f64) -> Result<SamplingError, Fault> {
        let half = 0.5 * step.min(self.bounds.size()[axis]);
        let [whole, part] = [self.missed_within(axis, half)?, self.missed_within(axis, GOLDEN * half)?];
        let lost = whole.lost.max(part.lost);
        Ok(SamplingError { lost, ..if whole.much() || whole.share >= part.share { whole } else { part } })
    }

    fn missed_within(&self, axis: usize, half: f64) -> Result<SamplingError, Fault> {
        // Both ends of the step lie in the box.
        let (low, high) = (self.bounds.min[axis] + half, self.bounds.max[axis] - half);
        let moved = |p: &Vec3, by: f64| {
            let mut p = *p;
            p[axis] = p[axis].min(high).max(low) + by;
            p
        };
        let of = |by: f64| self.points.iter().map(|p| moved(p, by)).collect::<Vec<Vec3>>();
        let middle = of(0.0);
        let here = self.target(&middle, &vec![IDENTITY; middle.len()])?;
        let like: Vec<Mat3> = here.iter().map(|h| h.1).collect();
        let [before, after] = [self.target(&of(-half), &like)?, self.target(&of(half), &like)?];
        let mut found = SamplingError {
            share: 0.0,
            lost: 0.0,
            at: middle[0],
            within: half,
            key: "rotate",
            turn: 0.0,
            lengths: [1.0; 2],
        };
        let mut most = 0.0;
        let each = 1.0 / middle.len() as f64;
        for (n, ((h, b), a)) in here.iter().zip(&before).zip(&after).enumerate() {
            let column = |t: &(Vec3, Mat3), i: usize| [t.1[0][i], t.1[1][i], t.1[2][i]];
            let k = |t: &(Vec3, Mat3), i: usize| scale(column(t, i), 1.0 / t.0[i]);
            let off = |i: usize| norm(sub(k(h, i), scale(add(k(b, i), k(a, i)), 0.5))) * h.0[i];
            let off = (0..3).map(off).fold(0.0, f64::max);
            found.share += if off > MISSED[0] { each } else { 0.0 };
            found.lost += if off > FALSE[0] { each } else { 0.0 };
            if off > most {
                most = off;
                let angle = |t: &(Vec3, Mat3), i: usize| dot(column(h, i), column(t, i)).clamp(-1.0, 1.0).acos();
                let turn = (0..6).map(|i| angle(if i < 3 { b } else { a }, i % 3)).fold(0.0, f64::max);
                let ratio = |l: [f64; 2]| l[0].max(l[1]) / l[0].min(l[1]);
                let pair = |i: usize| [h.0[i % 3], if i < 3 { b.0[i % 3] } else { a.0[i % 3] }];
                let lengths = (0..6).map(pair).fold([1.0; 2], |m, l| if ratio(l) > ratio(m) { l } else { m });
                let key = if ratio(lengths) - 1.0 > turn { "wavelength" } else { self.wanted.orientation.key() };
                found = SamplingError { at: middle[n], key, turn: turn.to_degrees(), lengths, ..found };
            }
        }
        Ok(found)
    }

    /// The grid with steps halved along the axes along which much is missed, if as many nodes are possible, and what is missed then.
    fn refined(
        &self,
        bounds: &Aabb,
        first: PhaseGrid,
        missed: [SamplingError; 3],
    ) -> Result<(PhaseGrid, [SamplingError; 3]), Fault> {
        let (mut grid, mut missed) = (first, missed);
        let mut halvings = [0; 3];
        loop {
            checkpoint();
            let open = (0..3).filter(|a| missed[*a].much() && halvings[*a] < HALVINGS);
            let Some(axis) = open.reduce(|m, a| if missed[a].share > missed[m].share { a } else { m }) else {
                return Ok((grid, missed));
            };
            let mut shape = grid.shape;
            shape[axis] = 2 * (shape[axis] - 1) + 1;
            if count(shape) > NODES[0].max(count(first.shape)) {
                return Ok((grid, missed));
            }
            grid = PhaseGrid::over(bounds, shape);
            missed[axis] = self.missed_along(axis, grid.step[axis])?;
            halvings[axis] += 1;
        }
    }
}

/// A region that is thinner than the grid resolves, `deepest` (mm) below its surface at most, in words.
pub(super) fn thin(grid: &PhaseGrid, deepest: f64) -> Option<String> {
    let (thick, step) = (2.0 * deepest, grid.step.into_iter().fold(0.0, f64::max));
    let size: Vec3 = core::array::from_fn(|a| grid.step[a] * (grid.shape[a] - 1) as f64);
    // A side of the bounds has some nodes however short it is: a plate along the axes is resolved.
    if thick >= step || size.iter().any(|s| *s <= 2.0 * thick) {
        return None;
    }
    let remedy = match rounded_down(0.5 * thick) {
        finer if thick > 0.0 && count(size.map(|s| nodes_along(s, finer))) <= NODES[1] => {
            format!("give step = {}, or a thicker region", number(finer))
        }
        _ => "use a thicker region".to_string(),
    };
    let [thick, step] = [thick, step].map(|v| number((v * 1000.0).round() / 1000.0));
    Some(format!(
        "the region is nowhere thicker than about {thick} mm, and nodes of the phase grid are {step} mm apart: the map follows its target \
         roughly, and its figures are those of few points; {remedy}"
    ))
}

/// Whether a wavelength that changes abruptly between two points still does within a four-thousandth of the way: no step carries that.
fn jumps(of: &Grade, [mut a, mut b]: [Vec3; 2]) -> bool {
    const BISECTIONS: usize = 12;
    let ratio = |v: f64, w: f64| v.max(w) / v.min(w);
    for _ in 0..BISECTIONS {
        let middle = scale(add(a, b), 0.5);
        let mut found = [0.0; 3];
        of.values(&[a, middle, b], &mut found);
        if ratio(found[0], found[1]) >= ratio(found[1], found[2]) {
            b = middle;
        } else {
            a = middle;
        }
    }
    let mut ends = [0.0; 2];
    of.values(&[a, b], &mut ends);
    ratio(ends[0], ends[1]) > ABRUPT
}

/// Refuses wavelengths that jump between nodes, or whose variation the nodes do not resolve.
pub(super) fn check_pace(grid: &PhaseGrid, of: &[Grade; 3], at: &[Vec3], inside: &[bool]) -> Result<(), Fault> {
    if of.iter().all(|g| g.constant().is_some()) {
        return Ok(());
    }
    let refuse = |i: usize, [a, b]: [f64; 2], p: Vec3, [from, to]: [Vec3; 2]| {
        let [a, b, apart] = [a, b, norm(sub(to, from))].map(number);
        let message = if jumps(&of[i], [from, to]) {
            format!(
                "the wavelength jumps from {a} to {b} mm within {apart} mm at {}: faster than the grid can carry at any step; let it change \
                 over several cells",
                position(p)
            )
        } else {
            format!(
                "the wavelength goes from {a} to {b} mm within {apart} mm at {}: faster than the grid can carry; let it change over several \
                 cells, or give a smaller step",
                position(p)
            )
        };
        Err(Fault::new("wavelength", message))
    };
    let strides = grid.strides();
    let mut middles = Vec::new();
    for n in (0..grid.len()).filter(|&n| inside[n]) {
        let index = grid.index(n);
        for a in (0..3).filter(|&a| index[a] + 1 < grid.shape[a]) {
            let m = n + strides[a];
            for i in 0..3 {
                let (v, w) = (at[n][i], at[m][i]);
                if inside[m] && v.max(w) > ABRUPT * v.min(w) {
                    return refuse(i, [v, w], grid.node(n), [n, m].map(|n| grid.node(n)));
                }
            }
        }
        if (0..3).all(|a| index[a] + 1 < grid.shape[a]) {
            middles.push(n);
        }
    }
    let points: Vec<Vec3> = middles.iter().map(|&n| add(grid.node(n), scale(grid.step, 0.5))).collect();
    let between = wavelengths(of, &points)?;
    for ((n, w), p) in middles.iter().zip(&between).zip(&points) {
        let far = n + strides.iter().sum::<usize>();
        for i in 0..3 {
            let (lo, hi) = (at[*n][i].min(at[far][i]), at[*n][i].max(at[far][i]));
            if inside[far] && (w[i] > ABRUPT * hi || w[i] < lo / ABRUPT) {
                return refuse(i, [at[*n][i], w[i]], *p, [grid.node(*n), *p]);
            }
        }
    }
    Ok(())
}
