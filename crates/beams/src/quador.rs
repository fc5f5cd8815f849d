//! Quador lattices: hub balls joined by beams that are quadrics of revolution, with quadric fillets.
//!
//! The solid consists of pieces of quadrics that meet in planes, so point membership, ray intersection and plane slices
//! have closed forms. Source: F. Cirak and M. Sabin, *Adding quadric fillets to quador lattice structures*, arXiv
//! 1908.06974 (2019), here "the note".
//!
//! | symbol | meaning | name in the code |
//! |---|---|---|
//! | r, c | radius and centre of a hub ball | `Hub::radius`, `Quadors::center` |
//! | L | distance between the two hub centres of a beam | `Pencil::length` |
//! | λ | parameter of the pencil of quadrics tangent to both balls | `Pencil::lambda` |
//! | d | distance of the contact plane from the hub centre | `Pencil::contact`, `HalfBeam::contact` |
//! | ρ² = A z² + B z + C | squared radius of a beam at z on its axis | `Pencil::meridian`, `HalfBeam::meridian` |
//! | S = x·x − r² | quadratic form of a ball | `Hub::value` |
//! | G = √λ (n·x − d) | affine function of a half-beam, which is S ≤ G² | `HalfBeam::g` |
//! | N(G) | smooth union of the G²; a hub is S ≤ N | `Hub::smooth_union_value` |
//! | τ | fillet parameter of a pair of half-beams, (β − α)/(β + α) | `Fillet::Tau`, `Hub::tau` |
//! | α, β | fillet parameters of the note, αβ = ¼ | `Fillet::Alpha`, `Fillet::Beta` |
//!
//! Planes of a half-beam along its axis, from the centre: the *contact plane* with the circle where it touches the
//! ball, the *split plane* between the parts of the two hubs, with the *end circle*, and the *cut plane* up to which
//! the hub's formula is evaluated. Half-beams are numbered within their hub; a *label* is the set of half-beams that
//! determine the surface at a point, as a bit mask.

use rayon::prelude::*;

use crate::graph::Graph;
use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Vec3, add, norm, scale, sub};
use geometry::progress::{Cancellation, checkpoint};

mod active_in_box;
mod affine_function;
mod bezier;
mod block_fill;
mod boundary_form;
mod box_index;
pub(crate) mod brep;
mod closest;
mod collisions;
pub mod complex;
mod conic;
mod facets;
mod fillet_matrix;
mod fillet_sizes;
mod foot;
mod gauss;
mod hub;
mod hub_classes;
mod hub_creases;
mod hub_in_box;
mod hub_mesh;
mod hub_quadric;
mod integral;
mod pencil;
mod periodic_cell;
mod perpendicular;
mod quador_field;
mod rational_patch;
mod rays;
pub mod slice;
mod smooth_union;
mod stereographic;
mod tessellation;

pub use bezier::Bezier;
pub use block_fill::FillRequest;
pub use closest::{Closest, ClosestPoints};
pub use collisions::Collision;
pub use fillet_sizes::HubFillets;
pub use hub::{HalfBeam, Hub};
pub use hub_quadric::Quadric;
pub use integral::MassProperties;
pub use pencil::Pencil;
pub use periodic_cell::PeriodicCell;
pub use rational_patch::{RationalPatch, TrimCurve, homogeneous_matrix};
pub use rays::Hit;
pub use tessellation::{Measures, Tessellation};

use affine_function::AffineFunction;
use box_index::BoxIndex;
use fillet_sizes::{FilletSizes, fillet_sizes, hub_fillets};

/// Number of half-beams that a processor's own cache holds.
const CACHED_HALF_BEAMS: usize = 4096;

/// Size of the fillets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fillet {
    /// No fillets: beams meet in creases.
    None,
    /// The largest fillets that fit each hub.
    Auto,
    /// By τ in [0, 1): the closer to 1, the smaller the fillet.
    Tau(f64),
    /// By α in (0, ½]: the larger α, the larger the fillet; τ = (1 − 4α²)/(1 + 4α²).
    Alpha(f64),
    /// By β = 1/(4α), at least ½.
    Beta(f64),
    /// By the minimum radius of curvature in the middle of a crotch, mm.
    Radius(f64),
}

