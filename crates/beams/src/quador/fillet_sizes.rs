//! Sizes of the fillets of a hub: what is asked for, and what fits.

use geometry::math::dot;
use geometry::roots::bisect;

use super::Fillet;
use super::fillet_matrix::{inverse, is_positive_definite};
use super::hub::{Hub, MAX_TAU};

/// Fraction of the distance from contact plane to split plane that fillets may occupy.
const FILLET_REACH: f64 = 0.999;
/// Least eigenvalue of R, or half of 1 − τ of the narrowest pair: seams of an R closer to singular lose digits.
const MIN_EIGENVALUE: f64 = 0.01;
/// Equal fillets that are tried, from the largest, in radii of the beams.
const LEVELS: [f64; 3] = [4.0, 0.8, 0.01];
/// Number of halvings of an interval of sizes. Sizes are steps of beam radii no finer than the last interval, and so is any volume:
/// 2⁻³² is below the accuracy of volumes. The least eigenvalue is then as near to its minimum; much nearer, and the inverse loses
/// the digits by which pairs are found free.
const HALVINGS: usize = 32;
/// Number of times that all pairs are moved on.
const ROUNDS: usize = 4;
/// A fillet is short if it has less than this share of what was asked for: radii follow from 1 − τ ≥ 10⁻³, known to rounding.
const SHORT: f64 = 1.0 - 1e-9;

/// R of a hub: a symmetric matrix with τ of each pair, and 1 on the diagonal.
#[derive(Clone, Debug, PartialEq)]
struct Pairs {
    n: usize,
    tau: Vec<f64>,
}

impl Pairs {
    /// From τ of each pair.
    fn new(n: usize, tau: impl Fn(usize, usize) -> f64) -> Pairs {
        let mut out = Pairs { n, tau: vec![1.0; n * n] };
        for i in 0..n {
            for j in 0..i {
                out.set(i, j, tau(i, j));
            }
        }
        out
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.tau[i * self.n + j]
    }

    fn set(&mut self, i: usize, j: usize, tau: f64) {
        (self.tau[i * self.n + j], self.tau[j * self.n + i]) = (tau, tau);
    }

    /// The maximum τ.
    fn narrowest(&self) -> f64 {
        (0..self.n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| self.at(i, j)).fold(0.0, f64::max)
    }

    /// Whether all eigenvalues are above a minimum.
    fn allowed(&self, floor: f64) -> bool {
        is_positive_definite(self.n, &self.tau, 1.0 - floor)
    }

    /// Moves pairs towards another matrix while all eigenvalues stay above a minimum. Where the way ends, pairs that lower
    /// the least eigenvalue stay and the others go on.
    fn advance(&mut self, mut moving: Vec<(usize, usize)>, to: &Pairs, floor: f64) {
        while !moving.is_empty() {
            let from: Vec<f64> = moving.iter().map(|&(i, j)| self.at(i, j)).collect();
            let mut step = |s: f64| {
                for (&(i, j), from) in moving.iter().zip(&from) {
                    let end = to.at(i, j);
                    self.set(i, j, if s == 1.0 { end } else { from + s * (end - from) });
                }
                self.allowed(floor)
            };
            if step(1.0) {
                return;
            }
            let last = bisect([0.0, 1.0], HALVINGS, &mut step)[0];
            step(last);
            let before = moving.len();
            moving = self.free(&moving, to, floor);
            if moving.len() == before {
                return;
            }
        }
    }

    /// The pairs that are not where another matrix has them, and that do not lower the least eigenvalue, which is near its
    /// minimum, on their way there.
    fn free(&self, pairs: &[(usize, usize)], to: &Pairs, floor: f64) -> Vec<(usize, usize)> {
        // The gradient of the logarithm of the determinant, large along the least eigenvector.
        let inverse = inverse(self.n, &self.tau, 1.0 - floor);
        let most = inverse.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        let way = |i, j| to.at(i, j) - self.at(i, j);
        let is_free =
            |&(i, j): &(usize, usize)| way(i, j) != 0.0 && way(i, j).signum() * inverse[i * self.n + j] >= -1e-3 * most;
        pairs.iter().copied().filter(is_free).collect()
    }

