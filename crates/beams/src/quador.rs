//! Lattices of quadors: hub balls joined by beams that are quadrics of revolution, and filleted by quadrics.
//!
//! Everything is made of pieces of quadrics that meet in planes, so a point is classified, a ray is cast and a slice is cut
//! in closed form. The mathematics follows Cirak and Sabin, *Adding quadric fillets to quador lattice structures* (2019).

use rayon::prelude::*;

use crate::graph::Graph;
use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Vec3, norm, scale, sub};

pub mod bezier;
mod classes;
pub mod closest;
pub mod collide;
pub mod complex;
pub mod drawn;
mod facets;
mod field;
mod foot;
pub mod hub;
mod index;
pub mod integral;
mod mesh;
pub mod patch;
pub mod pencil;
pub mod quadric;
pub mod query;
mod rule;
mod sheet;
pub mod slice;

use hub::{Affine, Hub, Stub};
use index::Index;
use pencil::Pencil;

/// How large the fillets are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fillet {
    /// Beams meet in creases.
    None,
    /// As large as each hub allows.
    Auto,
    /// By τ in [0, 1): nearly 1 is a small fillet.
    Tau(f64),
    /// By α in (0, ½]: growing α grows the fillet; τ = (1 − 4α²)/(1 + 4α²).
    Alpha(f64),
    /// By β = 1/(4α), from ½ on.
    Beta(f64),
    /// By the least radius wanted in the middle of a crotch, mm.
    Radius(f64),
}

impl Fillet {
    /// τ that is asked for of all pairs, if it is given.
    fn tau(self) -> Option<f64> {
        match self {
            Fillet::Tau(t) => Some(t),
            Fillet::Alpha(a) => Some((1.0 - 4.0 * a * a) / (1.0 + 4.0 * a * a)),
            Fillet::Beta(b) => Some((4.0 * b * b - 1.0) / (4.0 * b * b + 1.0)),
            _ => None,
        }
    }

    fn check(self) -> Result<(), Fault> {
        let refuse = |name: &str, v: f64, range: &str| {
            Err(Fault::new("fillet", format!("{name} {} makes no fillet: it must lie {range}", number(v))))
        };
        match self {
            Fillet::Tau(t) if !(0.0..1.0).contains(&t) => refuse("tau", t, "from 0 up to, not including, 1"),
            Fillet::Alpha(a) if !(a > 0.0 && a <= 0.5) => refuse("alpha", a, "above 0 and up to 0.5"),
            Fillet::Beta(b) if !(b >= 0.5 && b.is_finite()) => refuse("beta", b, "from 0.5 on"),
            Fillet::Radius(r) if !(r > 0.0 && r.is_finite()) => refuse("a radius of", r, "above zero, mm"),
            _ => Ok(()),
        }
    }
}

/// Greatest t² that fillets are given: beyond it a fillet is a crease to any eye and any file.
const TAU_MOST: f64 = 0.999;
/// How far towards the split plane, from the contact plane, fillets may reach.
const REACH: f64 = 0.95;

/// A ball with its place in the list of stubs.
#[derive(Clone, Debug)]
struct Ball {
    center: Vec3,
    radius: f64,
    first: usize,
    last: usize,
    /// Bounds of its part with stubs up to their cuts, in space.
    bounds: Aabb,
    /// Bound of half the second derivative of N.
    bend: f64,
}

/// What a hub could not be given.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortfall {
    /// The hub.
    pub hub: usize,
    /// The fillet's radius in the tightest crotch that was achieved, mm (zero in creases).
    pub radius: f64,
    /// The greatest τ of its pairs.
    pub tau: f64,
}

/// Two beams of a hub that still overlap where the first is parted from its other hub: closed forms do not hold there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The hub.
    pub hub: usize,
    /// The beams.
    pub beams: [u32; 2],
}

/// A lattice of quadors.
#[derive(Clone, Debug)]
pub struct Quadors {
    balls: Vec<Ball>,
    stubs: Vec<Stub>,
    pencils: Vec<Pencil>,
    ends: Vec<[u32; 2]>,
    sharp: bool,
    /// The radius by which squares are made lengths, mm.
    scale: f64,
    /// Values above this are not told apart, mm.
    cap: f64,
    index: Index,
    shortfalls: Vec<Shortfall>,
    overlaps: Vec<Overlap>,
}