impl Fillet {
    /// τ requested for all pairs, if it is, or α or β.
    pub fn tau(self) -> Option<f64> {
        match self {
            Fillet::Tau(t) => Some(t),
            Fillet::Alpha(a) => Some((1.0 - 4.0 * a * a) / (1.0 + 4.0 * a * a)),
            Fillet::Beta(b) => Some((4.0 * b * b - 1.0) / (4.0 * b * b + 1.0)),
            _ => None,
        }
    }

    fn check(self) -> Result<(), Fault> {
        let refuse = |found: f64, rule: &str, unit: &str| {
            Err(Fault::new("fillet", format!("{rule}, found {}{unit}", number(found))))
        };
        match self {
            Fillet::Tau(t) if !(0.0..1.0).contains(&t) => refuse(t, "tau must be in [0, 1)", ""),
            Fillet::Alpha(a) if !(a > 0.0 && a <= 0.5) => refuse(a, "alpha must be in (0, 0.5]", ""),
            Fillet::Beta(b) if !(b >= 0.5 && b.is_finite()) => refuse(b, "beta must be at least 0.5 and finite", ""),
            Fillet::Radius(r) if !(r > 0.0 && r.is_finite()) => {
                refuse(r, "fillet radius must be positive and finite", " mm")
            }
            _ => Ok(()),
        }
    }
}

/// A hub ball with its range of half-beams.
#[derive(Clone, Debug)]
struct Ball {
    center: Vec3,
    radius: f64,
    first: usize,
    last: usize,
    /// Start of its matrix of τ, which equal hubs share.
    taus: usize,
    /// Bounds of its part with half-beams up to their cut planes, mm.
    bounds: Aabb,
    /// Bounds of its part of the solid, mm.
    part: Aabb,
    /// Upper bound of half the second derivative of N.
    curvature: f64,
    /// Upper bound of N where no G is more than 1.
    most: f64,
}

/// A hub with a fillet smaller than requested.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortfall {
    /// Index of the hub.
    pub hub: usize,
    /// What its crotches have.
    pub fillets: HubFillets,
}

/// Two beams of a hub that still overlap at the split plane of the first: closed forms are not valid there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Index of the hub.
    pub hub: usize,
    /// Indices of the beams.
    pub beams: [u32; 2],
}

/// A quador lattice: the solid of a graph of beams.
#[derive(Clone, Debug)]
pub struct Quadors {
    balls: Vec<Ball>,
    half_beams: Vec<HalfBeam>,
    /// G of each, close together in memory.
    g: Vec<AffineFunction>,
    /// The fillets asked for.
    fillet: Fillet,
    /// τ of the pairs of half-beams of each kind of hub, row by row; empty without fillets.
    taus: Vec<f64>,
    pencils: Vec<Pencil>,
    ends: Vec<[u32; 2]>,
    /// Typical radius by which squared values are converted to lengths, mm.
    scale: f64,
    /// Upper limit of field values, mm.
    cap: f64,
    /// By bounds of hubs, grown by the limit of field values.
    index: BoxIndex,
    /// By bounds of the parts of the solid.
    parts: BoxIndex,
    shortfalls: Vec<Shortfall>,
    overlaps: Vec<Overlap>,
}

