//! From any triangles to one boundary: the order of the repairs, what they did, and when they are refused.

use crate::fault::Fault;
use crate::math::{add, cross, norm, scale, sub};
use crate::mesh::{Mesh, self_intersections};

mod arrangement;
mod cap;
pub(crate) mod check;
mod clean;
mod fair;
pub(crate) mod half_edges;
mod orient;

use check::Pairs;

/// Caps may make up this share of the repaired surface. A cap is a guess: at a tenth of the surface, over a hole a
/// fifth of the part wide, it can be wrong by a tenth of that width, which is the size of a cell of most lattices.
pub const CAPPED: f64 = 0.1;
/// Faces that do not close by more than this share of the surface are refused.
const UNCLOSED: f64 = 1e-9;
/// Crossing pairs are counted up to here.
const MANY: usize = 1000;

/// Whether a broken mesh is repaired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Repair {
    /// It is, and what was done is told.
    #[default]
    Auto,
    /// It is refused, with what is wrong in numbers.
    Refuse,
}

/// What a repair did. All zero for a mesh that was clean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Repaired {
    /// Corners of open edges that were joined with others.
    pub joined: usize,
    /// Open edges split at corners that lay on them.
    pub split: usize,
    /// Triangles without area that were left out.
    pub degenerate: usize,
    /// Triangles given more than once, or from both sides, that were left out.
    pub duplicates: usize,
    /// Triangles turned to face as their neighbours do.
    pub turned: usize,
    /// Bodies that were inside out and were turned.
    pub bodies_turned: usize,
    /// Holes that were capped.
    pub holes: usize,
    /// Length of the rims of the holes, mm.
    pub hole_length: f64,
    /// Area of the caps, mm².
    pub hole_area: f64,
    /// Area of the caps over that of the surface with them.
    pub hole_share: f64,
    /// Pairs of triangles that crossed or covered each other.
    pub crossings: usize,
    /// Triangles left out whole because solid, or none, is on both sides: bodies within bodies.
    pub inner: usize,
}

impl Repaired {
    /// Whether nothing was repaired.
    pub fn is_clean(&self) -> bool {
        *self == Repaired::default()
    }

    /// What was done in one sentence with its numbers; `None` where nothing was.
    pub fn sentence(&self) -> Option<String> {
        let s = |n: usize, one: &str, more: &str| (n > 0).then(|| counted(n, one, more));
        let holes = s(self.holes, "hole capped", "holes capped").map(|h| {
            let [length, area] = [self.hole_length, self.hole_area].map(short);
            let share = short(100.0 * self.hole_share);
            format!("{h} (rims {length} mm, caps {area} mm², {share} % of the surface)")
        });
        let all = [
            s(self.joined, "open corner joined", "open corners joined"),
            s(self.split, "open edge split at a corner on it", "open edges split at corners on them"),
            s(self.degenerate, "triangle without area left out", "triangles without area left out"),
            s(self.duplicates, "duplicate triangle left out", "duplicate triangles left out"),
            s(self.turned, "flipped triangle turned", "flipped triangles turned"),
            s(self.bodies_turned, "body that was inside out turned", "bodies that were inside out turned"),
            holes,
            s(self.crossings, "crossing pair of triangles cut", "crossing pairs of triangles cut"),
            s(self.inner, "triangle inside the solid left out", "triangles inside the solid left out"),
        ];
        let all: Vec<String> = all.into_iter().flatten().collect();
        (!all.is_empty()).then(|| format!("the mesh was repaired: {}", all.join(", ")))
    }
}