impl Quadors {
    /// Builds the beams of a graph and joins them.
    ///
    /// # Errors
    /// What is wrong with a hub, a beam or the fillet, by its place in the graph: `beams[3].profile`.
    pub fn new(graph: &Graph, fillet: Fillet) -> Result<Quadors, Fault> {
        fillet.check()?;
        if graph.hubs.is_empty() {
            return Err(Fault::new("", "a graph without hubs has no solid: give at least one"));
        }
        for (i, h) in graph.hubs.iter().enumerate() {
            if !h.center.iter().all(|v| v.is_finite()) {
                return Err(Fault::new(
                    format!("hubs[{i}]"),
                    "its centre is not a position: give three finite numbers, mm",
                ));
            }
            if !(h.radius > 0.0 && h.radius.is_finite()) {
                return Err(Fault::new(
                    format!("hubs[{i}]"),
                    format!("a hub of radius {} mm is no ball: give a finite number above zero", number(h.radius)),
                ));
            }
        }
        let pencils: Vec<Pencil> = graph
            .beams
            .par_iter()
            .enumerate()
            .map(|(i, b)| {
                let at = || format!("beams[{i}]");
                let [a, z] = b.ends.map(|e| graph.hubs.get(e as usize));
                let (Some(a), Some(z)) = (a, z) else {
                    return Err(Fault::new(
                        at(),
                        format!(
                            "it names hub {}, there are {}, numbered from 0",
                            b.ends[0].max(b.ends[1]),
                            counted(graph.hubs.len(), "hub")
                        ),
                    ));
                };
                Pencil::new(norm(sub(z.center, a.center)), [a.radius, z.radius], b.profile).map_err(|f| f.under(&at()))
            })
            .collect::<Result<_, _>>()?;
        let ends: Vec<[u32; 2]> = graph.beams.iter().map(|b| b.ends).collect();
        let (mut firsts, stubs) = stubs(graph, &pencils);
        let mut out = Quadors {
            balls: Vec::new(),
            scale: typical(pencils.iter().map(|p| p.squared(p.length / 2.0).max(0.0).sqrt()))
                .unwrap_or_else(|| typical(graph.hubs.iter().map(|h| h.radius)).unwrap_or(1.0)),
            cap: 0.0,
            sharp: fillet == Fillet::None,
            stubs,
            pencils,
            ends,
            index: Index::default(),
            shortfalls: Vec::new(),
            overlaps: Vec::new(),
        };
        out.cap = match typical(out.pencils.iter().map(|p| p.length)) {
            Some(l) => (l / 4.0).max(out.scale),
            None => 2.0 * out.scale,
        };
        firsts.push(out.stubs.len());
        let mut rest = &mut out.stubs[..];
        let mut of = Vec::with_capacity(graph.hubs.len());
        for w in firsts.windows(2) {
            let (here, after) = rest.split_at_mut(w[1] - w[0]);
            rest = after;
            of.push(here);
        }
        let sharp = out.sharp;
        let made: Vec<(Ball, Option<Shortfall>, Vec<Overlap>)> = of
            .into_par_iter()
            .enumerate()
            .map(|(i, stubs)| {
                let h = &graph.hubs[i];
                let (shortfall, overlaps) = round(i, h.radius, stubs, fillet);
                let hub = Hub { radius: h.radius, stubs, sharp };
                let local = hub.bounds();
                let bounds = Aabb {
                    min: geometry::math::add(h.center, local.min),
                    max: geometry::math::add(h.center, local.max),
                };
                let (first, last) = (firsts[i], firsts[i + 1]);
                (
                    Ball { center: h.center, radius: h.radius, first, last, bounds, bend: hub.bend() },
                    shortfall,
                    overlaps,
                )
            })
            .collect();
        for (ball, shortfall, overlaps) in made {
            out.balls.push(ball);
            out.shortfalls.extend(shortfall);
            out.overlaps.extend(overlaps);
        }
        out.index = Index::new(out.balls.iter().map(|b| b.bounds.grown(out.cap)));
        Ok(out)
    }