impl Quadors {
    /// Builds the beams of a graph and their fillets.
    ///
    /// # Errors
    /// An invalid hub, beam or fillet, with its path in the graph, such as `beams[3].profile`.
    pub fn new(graph: &Graph, fillet: Fillet) -> Result<Quadors, Fault> {
        fillet.check()?;
        if graph.hubs.is_empty() {
            return Err(Fault::new("", "the graph has no hubs: give at least one"));
        }
        for (i, h) in graph.hubs.iter().enumerate() {
            if !h.center.iter().all(|v| v.is_finite()) {
                return Err(Fault::new(
                    format!("hubs[{i}]"),
                    format!("centre must be three finite numbers (mm), found {:?}", h.center),
                ));
            }
            if !(h.radius > 0.0 && h.radius.is_finite()) {
                return Err(Fault::new(
                    format!("hubs[{i}]"),
                    format!("hub radius must be positive and finite, found {} mm", number(h.radius)),
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
                            "unknown hub {}: the graph has {}, numbered from 0",
                            b.ends[0].max(b.ends[1]),
                            counted(graph.hubs.len(), "hub")
                        ),
                    ));
                };
                Pencil::new(norm(sub(z.center, a.center)), [a.radius, z.radius], b.profile).map_err(|f| f.under(&at()))
            })
            .collect::<Vec<Result<_, _>>>() // whole, so that of several faults the first by number is said
            .into_iter()
            .collect::<Result<_, _>>()?;
        let ends: Vec<[u32; 2]> = graph.beams.iter().map(|b| b.ends).collect();
        let (mut firsts, half_beams) = half_beams(graph, &pencils);
        let mut out = Quadors {
            balls: Vec::new(),
            scale: median(pencils.iter().map(|p| p.radius_squared(p.length / 2.0).max(0.0).sqrt()))
                .unwrap_or_else(|| median(graph.hubs.iter().map(|h| h.radius)).unwrap_or(1.0)),
            cap: 0.0,
            g: half_beams.iter().map(|s| s.g).collect(),
            half_beams,
            fillet,
            taus: Vec::new(),
            pencils,
            ends,
            index: BoxIndex::default(),
            parts: BoxIndex::default(),
            shortfalls: Vec::new(),
            overlaps: Vec::new(),
        };
        out.cap = match median(out.pencils.iter().map(|p| p.length)) {
            Some(l) => (l / 4.0).max(out.scale),
            None => 2.0 * out.scale,
        };
        firsts.push(out.half_beams.len());
        out.balls = firsts
            .windows(2)
            .zip(&graph.hubs)
            .map(|(range, h)| Ball {
                center: h.center,
                radius: h.radius,
                first: range[0],
                last: range[1],
                taus: 0,
                bounds: Aabb::EMPTY,
                part: Aabb::EMPTY,
                curvature: 0.0,
                most: f64::INFINITY,
            })
            .collect();
        out.set_fillets();
        out.index = BoxIndex::new(out.balls.iter().map(|b| b.bounds.grown(out.cap)));
        out.parts = BoxIndex::new(out.balls.iter().map(|b| b.part));
        Ok(out)
    }

    /// Sets the fillets, once for equal hubs, and the bounds that depend on them.
    fn set_fillets(&mut self) {
        let (fillet, classes) = (self.fillet, self.classes());
        let request = Cancellation::current();
        let sizes_of = |hub, fillet| {
            checkpoint();
            fillet_sizes(hub, fillet)
        };
        let sizes: Vec<FilletSizes> =
            classes.sample.par_iter().map(|hub| request.enter(|| sizes_of(self.hub(*hub), fillet))).collect();
        let mut starts = Vec::with_capacity(sizes.len());
        for of in &sizes {
            starts.push(self.taus.len());
            self.taus.extend(&of.taus);
        }
        for (hub, class) in classes.of.iter().enumerate() {
            let of = &sizes[*class as usize];
            self.balls[hub].taus = starts[*class as usize];
            self.shortfalls.extend(of.shortfall.map(|fillets| Shortfall { hub, fillets }));
            let first = self.balls[hub].first;
            let beams = |of: &[usize; 2]| of.map(|i| self.half_beams[first + i].beam);
            self.overlaps.extend(of.overlaps.iter().map(|pair| Overlap { hub, beams: beams(pair) }));
        }
        let of = |hub: &usize| (self.hub(*hub).curvature_bound(), self.hub(*hub).union_bound());
        let bounds_of_class: Vec<(f64, f64)> = classes.sample.par_iter().map(of).collect();
        for (hub, class) in classes.of.iter().enumerate() {
            let (of, center) = (self.hub(hub), self.balls[hub].center);
            let placed = |b: Aabb| Aabb { min: add(center, b.min), max: add(center, b.max) };
            let (bounds, part) = (placed(of.bounds()), placed(of.part_bounds().grown(1e-6 * of.radius)));
            let ball = &mut self.balls[hub];
            (ball.bounds, ball.part) = (bounds, part);
            (ball.curvature, ball.most) = bounds_of_class[*class as usize];
        }
    }

    /// Number of hubs.
    pub fn len(&self) -> usize {
        self.balls.len()
    }

    /// Whether there are no hubs.
    pub fn is_empty(&self) -> bool {
        self.balls.is_empty()
    }

    /// Whether the hubs and their half-beams exceed what a processor keeps at hand.
    pub fn is_large(&self) -> bool {
        self.half_beams.len() > CACHED_HALF_BEAMS
    }

    /// A hub, in its own frame.
    #[inline]
    pub fn hub(&self, i: usize) -> Hub<'_> {
        let b = &self.balls[i];
        let n = b.last - b.first;
        let taus = if self.taus.is_empty() { &[][..] } else { &self.taus[b.taus..b.taus + n * n] };
        let (half_beams, g) = (&self.half_beams[b.first..b.last], &self.g[b.first..b.last]);
        Hub { radius: b.radius, half_beams, g, taus, most: b.most }
    }

    /// Centre of a hub, mm.
    pub fn center(&self, i: usize) -> Vec3 {
        self.balls[i].center
    }

    /// Number of beams.
    pub fn beams(&self) -> usize {
        self.ends.len()
    }

    /// The two hubs of a beam.
    pub fn ends(&self, beam: usize) -> [u32; 2] {
        self.ends[beam]
    }

    /// The quadric of a beam.
    pub fn pencil(&self, beam: usize) -> &Pencil {
        &self.pencils[beam]
    }

    /// The fillets asked for.
    pub fn fillet(&self) -> Fillet {
        self.fillet
    }

    /// Hubs with a fillet smaller than requested, in the order of their numbers. There is none with `Fillet::Auto`.
    pub fn shortfalls(&self) -> &[Shortfall] {
        &self.shortfalls
    }

    /// Pairs of beams that overlap too far for closed forms.
    pub fn overlaps(&self) -> &[Overlap] {
        &self.overlaps
    }

    /// Bounds of the solid, mm.
    pub fn bounds(&self) -> Aabb {
        self.balls.iter().fold(Aabb::EMPTY, |b, ball| b.union(ball.bounds))
    }

    /// Fillet radius in the tightest crotch of a hub, mm: 0 in creases, infinite without a concave crotch.
    pub fn fillet_radius(&self, hub: usize) -> f64 {
        self.fillets(hub).radius[0]
    }

    /// What the crotches of a hub have, and how many have less than what was asked for.
    pub fn fillets(&self, hub: usize) -> HubFillets {
        let hub = self.hub(hub);
        hub_fillets(&hub, self.fillet, &hub.adjacent_pairs())
    }

    /// # Errors
    /// The first overlap, which excludes closed forms.
    fn require_closed_forms(&self) -> Result<(), Fault> {
        match self.overlaps.first() {
            None => Ok(()),
            Some(o) => Err(Fault::new(
                format!("hubs[{}]", o.hub),
                format!(
                    "beams {} and {} overlap at mid length ({} in all), so there is no closed form: make them thinner, merge them, or \
                     use the field",
                    o.beams[0],
                    o.beams[1],
                    counted(self.overlaps.len(), "such pair")
                ),
            )),
        }
    }
}

