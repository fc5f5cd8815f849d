//! How a lattice over tetrahedra ends at the surface, and the level at which the finished part has the fraction asked for.

use std::sync::Arc;

use super::sample;
use super::surface_net::{RodNet, Rods};
use crate::environment::Environment;
use crate::field::Field;
use crate::implicit::Implicit;
use crate::kind::DesignError;
use crate::map::{CellJoin, SurfaceEnds};
use crate::region::Region;
use crate::tiling::{Rounded, Tiling};
use geometry::fault::number;
use geometry::math::{Vec3, add, scale, sub};
use geometry::progress::checkpoint;

/// Points at which the finished part is sampled; spread evenly, their share is within about 0.0005.
const POINTS: usize = 150_000;
/// The most rounds of the level, and the share that is close enough.
const ROUNDS: usize = 12;
const NEAR: f64 = 2e-4;
/// The first change of the level, as a share of it.
const NUDGE: f64 = 0.02;
/// How far below the surface it is decided what is solid there, as a share of the way to the middle of a tetrahedron.
const BELOW: f64 = 1e-3;
/// By how much the finished part may have more than was asked for.
const OFF: f64 = 5e-3;

/// A lattice with its ends.
pub(super) struct Finished {
    pub tiling: Arc<Tiling>,
    /// The lattice at the level at which it has the fraction asked for by position, where another than that of its surface.
    pub placed: Arc<Tiling>,
    /// The lattice as it ends, by position.
    pub field: Arc<dyn Implicit>,
    /// The net that ties its ports.
    pub net: Option<Rods>,
    /// The least and the greatest radius of the net's rods, or of rounded ends, mm.
    pub radii: Option<[f64; 2]>,
    /// The solid fraction of the finished part, where it is another than that of the flat tetrahedra.
    pub fraction: Option<f64>,
}

/// What gives a lattice its ends.
pub(super) struct Finish<'a> {
    ends: SurfaceEnds,
    region: Region,
    /// The radius of the net's rods as given.
    radius: Option<f64>,
    on: Option<Region>,
    environment: &'a Environment<'a>,
    /// Of the level's key, and of the map.
    path: String,
    map: String,
}