    /// Number of hubs.
    pub fn len(&self) -> usize {
        self.balls.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.balls.is_empty()
    }

    /// A hub, in its own frame.
    pub fn hub(&self, i: usize) -> Hub<'_> {
        let b = &self.balls[i];
        Hub { radius: b.radius, stubs: &self.stubs[b.first..b.last], sharp: self.sharp }
    }

    /// A hub's centre, mm.
    pub fn center(&self, i: usize) -> Vec3 {
        self.balls[i].center
    }

    /// Number of beams.
    pub fn beams(&self) -> usize {
        self.ends.len()
    }

    /// The quadric of a beam.
    pub fn pencil(&self, beam: usize) -> &Pencil {
        &self.pencils[beam]
    }

    /// Hubs whose fillets are smaller than asked for.
    pub fn shortfalls(&self) -> &[Shortfall] {
        &self.shortfalls
    }

    /// Beams that overlap too far for closed forms.
    pub fn overlaps(&self) -> &[Overlap] {
        &self.overlaps
    }

    /// Bounds of the solid, mm.
    pub fn bounds(&self) -> Aabb {
        self.balls.iter().fold(Aabb::EMPTY, |b, ball| b.union(ball.bounds))
    }

    /// The fillets' radius in the tightest crotch of a hub, mm: zero in creases, infinite where nothing is hollow.
    pub fn fillet_radius(&self, hub: usize) -> f64 {
        tightest(&self.hub(hub))
    }

    /// # Errors
    /// The first overlap, as what forbids an exact answer.
    fn exact(&self) -> Result<(), Fault> {
        match self.overlaps.first() {
            None => Ok(()),
            Some(o) => Err(Fault::new(
                format!("hubs[{}]", o.hub),
                format!(
                    "beams {} and {} leave it so close together that they still overlap halfway along ({} in all): there is no closed \
                 form for that; make them thinner, merge them, or use the field",
                    o.beams[0],
                    o.beams[1],
                    counted(self.overlaps.len(), "such pair")
                ),
            )),
        }
    }
}