/// A number of things.
fn counted(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

/// Three digits.
fn short(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let digits = (2 - v.abs().log10().floor() as i32).clamp(0, 12) as usize;
    format!("{v:.digits$}")
}

/// The boundary of a solid, and how it came about.
pub struct Boundary {
    /// Its triangles, which share their vertices where they meet.
    pub mesh: Mesh,
    /// The pairs of its half-edges where it is a clean closed surface, as most are; else it is closed but for
    /// rounding, in pieces that need not match.
    pub pairs: Option<Pairs>,
    /// What was done.
    pub done: Repaired,
}

fn refuse(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// The boundary of what the mesh holds. A clean mesh comes back as it is.
pub fn boundary(mut mesh: Mesh, repair: Repair) -> Result<Boundary, Fault> {
    check::numbers(&mesh)?;
    let given = mesh.triangles.len();
    let mut edges = check::edges(&mesh);
    if edges.is_err() {
        mesh = mesh.joined_where_open();
        edges = check::edges(&mesh);
    }
    let found = match edges {
        Ok(pairs) => {
            let crossing = self_intersections(&mesh, MANY);
            if crossing == 0 {
                if check::plain(&mesh, &pairs) {
                    let done = Repaired::default();
                    return Ok(Boundary { mesh, pairs: Some(pairs), done });
                }
                None
            } else {
                let more = if crossing < MANY { "" } else { " or more" };
                Some(format!("{crossing}{more} pairs of triangles that cross each other"))
            }
        }
        Err(found) => Some(found),
    };
    if let (Some(found), Repair::Refuse) = (&found, repair) {
        return Err(refuse(format!(
            "the mesh of {given} triangles does not bound a solid: {found}; repair it, or let repair = \"auto\" do so"
        )));
    }
    let mut done = Repaired::default();
    if found.is_some() {
        done.degenerate = given - mesh.triangles.len() + clean::drop_degenerate(&mut mesh);
        done.duplicates = clean::drop_duplicates(&mut mesh);
        done.joined = clean::join_seams(&mut mesh);
        if done.joined > 0 {
            done.duplicates += clean::drop_duplicates(&mut mesh);
        }
        let reach = mesh.single_rounding();
        done.split = clean::split_at_corners(&mut mesh, reach);
        done.turned = orient::face_alike(&mut mesh);
        let caps = cap::close(&mut mesh);
        (done.holes, done.hole_length, done.hole_area) = (caps.holes, caps.length, caps.area);
        let area = mesh.area();
        done.hole_share = if caps.area > 0.0 { caps.area / area } else { 0.0 };
        if mesh.triangles.is_empty() {
            return Err(refuse(format!(
                "the mesh of {given} triangles holds no solid: none are left without those that have no area and those that lie on each other; found {}",
                found.unwrap_or_default()
            )));
        }
        if done.hole_share > CAPPED {
            return Err(refuse(format!(
                "the mesh of {given} triangles has {} with rims of {} mm; closing them took {} mm², {} % of the surface, and more than {} % would be guessing: found {}",
                counted(caps.holes, "hole", "holes"),
                short(caps.length),
                short(caps.area),
                short(100.0 * done.hole_share),
                100.0 * CAPPED,
                found.unwrap_or_default()
            )));
        }
        clean::drop_degenerate(&mut mesh);
    }
    done.bodies_turned = orient::face_out(&mut mesh);
    check::thick(&mesh)?;
    let clean = check::edges(&mesh).ok();
    let crosses = clean.is_none() || found.is_some() && self_intersections(&mesh, 1) > 0;
    let mut pairs = clean.filter(|_| !crosses);
    let plain = pairs.as_ref().is_some_and(|p| check::plain(&mesh, p));
    let cut = (!plain).then(|| arrangement::boundary(&mesh, 1));
    if let Some(cut) = cut.filter(|c| !c.untouched) {
        let eta = arrangement::tolerance(&mesh);
        done.crossings = cut.pairs;
        done.inner = cut.inner;
        mesh = settled(cut.mesh, eta)?;
        // Only whole bodies were left out: what remains is as clean as it was.
        pairs = match pairs {
            Some(_) => check::edges(&mesh).ok(),
            None => None,
        };
    }
    if let Repair::Refuse = repair
        && !done.is_clean()
    {
        let what = done.sentence().unwrap_or_default();
        let what = what.trim_start_matches("the mesh was repaired: ");
        return Err(refuse(format!(
            "the mesh of {given} triangles does not bound a solid; repair = \"auto\" would do this: {what}"
        )));
    }
    if mesh.triangles.len() < 4 || mesh.volume() <= 0.0 {
        return Err(refuse(format!(
            "the mesh of {given} triangles holds no solid: its volume is {:e} mm³",
            mesh.volume()
        )));
    }
    Ok(Boundary { mesh, pairs, done })
}

/// What cutting left, its pieces joined as far as they match.
fn settled(cut: Mesh, eta: f64) -> Result<Mesh, Fault> {
    let mut mesh = cut.joined(4.0 * eta);
    clean::drop_degenerate(&mut mesh);
    clean::drop_duplicates(&mut mesh);
    clean::split_at_corners(&mut mesh, 4.0 * eta);
    clean::drop_degenerate(&mut mesh);
    closed(&mesh)?;
    Ok(mesh)
}

/// The boundary of where boundaries, those in `turned` from their other sides, wind at least `least` times in all; none
/// where that holds nothing, or is not closed but for rounding.
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
    check::numbers(&all).ok()?;
    let eta = arrangement::tolerance(&all);
    let cut = arrangement::boundary(&all, least);
    let mesh = if cut.untouched { cut.mesh } else { settled(cut.mesh, eta).ok()? };
    if mesh.triangles.len() < 4 || mesh.volume() <= 0.0 {
        return None;
    }
    let pairs = check::edges(&mesh).ok();
    let pairs = pairs.filter(|_| self_intersections(&mesh, 1) == 0);
    Some(Boundary { mesh, pairs, done: Repaired::default() })
}

/// Refuses pieces that leave more open than rounding does: over a closed surface ∫ n dA is zero and ∫ x nᵀ dA is the
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
        "the mesh could not be made one boundary: after cutting it along {} triangles' crossings {gap:e} mm² of {} mm² do not close; repair it in the program it came from",
        mesh.triangles.len(),
        short(area)
    )))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod laws;