impl<'a> Finish<'a> {
    /// Reads how a lattice is to end; `environment` is that of the lattice, `path` that of the amount.
    pub fn new(joined: &CellJoin, environment: &'a Environment<'a>, path: &str) -> Result<Finish<'a>, DesignError> {
        let map = format!("{}.map.tets", environment.path);
        let net = match (&joined.net, joined.surface) {
            (Some(_), ends) if ends != SurfaceEnds::Net => {
                let message = format!("a net needs surface = \"net\", found \"{}\"", ends.word());
                return Err(DesignError::new(format!("{map}.net"), message));
            }
            (net, _) => net.as_deref().cloned().unwrap_or_default(),
        };
        let on = net.on.map(|on| environment.region(&on, &format!("{map}.net.on")));
        Ok(Finish {
            ends: joined.surface,
            region: environment.region.clone(),
            radius: net.radius,
            on: on.transpose()?,
            environment,
            path: path.to_string(),
            map,
        })
    }

    /// Whether the finished part has another fraction than the cells.
    pub fn changes(&self) -> bool {
        matches!(self.ends, SurfaceEnds::Net | SurfaceEnds::Rounded)
    }

    /// The lattice with its ends; with `asked`, at the level at which the finished part has that fraction: with skin and what is
    /// kept solid if `whole`.
    pub fn made(&self, tiling: Tiling, asked: Option<f64>, whole: bool) -> Result<Finished, DesignError> {
        let net = match self.ends {
            SurfaceEnds::Net => Some(Arc::new(self.net(&tiling)?)),
            _ => None,
        };
        let Some(asked) = asked else {
            return self.finished(Arc::new(tiling), net.as_ref());
        };
        let (points, _) = sample::inside(&self.region, POINTS);
        let lattice = sample::values(&points, |p, out| tiling.values(p, out));
        let mut kept = vec![false; points.len()];
        let bodies = self.environment.filled.iter().filter(|_| whole);
        bodies.for_each(|body| fill(&mut kept, &points, |p, out| body.values(p, out)));
        // A net of a given radius is the same at every level.
        let fixed = net.as_ref().zip(self.radius);
        if let Some((net, radius)) = fixed {
            let rods = self.rods(net, &tiling.given_radii(radius))?;
            fill(&mut kept, &points, |p, out| rods.solid.values(p, out));
        }
        let share_of = |solid: &[bool]| solid.iter().filter(|s| **s).count() as f64 / points.len() as f64;
        if share_of(&kept) > asked + OFF {
            return Err(self.too_full(asked, share_of(&kept)));
        }
        let mut sorted = lattice.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let count = points.len() as f64;
        let mut best: Option<(f64, Finished)> = None;
        // The lattice's own share, and what the finished part has by it: secants, since a net grows with the lattice.
        let (mut share, mut last): (f64, Option<[f64; 2]>) = (asked, None);
        for _ in 0..ROUNDS {
            checkpoint();
            let by = sorted[((share * count) as usize).min(points.len() - 1)];
            let made = self.finished(Arc::new(tiling.clone().with_level_shift(by)), net.as_ref())?;
            let mut solid = kept.clone();
            fill(&mut solid, &points, |p, out| made.field.values(p, out));
            if let (Some(rods), None) = (&made.net, fixed) {
                fill(&mut solid, &points, |p, out| rods.solid.values(p, out));
            }
            let found = share_of(&solid);
            if best.as_ref().is_none_or(|b| (found - asked).abs() < (b.0 - asked).abs()) {
                best = Some((found, Finished { fraction: Some(found), ..made }));
            }
            if (found - asked).abs() < NEAR {
                break;
            }
            let steep = last.map(|[s, f]| (found - f) / (share - s)).filter(|g| (0.2..20.0).contains(g)).unwrap_or(1.0);
            last = Some([share, found]);
            // At most by half the way to nothing or everything.
            share = (share + (asked - found) / steep).clamp(0.5 * share, 0.5 + 0.5 * share);
        }
        match best {
            Some((found, _)) if found > asked + OFF => Err(self.too_full(asked, found)),
            Some((_, made)) => Ok(made),
            None => self.finished(Arc::new(tiling), net.as_ref()),
        }
    }

    /// Says that what is solid anyway is more than asked for.
    fn too_full(&self, asked: f64, found: f64) -> DesignError {
        let message = format!(
            "with next to no lattice the net, the skin and what is kept solid make up {found:.4} of the part; ask for more than that, or \
             for thinner ones: {} is too little",
            number(asked)
        );
        DesignError::new(&self.path, message)
    }

    /// The lattice with flat ends at the level at which its surface, made without a grid, encloses the fraction asked for, or at its own:
    /// that of flat tetrahedra, and what bending them changes, over the region's `volume` (mm³).
    pub fn bent(&self, tiling: Tiling, asked: Option<f64>, volume: f64) -> Result<Finished, DesignError> {
        let fraction = |of: &Tiling| of.bent_volume().map(|solid| solid / volume);
        let Some(asked) = asked else {
            let fraction = fraction(&tiling);
            return Ok(Finished { fraction, ..self.finished(Arc::new(tiling), None)? });
        };
        let range = tiling.levels();
        let nudge = NUDGE * range.lo.abs().max(range.hi.abs()).max(NUDGE);
        let mut by = 0.0;
        // The last level and its fraction, and what a level adds.
        let (mut last, mut rate): (Option<[f64; 2]>, f64) = (None, 0.0);
        let mut best: Option<(f64, Tiling)> = None;
        for _ in 0..ROUNDS {
            checkpoint();
            let moved = tiling.clone().with_level_shift(by);
            let Some(found) = fraction(&moved) else { break };
            if best.as_ref().is_none_or(|b| (found - asked).abs() < (b.0 - asked).abs()) {
                best = Some((found, moved));
            }
            if (found - asked).abs() < NEAR {
                break;
            }
            if let Some([b, f]) = last {
                let secant = (found - f) / (by - b);
                rate = if secant > 0.1 * rate { secant } else { 2.0 * rate };
            }
            last = Some([by, found]);
            by += if rate > 0.0 { (asked - found) / rate } else { nudge.copysign(asked - found) };
        }
        // By position tetrahedra are bent as quadratic ones, and made one by one after the surface itself: each has the fraction at a level
        // of its own.
        let placed = self.made(tiling.clone(), Some(asked), false)?;
        let Some((found, tiling)) = best else { return Ok(placed) };
        Ok(Finished { fraction: Some(found), tiling: Arc::new(tiling), ..placed })
    }

    /// The lattice with its ends at its own level, and the fraction that the finished part has by that.
    pub fn at_own_level(&self, tiling: Tiling) -> Result<Finished, DesignError> {
        let made = self.made(tiling, None, false)?;
        let (points, _) = sample::inside(&self.region, POINTS);
        let mut solid = vec![false; points.len()];
        fill(&mut solid, &points, |p, out| made.field.values(p, out));
        if let Some(rods) = &made.net {
            fill(&mut solid, &points, |p, out| rods.solid.values(p, out));
        }
        let fraction = solid.iter().filter(|s| **s).count() as f64 / points.len() as f64;
        Ok(Finished { fraction: Some(fraction), ..made })
    }

    /// The middle lines of the net: on the faces of the boundary that are chosen, where no skin or keep zone ties the ports anyway.
    fn net(&self, tiling: &Tiling) -> Result<RodNet, DesignError> {
        let map = &tiling.map;
        let all = map.boundary_faces();
        let third = |(t, f): &(usize, [usize; 3])| {
            let c = map.corners(*t);
            scale(f.iter().fold([0.0; 3], |s, i| add(s, c[*i])), 1.0 / 3.0)
        };
        let chosen = |i: &usize| self.on.as_ref().is_none_or(|on| on.value(third(&all[*i])) < 0.0);
        let on: Vec<usize> = (0..all.len()).filter(chosen).collect();
        if on.is_empty() {
            let message =
                "no triangle of the mesh's boundary has its middle in this region; make it reach over the surface";
            return Err(DesignError::new(format!("{}.net.on", self.map), message));
        }
        let corners = |(t, f): &(usize, [usize; 3])| {
            let c = map.corners(*t);
            let middle = scale(c.iter().fold([0.0; 3], |s, p| add(s, *p)), 0.25);
            let below = |p: Vec3| add(p, scale(sub(middle, p), BELOW));
            [c[f[0]], c[f[1]], c[f[2]], third(&(*t, *f))].map(below)
        };
        let points: Vec<Vec3> = on.iter().flat_map(|i| corners(&all[*i])).collect();
        let mut tied = vec![false; points.len()];
        self.environment.filled.iter().for_each(|body| fill(&mut tied, &points, |p, out| body.values(p, out)));
        let open = on.iter().zip(tied.chunks(4)).filter(|(_, solid)| solid.iter().any(|s| !s)).map(|(i, _)| *i);
        let open: Vec<usize> = open.collect();
        if open.is_empty() {
            let message = "the skin or a keep zone is solid wherever the net would be, and ties the ports without it; leave the net out \
                           (surface = \"capped\"), or leave the skin open where it is wanted";
            return Err(DesignError::new(format!("{}.surface", self.map), message));
        }
        Ok(RodNet::new(map, &self.region, &tiling.ports(), open))
    }

    fn rods(&self, net: &Arc<RodNet>, of: &[f64]) -> Result<Rods, DesignError> {
        if of.iter().all(|r| r.is_nan() || *r <= 0.0) {
            let message = "the cell has no ports on the surface at this level, so there is nothing for the net to tie; ask for a higher \
                           fraction, take another cell, or give net.radius";
            return Err(DesignError::new(format!("{}.net", self.map), message));
        }
        net.rods(of).map_err(|f| DesignError::new(format!("{}.net", self.map), f.message))
    }

    /// The lattice with its ends at its own level.
    fn finished(&self, tiling: Arc<Tiling>, net: Option<&Arc<RodNet>>) -> Result<Finished, DesignError> {
        let (field, placed) = (tiling.clone(), tiling.clone());
        let plain = Finished { tiling: tiling.clone(), placed, field, net: None, radii: None, fraction: None };
        match (self.ends, net) {
            (SurfaceEnds::Net, Some(net)) => {
                let of = self.radius.map_or_else(|| tiling.rod_radii(), |radius| tiling.given_radii(radius));
                let rods = self.rods(net, &of)?;
                Ok(Finished { radii: Some(rods.range()), net: Some(rods), ..plain })
            }
            (SurfaceEnds::Rounded, _) => {
                let rounded = Rounded::new(&tiling, &self.region);
                Ok(Finished { radii: Some(rounded.end_radii()), field: Arc::new(rounded), ..plain })
            }
            _ => Ok(plain),
        }
    }
}

/// Marks the points at which a field is not positive.
fn fill(solid: &mut [bool], points: &[Vec3], values: impl Fn(&[Vec3], &mut [f64]) + Sync) {
    let values = sample::values(points, values);
    solid.iter_mut().zip(values).for_each(|(s, v)| *s |= v <= 0.0);
}