/// The median of the positive lengths.
fn median(lengths: impl Iterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = lengths.filter(|v| *v > 0.0).collect();
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The half-beams of all hubs, sorted by hub and beam; and the first index of each hub.
fn half_beams(graph: &Graph, pencils: &[Pencil]) -> (Vec<usize>, Vec<HalfBeam>) {
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
    let half_beams = order
        .into_iter()
        .map(|(beam, end)| {
            let (p, ends) = (&pencils[beam as usize], graph.beams[beam as usize].ends);
            // The axis is computed once for both ends, so that they are opposite to the last bit.
            let along = sub(graph.hubs[ends[1] as usize].center, graph.hubs[ends[0] as usize].center);
            let toward = if end == 0 { 1.0 } else { -1.0 };
            let axis = scale(along, toward / p.length);
            let root_lambda = p.lambda.sqrt();
            let contact = p.contact(end);
            let split = if end == 0 { p.split() } else { p.length - p.split() };
            // Halfway from the split plane to the contact plane of the other ball.
            let cut = (split + p.length - p.contact(1 - end)) / 2.0;
            HalfBeam {
                beam,
                end,
                axis,
                g: AffineFunction { a: scale(axis, root_lambda), b: -root_lambda * contact },
                contact,
                meridian: p.meridian(end),
                split,
                cut: cut.max(split),
            }
        })
        .collect();
    (firsts, half_beams)
}

#[cfg(test)]
mod tests;