/// The middle one of some lengths.
fn typical(lengths: impl Iterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = lengths.filter(|v| *v > 0.0).collect();
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The stubs of all hubs, hub by hub and beam by beam, and where each hub's begin.
fn stubs(graph: &Graph, pencils: &[Pencil]) -> (Vec<usize>, Vec<Stub>) {
    let mut firsts = vec![0usize; graph.hubs.len() + 1];
    for e in graph.beams.iter().flat_map(|b| b.ends) {
        firsts[e as usize + 1] += 1;
    }
    for i in 1..firsts.len() {
        firsts[i] += firsts[i - 1];
    }
    let mut order = vec![(0u32, 0usize); 2 * graph.beams.len()];
    let mut next = firsts.clone();
    for (i, b) in graph.beams.iter().enumerate() {
        for end in 0..2 {
            let slot = &mut next[b.ends[end] as usize];
            order[*slot] = (i as u32, end);
            *slot += 1;
        }
    }
    firsts.pop();
    let stubs = order
        .into_iter()
        .map(|(beam, end)| {
            let (p, ends) = (&pencils[beam as usize], graph.beams[beam as usize].ends);
            // The axis is computed once for both ends, so that they are opposite to the bit.
            let along = sub(graph.hubs[ends[1] as usize].center, graph.hubs[ends[0] as usize].center);
            let toward = if end == 0 { 1.0 } else { -1.0 };
            let axis = scale(along, toward / p.length);
            let steep = p.lambda.sqrt();
            let contact = p.contact(end);
            let split = if end == 0 { p.split() } else { p.length - p.split() };
            // Followed halfway on to where the other ball takes over.
            let cut = (split + p.length - p.contact(1 - end)) / 2.0;
            Stub {
                beam,
                end,
                axis,
                g: Affine { a: scale(axis, steep), b: -steep * contact },
                contact,
                section: p.section(end),
                split,
                cut: cut.max(split),
                share: 0.0,
                weight: 1.0,
            }
        })
        .collect();
    (firsts, stubs)
}

/// Gives the stubs of a hub their t.
///
/// Reach asks t_i t_j ≥ the least τ of each pair. `t_i = √(max_j τ_ij)` always does; what slack that leaves is taken up by all
/// stubs alike, half of the least slack of each at a time, so that the order of beams does not matter.
fn round(index: usize, radius: f64, stubs: &mut [Stub], fillet: Fillet) -> (Option<Shortfall>, Vec<Overlap>) {
    let n = stubs.len();
    let hub = Hub { radius, stubs, sharp: fillet == Fillet::None };
    let mut least = vec![0.0f64; n * n];
    let mut overlaps = Vec::new();
    for i in 0..n {
        for j in 0..n {
            if i == j {
                continue;
            }
            let s = &hub.stubs[i];
            let early = hub.least_tau(i, j, s.contact + REACH * (s.split - s.contact));
            let tau = if early < TAU_MOST { early } else { hub.least_tau(i, j, s.split).max(TAU_MOST) };
            if tau >= 1.0 || s.split <= s.contact {
                overlaps.push(Overlap { hub: index, beams: [s.beam, hub.stubs[j].beam] });
            }
            let tau = if tau.is_nan() { 1.0 } else { tau.clamp(0.0, TAU_MOST) };
            least[i * n + j] = least[i * n + j].max(tau);
            least[j * n + i] = least[j * n + i].max(tau);
        }
    }
    if fillet == Fillet::None {
        stubs.iter_mut().for_each(|s| s.share = 1.0);
        return (None, overlaps);
    }
    let mut t: Vec<f64> = (0..n).map(|i| (0..n).map(|j| least[i * n + j]).fold(0.0, f64::max).sqrt()).collect();
    for _ in 0..8 {
        let slack: Vec<f64> = (0..n)
            .map(|i| {
                let each = (0..n).filter(|&j| j != i && least[i * n + j] > 0.0);
                each.map(|j| least[i * n + j] / (t[i] * t[j])).fold(0.0, f64::max)
            })
            .collect();
        for i in 0..n {
            t[i] *= if slack[i] > 0.0 { slack[i].sqrt() } else { 0.0 };
        }
    }
    let wanted = match fillet {
        Fillet::Radius(r) => {
            let pairs = hub.neighbours();
            pairs.iter().map(|&(i, j)| tau_of(&hub, i, j, r)).fold(TAU_MOST, f64::min)
        }
        _ => fillet.tau().unwrap_or(0.0),
    };
    let short = fillet != Fillet::Auto && t.iter().any(|t| t * t > wanted * (1.0 + 1e-12) + 1e-15);
    for (s, t) in stubs.iter_mut().zip(&t) {
        s.set_share(t.max(wanted.min(TAU_MOST).sqrt()));
    }
    let hub = Hub { radius, stubs, sharp: false };
    let shortfall = short.then(|| {
        let shares = || stubs.iter().map(|s| s.share);
        let most = shares().fold(0.0, f64::max);
        Shortfall { hub: index, radius: tightest(&hub), tau: most * most }
    });
    let shortfall = match fillet {
        // A slack elsewhere in the hub may have left every crotch as wide as asked.
        Fillet::Radius(r) => shortfall.filter(|s| s.radius < r * (1.0 - 1e-9)),
        _ => shortfall,
    };
    (shortfall, overlaps)
}

/// τ for which the crotch of two stubs has the radius r; the radius falls as τ grows.
fn tau_of(hub: &Hub, i: usize, j: usize, r: f64) -> f64 {
    let at = |tau: f64| hub.crotch(i, j, tau).map_or(f64::INFINITY, |c| c.1);
    let (mut lo, mut hi) = (0.0, TAU_MOST);
    if at(hi) >= r {
        return hi;
    }
    for _ in 0..48 {
        let mid = (lo + hi) / 2.0;
        if at(mid) >= r { lo = mid } else { hi = mid }
    }
    lo
}

/// The radius in the tightest crotch of a hub.
fn tightest(hub: &Hub) -> f64 {
    if hub.sharp {
        return if hub.neighbours().is_empty() { f64::INFINITY } else { 0.0 };
    }
    let of = |(i, j): (usize, usize)| {
        let tau = hub.stubs[i].share * hub.stubs[j].share;
        hub.crotch(i, j, tau).map_or(f64::INFINITY, |c| c.1)
    };
    hub.neighbours().into_iter().map(of).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests;
