//! From any triangles to the boundary of a solid: the order of the repairs, a report of them, and when they are refused.

use schemars::JsonSchema;
use serde::Serialize;

use crate::fault::{Fault, number};
use crate::math::{add, cross, norm, scale, sub};
use crate::mesh::{Mesh, self_intersections};
use crate::progress::checkpoint;

mod arrangement;
mod fairing;
mod holes;
mod orientation;
mod stitch;
pub(crate) mod validity;

use validity::Pairs;

/// Caps may make up this share of the repaired surface, unless more is asked for ([`Repair::Caps`]). A cap is a guess: at a tenth of the surface, over a hole a
/// fifth of the part wide, it can be wrong by a tenth of that width, which is the size of a cell of most lattices.
pub const CAPPED: f64 = 0.1;
/// A surface with a larger gap than this share of its area is refused.
const UNCLOSED: f64 = 1e-9;
/// Crossing pairs are counted up to here.
const MANY: usize = 1000;

/// Whether a broken mesh is repaired.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Repair {
    /// It is, and the repairs are reported; caps may make up [`CAPPED`] of the surface.
    #[default]
    Auto,
    /// The same, with caps up to this share of the surface.
    Caps(f64),
    /// It is refused, with its defects in numbers.
    Refuse,
}

/// What was repaired in a mesh; all zero for a clean one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "RepairReport")]
pub struct Repaired {
    /// Corners of open edges joined with others.
    pub joined: usize,
    /// Open edges split at corners that lay on them.
    pub split: usize,
    /// Triangles without area left out.
    pub degenerate: usize,
    /// Triangles given more than once left out.
    pub duplicates: usize,
    /// Triangles turned to face as their neighbours do.
    pub turned: usize,
    /// Bodies that were inside out and were turned.
    pub bodies_turned: usize,
    /// Holes capped.
    pub holes: usize,
    /// Pairs of triangles that crossed or covered each other.
    pub crossings: usize,
    /// Triangles left out because solid, or none, is on both sides.
    pub inner: usize,
    /// Length of the boundary loops of the holes, mm.
    pub hole_length: f64,
    /// Area of the caps, mm².
    pub hole_area: f64,
    /// Area of the caps over that of the surface with them.
    pub hole_share: f64,
}

impl Repaired {
    /// Whether nothing was repaired.
    pub fn is_clean(&self) -> bool {
        *self == Repaired::default()
    }

    /// The repairs in one sentence with their numbers; `None` where there were none.
    pub fn sentence(&self) -> Option<String> {
        let s = |n: usize, one: &str, more: &str| (n > 0).then(|| counted(n, one, more));
        let holes = s(self.holes, "hole capped", "holes capped").map(|h| {
            let [length, area] = [self.hole_length, self.hole_area].map(short);
            let share = short(100.0 * self.hole_share);
            format!("{h} (boundary loops {length} mm, caps {area} mm², {share} % of the surface)")
        });
        let all = [
            s(self.joined, "vertex of an open edge merged", "vertices of open edges merged"),
            s(self.split, "open edge split at a vertex on it", "open edges split at vertices on them"),
            s(self.degenerate, "triangle without area removed", "triangles without area removed"),
            s(self.duplicates, "duplicate triangle removed", "duplicate triangles removed"),
            s(self.turned, "flipped triangle reversed", "flipped triangles reversed"),
            s(self.bodies_turned, "component that was inside out reversed", "components that were inside out reversed"),
            holes,
            s(self.crossings, "intersecting pair of triangles cut", "intersecting pairs of triangles cut"),
            s(self.inner, "triangle inside the solid removed", "triangles inside the solid removed"),
        ];
        let all: Vec<String> = all.into_iter().flatten().collect();
        (!all.is_empty()).then(|| format!("the mesh was repaired: {}", all.join(", ")))
    }
}