    /// As `advance`, in several rounds: where pairs have moved, others may be free again.
    fn toward(&mut self, pairs: &[(usize, usize)], to: &Pairs, floor: f64) {
        self.advance(pairs.to_vec(), to, floor);
        for _ in 1..ROUNDS {
            self.advance(self.free(pairs, to, floor), to, floor);
        }
    }
}

/// The minimum τ of each pair: fillets above it end before the split planes. And the pairs that overlap there.
fn min_taus(hub: &Hub) -> (Pairs, Vec<[usize; 2]>) {
    let n = hub.half_beams.len();
    let (mut least, mut overlaps) = (Pairs::new(n, |_, _| 0.0), Vec::new());
    for i in 0..n {
        for j in (0..n).filter(|j| *j != i) {
            let s = &hub.half_beams[i];
            let tau_early = hub.min_tau(i, j, s.contact + FILLET_REACH * (s.split - s.contact));
            let tau = if tau_early < MAX_TAU { tau_early } else { hub.min_tau(i, j, s.split).max(MAX_TAU) };
            if tau >= 1.0 || s.split <= s.contact {
                overlaps.push([i, j]);
            }
            let tau = if tau.is_nan() { 1.0 } else { tau.clamp(0.0, MAX_TAU) };
            least.set(i, j, tau.max(least.at(i, j)));
        }
    }
    (least, overlaps)
}

/// Sizes of the fillets of a hub.
pub(super) struct FilletSizes {
    /// R, row by row; empty without fillets.
    pub taus: Vec<f64>,
    /// What its crotches have, if one has less than what is asked for.
    pub shortfall: Option<HubFillets>,
    /// Pairs of half-beams that overlap at the split plane of the first.
    pub overlaps: Vec<[usize; 2]>,
}

/// The fillets of a hub: those asked for, or the largest that fit.
///
/// Each fillet must end before the split planes, and R be positive definite. The largest fillets have the minimum τ of each pair if that
/// is. Otherwise they are first equal ones, as large as possible, which leaves the narrowest pairs their largest; from there pairs
/// go on towards their minimum. From the largest fillets pairs in turn go towards what is asked for, so no crotch gets less
/// than both.
pub(super) fn fillet_sizes(hub: Hub, fillet: Fillet) -> FilletSizes {
    let (least, overlaps) = min_taus(&hub);
    if fillet == Fillet::None {
        return FilletSizes { taus: Vec::new(), shortfall: None, overlaps };
    }
    let floor = MIN_EIGENVALUE.min((1.0 - least.narrowest()) / 2.0);
    let mut known = None;
    let wanted = match (fillet, fillet.tau()) {
        (Fillet::Radius(r), _) => {
            // Pairs that do not meet have a τ for corners alone, as if they were equal cylinders.
            let mut wanted = equal_cylinders(&hub, &least, r / hub.radius);
            for &(i, j) in known.insert(hub.adjacent_pairs()).iter() {
                wanted.set(i, j, tau_for_radius(&hub, i, j, r).max(least.at(i, j)));
            }
            wanted
        }
        (_, Some(tau)) => Pairs::new(least.n, |i, j| tau.min(MAX_TAU).max(least.at(i, j))),
        _ => least.clone(),
    };
    let mut pairs = wanted;
    // What is asked for may be narrower than what is needed.
    if !pairs.allowed(floor.min((1.0 - pairs.narrowest()) / 2.0)) {
        let adjacent = known.get_or_insert_with(|| hub.adjacent_pairs());
        let most = if least.allowed(floor) {
            least.clone()
        } else {
            let mut most = largest(&hub, &least, floor);
            most.toward(adjacent, &least, floor);
            most
        };
        pairs = if fillet == Fillet::Auto {
            most
        } else {
            let mut reduced = most;
            reduced.toward(adjacent, &pairs, floor);
            reduced
        };
    }
    let may_be_short = fillet != Fillet::Auto && fillet.tau().is_none_or(|tau| pairs.narrowest() > tau.min(MAX_TAU));
    let shortfall = may_be_short.then(|| {
        let adjacent = known.unwrap_or_else(|| hub.adjacent_pairs());
        hub_fillets(&Hub { taus: &pairs.tau, ..hub }, fillet, &adjacent)
    });
    let shortfall = shortfall.filter(|of| of.short > 0);
    FilletSizes { taus: pairs.tau, shortfall, overlaps }
}