/// A count with its noun.
fn counted(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

/// A number to three digits.
fn short(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let digits = (2 - v.abs().log10().floor() as i32).clamp(0, 12) as usize;
    format!("{v:.digits$}")
}

/// The boundary of a solid, and the repairs that made it.
pub struct Boundary {
    /// Its triangles; adjacent ones share vertices.
    pub mesh: Mesh,
    /// The pairs of its half-edges where it is a closed manifold, as most are; else it is closed but for
    /// rounding, of triangles that need not match along edges.
    pub pairs: Option<Pairs>,
    /// Counts of the repairs.
    pub done: Repaired,
}

fn refuse(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// Refuses holes whose caps are too great a part of the surface: a cap is a guess.
fn check_caps(done: &Repaired, repair: Repair, capped: &Mesh, given: usize, found: Option<&str>) -> Result<(), Fault> {
    let (most, allow) = match repair {
        // With caps of any size it would still be no solid.
        Repair::Caps(share) if validity::thick(capped).is_err() => (share, String::new()),
        Repair::Caps(share) => {
            let enough = ((20.0 * done.hole_share).ceil() / 20.0).min(1.0);
            (share, format!(", or allow more with caps = {enough}"))
        }
        _ => (CAPPED, String::new()),
    };
    if done.hole_share <= most {
        return Ok(());
    }
    Err(refuse(format!(
        "the mesh of {given} triangles has {} with boundary loops of {} mm: their caps take {} mm², {} % of the surface; at most {} % are allowed. Close the holes in the program the mesh came from{allow}; found {}",
        counted(done.holes, "hole", "holes"),
        short(done.hole_length),
        short(done.hole_area),
        short(100.0 * done.hole_share),
        (1000.0 * most).round() / 10.0,
        found.unwrap_or_default()
    )))
}

/// The boundary of the solid inside a mesh. A clean mesh comes back as it is.
pub fn boundary(mut mesh: Mesh, repair: Repair) -> Result<Boundary, Fault> {
    validity::numbers(&mesh)?;
    let given = mesh.triangles.len();
    checkpoint();
    let mut edges = validity::edges(&mesh);
    if edges.is_err() {
        mesh = mesh.joined_where_open();
        edges = validity::edges(&mesh);
    }
    let found = match edges {
        Ok(pairs) => {
            let crossing = self_intersections(&mesh, MANY);
            checkpoint();
            if crossing == 0 {
                if validity::plain(&mesh, &pairs) {
                    let done = Repaired::default();
                    return Ok(Boundary { mesh, pairs: Some(pairs), done });
                }
                None
            } else {
                let more = if crossing < MANY { "" } else { " or more" };
                Some(format!("{crossing}{more} intersecting pairs of triangles"))
            }
        }
        Err(found) => Some(found),
    };
    if let (Some(found), Repair::Refuse) = (&found, repair) {
        return Err(refuse(format!(
            "the mesh of {given} triangles does not bound a solid: {found}. Repair it, or set repair = \"auto\""
        )));
    }
    let mut done = Repaired::default();
    if found.is_some() {
        done.degenerate = given - mesh.triangles.len() + stitch::drop_degenerate(&mut mesh);
        done.duplicates = stitch::drop_duplicates(&mut mesh);
        done.joined = stitch::join_seams(&mut mesh);
        checkpoint();
        if done.joined > 0 {
            done.duplicates += stitch::drop_duplicates(&mut mesh);
        }
        let reach = mesh.single_rounding();
        done.split = stitch::split_at_corners(&mut mesh, reach);
        checkpoint();
        done.turned = orientation::face_alike(&mut mesh);
        let caps = holes::close(&mut mesh);
        (done.holes, done.hole_length, done.hole_area) = (caps.holes, caps.length, caps.area);
        let area = mesh.area();
        done.hole_share = if caps.area > 0.0 { caps.area / area } else { 0.0 };
        if mesh.triangles.is_empty() {
            return Err(refuse(format!(
                "the mesh of {given} triangles holds no solid: without degenerate and duplicate triangles none are left; found {}",
                found.unwrap_or_default()
            )));
        }
        check_caps(&done, repair, &mesh, given, found.as_deref())?;
        stitch::drop_degenerate(&mut mesh);
    }
    checkpoint();
    done.bodies_turned = orientation::face_out(&mut mesh);
    checkpoint();
    validity::thick(&mesh)?;
    let clean = validity::edges(&mesh).ok();
    let crosses = clean.is_none() || found.is_some() && self_intersections(&mesh, 1) > 0;
    let mut pairs = clean.filter(|_| !crosses);
    let plain = pairs.as_ref().is_some_and(|p| validity::plain(&mesh, p));
    let cut = (!plain).then(|| arrangement::boundary(&mesh, 1));
    if let Some(cut) = cut.filter(|c| !c.untouched) {
        let eta = arrangement::tolerance(&mesh);
        done.crossings = cut.pairs;
        done.inner = cut.inner;
        mesh = stitched(cut.mesh, eta)?;
        // Only whole components were removed: the rest is as clean as it was.
        pairs = match pairs {
            Some(_) => validity::edges(&mesh).ok(),
            None => None,
        };
    }
    if let Repair::Refuse = repair
        && !done.is_clean()
    {
        let what = done.sentence().unwrap_or_default();
        let what = what.trim_start_matches("the mesh was repaired: ");
        return Err(refuse(format!(
            "the mesh of {given} triangles does not bound a solid; with repair = \"auto\": {what}"
        )));
    }
    if mesh.triangles.len() < 4 || mesh.volume() <= 0.0 {
        return Err(refuse(format!(
            "the mesh of {given} triangles holds no solid: its volume is {} mm³",
            number(mesh.volume())
        )));
    }
    Ok(Boundary { mesh, pairs, done })
}

/// The result of cutting, merged where vertices match.
fn stitched(cut: Mesh, eta: f64) -> Result<Mesh, Fault> {
    let mut mesh = cut.joined(4.0 * eta);
    stitch::drop_degenerate(&mut mesh);
    stitch::drop_duplicates(&mut mesh);
    stitch::split_at_corners(&mut mesh, 4.0 * eta);
    stitch::drop_degenerate(&mut mesh);
    closed(&mesh)?;
    Ok(mesh)
}

/// The boundary of the points about which boundaries, those in `turned` reversed, wind at least `least` times in all; `None`
/// where there is no such point, or the result is not closed but for rounding.
pub fn combined(of: &[&Mesh], turned: &[&Mesh], least: usize) -> Option<Boundary> {
    let mut all = Mesh::default();
    let sides = of.iter().map(|m| (m, false));
    for (mesh, turned) in sides.chain(turned.iter().map(|m| (m, true))) {
        let first = u32::try_from(all.vertices.len()).ok()?;
        all.vertices.extend(&mesh.vertices);
        let side = |t: &[u32; 3]| if turned { [t[0], t[2], t[1]] } else { *t };
        let moved = mesh.triangles.iter().map(|t| side(t).map(|v| first + v));
        all.triangles.extend(moved);
    }
    validity::numbers(&all).ok()?;
    let eta = arrangement::tolerance(&all);
    let cut = arrangement::boundary(&all, least);
    let mesh = if cut.untouched { cut.mesh } else { stitched(cut.mesh, eta).ok()? };
    if mesh.triangles.len() < 4 || mesh.volume() <= 0.0 {
        return None;
    }
    let pairs = pairs(&mesh);
    Some(Boundary { mesh, pairs, done: Repaired::default() })
}

/// The pairs of half-edges of a mesh that is closed and does not cross itself.
pub fn pairs(mesh: &Mesh) -> Option<Pairs> {
    validity::edges(mesh).ok().filter(|_| self_intersections(mesh, 1) == 0)
}

/// Refuses a surface with a gap beyond rounding: over a closed surface ∫ n dA is zero and ∫ x nᵀ dA is the
/// volume times one.
fn closed(mesh: &Mesh) -> Result<(), Fault> {
    let o = mesh.bounds().center();
    let (mut area, mut sum, mut first) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i).map(|p| sub(p, o));
        let n = scale(cross(sub(b, a), sub(c, a)), 0.5);
        let x = scale(add(a, add(b, c)), 1.0 / 3.0);
        area += norm(n);
        sum = add(sum, n);
        for k in 0..3 {
            first[k] = add(first[k], scale(n, x[k]));
        }
    }
    let volume = (first[0][0] + first[1][1] + first[2][2]) / 3.0;
    let mut off = 0.0f64;
    for k in 0..3 {
        let mut row = first[k];
        row[k] -= volume;
        off = off.max(norm(row));
    }
    let size = norm(mesh.bounds().size());
    let gap = norm(sum).max(off / size);
    if gap <= UNCLOSED * area {
        return Ok(());
    }
    Err(refuse(format!(
        "the surface is not closed: after cutting {} triangles along their intersections a gap of {gap:e} mm² in {} mm² is left. Repair the mesh in the program it came from",
        mesh.triangles.len(),
        short(area)
    )))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod laws;