/// τ of fillets of one radius between equal cylinders of unit radius in these directions, but none below the minimum.
fn equal_cylinders(hub: &Hub, least: &Pairs, radius: f64) -> Pairs {
    let square = radius * radius;
    Pairs::new(least.n, |i, j| {
        // ρ² = (1 − τ)²/((1 + τ)(τ − cos θ)), solved for τ.
        let cos = dot(hub.half_beams[i].axis, hub.half_beams[j].axis);
        let (two, one, none) = (1.0 - square, 2.0 + square * (1.0 - cos), 1.0 + square * cos);
        let tau = 2.0 * none / (one + (one * one - 4.0 * two * none).max(0.0).sqrt());
        tau.max(least.at(i, j)).min(MAX_TAU)
    })
}

/// The largest equal fillets with all eigenvalues above a minimum, as of equal cylinders.
fn largest(hub: &Hub, least: &Pairs, floor: f64) -> Pairs {
    let allowed = |radius: f64| equal_cylinders(hub, least, radius).allowed(floor);
    let [first, factor, last] = LEVELS;
    let mut radius = first;
    while !allowed(radius) {
        radius *= factor;
        if radius < last {
            // One τ for all pairs: 1 − τ is the least eigenvalue.
            let tau = least.narrowest();
            return Pairs::new(least.n, |_, _| tau);
        }
    }
    equal_cylinders(hub, least, bisect([radius, radius / factor], HALVINGS, allowed)[0])
}

/// τ at which the crotch of two half-beams has radius r; the radius decreases as τ increases.
fn tau_for_radius(hub: &Hub, i: usize, j: usize, r: f64) -> f64 {
    let at = |tau: f64| hub.crotch(i, j, tau).map_or(f64::INFINITY, |c| c.1);
    if at(MAX_TAU) >= r { MAX_TAU } else { bisect([0.0, MAX_TAU], 48, |tau| at(tau) >= r)[0] }
}

/// The fillets of a hub: one in each crotch, where two of its half-beams meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HubFillets {
    /// Number of crotches.
    pub crotches: usize,
    /// Number of crotches with a smaller fillet than asked for.
    pub short: usize,
    /// Radius of curvature in the middle of the tightest and of the widest fillet, mm: 0 in creases; infinite if no crotch is
    /// concave.
    pub radius: [f64; 2],
    /// Minimum and maximum τ; the smallest fillet has the maximum. NaN without crotches.
    pub tau: [f64; 2],
}

/// The fillets in the crotches of a hub, and how many are smaller than asked for.
pub(super) fn hub_fillets(hub: &Hub, fillet: Fillet, crotches: &[(usize, usize)]) -> HubFillets {
    let mut out = HubFillets { crotches: crotches.len(), short: 0, radius: [f64::INFINITY; 2], tau: [f64::NAN; 2] };
    for &(i, j) in crotches {
        let tau = hub.tau(i, j);
        let radius = if hub.sharp() { 0.0 } else { hub.crotch(i, j, tau).map_or(f64::INFINITY, |c| c.1) };
        let is_short = match (fillet, fillet.tau()) {
            (Fillet::Radius(asked), _) => radius < asked * SHORT,
            (_, Some(asked)) => 1.0 - tau < (1.0 - asked.min(MAX_TAU)) * SHORT,
            _ => false,
        };
        out.short += usize::from(is_short);
        // f64::min and max pass NaN over.
        out.tau = [out.tau[0].min(tau), out.tau[1].max(tau)];
        if radius < f64::INFINITY {
            let widest = if out.radius[1] < f64::INFINITY { out.radius[1].max(radius) } else { radius };
            out.radius = [out.radius[0].min(radius), widest];
        }
    }
    out
}
