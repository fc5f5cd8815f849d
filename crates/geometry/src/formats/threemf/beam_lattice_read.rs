//! Reading of the beam lattice extension of 3MF, with what it demands of files.
//!
//! Source: 3MF Consortium, Beam Lattice Extension 1.2.0. Names count without their prefixes: some files have balls in the namespace of
//! beams.

use std::collections::{HashMap, HashSet};

use quick_xml::events::BytesStart;

use super::beam_lattice::{Cap, Frustum};
use super::read::{Model, Object, PlacedObject, Source, Which, place_all};
use crate::fault::{Fault, counted};
use crate::formats::graphs::BeamGraph;
use crate::formats::text::shown;
use crate::formats::xml::attribute_where;
use crate::math::{Mat3, determinant, dot, norm, sub};

/// How far a placement may be from a similarity: files give some seven digits.
const SIMILAR: f64 = 1e-4;

/// A lattice as it is read.
#[derive(Default)]
pub(super) struct Lattice {
    pub beams: Vec<Frustum>,
    /// Balls; NaN where the usual radius holds.
    balls: Vec<(u32, f64)>,
    identifiers: HashSet<String>,
    /// Greatest index of a beam and of a ball in a set.
    most_referred: Option<u32>,
    balls_referred: Option<u32>,
    radius: f64,
    cap: Cap,
    min_length: f64,
    mode: String,
    ball_radius: f64,
    /// The mesh that clips and its mode.
    pub clip: Option<(u32, String)>,
    shown: Option<u32>,
    has_beams: bool,
    properties: bool,
    /// Whether some beam or ball has properties of its own.
    own_properties: bool,
}

/// An attribute by its name without a prefix.
fn local<'a>(tag: &'a BytesStart, name: &str) -> Option<std::borrow::Cow<'a, str>> {
    attribute_where(tag, |n| n.rsplit(':').next() == Some(name))
}

fn optional<T: core::str::FromStr>(s: &Source, tag: &BytesStart, name: &str) -> Result<Option<T>, Fault> {
    let Some(text) = local(tag, name) else { return Ok(None) };
    let wrong = |_| s.fault(format!("{name} = {} is not a number that it can be", shown(text.as_bytes())));
    text.parse().map(Some).map_err(wrong)
}

fn positive(s: &Source, tag: &BytesStart, name: &str) -> Result<Option<f64>, Fault> {
    match optional::<f64>(s, tag, name)? {
        Some(v) if !(v > 0.0 && v.is_finite()) => Err(s.fault(format!("{name} = {v}; it must be greater than 0"))),
        found => Ok(found),
    }
}

fn cap(s: &Source, tag: &BytesStart, name: &str) -> Result<Option<Cap>, Fault> {
    let Some(word) = local(tag, name) else { return Ok(None) };
    let found = Cap::ALL.into_iter().find(|c| c.word() == word);
    let wrong = || s.fault(format!("{name} = {}; it must be sphere, hemisphere or butt", shown(word.as_bytes())));
    found.map(Some).ok_or_else(wrong)
}

fn one_of(s: &Source, tag: &BytesStart, name: &str, words: &[&str]) -> Result<String, Fault> {
    let word = local(tag, name).unwrap_or(words[0].into());
    match words.contains(&&*word) {
        true => Ok(word.into_owned()),
        false => Err(s.fault(format!("{name} = {}; it must be one of {}", shown(word.as_bytes()), words.join(", ")))),
    }
}

impl Lattice {
    /// The element itself.
    pub(super) fn begin(s: &Source, tag: &BytesStart) -> Result<Lattice, Fault> {
        let needed = |name: &str| {
            positive(s, tag, name)?.ok_or_else(|| s.fault(format!("the attribute {name} of beamlattice is missing")))
        };
        let (radius, min_length) = (needed("radius")?, needed("minlength")?);
        let mode = one_of(s, tag, "ballmode", &["none", "mixed", "all"])?;
        let ball_radius = positive(s, tag, "ballradius")?;
        if mode != "none" && ball_radius.is_none() {
            return Err(s.fault(format!("ballmode is {mode}; ballradius is needed then")));
        }
        let mesh = optional::<u32>(s, tag, "clippingmesh")?;
        let clipping = one_of(s, tag, "clippingmode", &["none", "inside", "outside"])?;
        if clipping != "none" && mesh.is_none() {
            return Err(s.fault(format!("clippingmode is {clipping}; clippingmesh is needed then")));
        }
        Ok(Lattice {
            radius,
            min_length,
            mode,
            ball_radius: ball_radius.unwrap_or(f64::NAN),
            cap: cap(s, tag, "cap")?.unwrap_or_default(),
            clip: mesh.map(|m| (m, clipping)),
            shown: optional(s, tag, "representationmesh")?,
            properties: local(tag, "pid").is_some() && local(tag, "pindex").is_some(),
            ..Lattice::default()
        })
    }

    /// An element within it.
    pub(super) fn element(&mut self, s: &Source, tag: &BytesStart, name: &str) -> Result<(), Fault> {
        match name {
            "beams" => self.has_beams = true,
            "beam" => {
                let ends = [s.required(tag, "v1")?, s.required(tag, "v2")?];
                let (first, second) = (positive(s, tag, "r1")?, positive(s, tag, "r2")?);
                if ends[0] == ends[1] {
                    return Err(s.fault(format!("both ends of beam {} are vertex {}", self.beams.len(), ends[0])));
                }
                let first = first.unwrap_or(self.radius);
                let caps = [cap(s, tag, "cap1")?.unwrap_or(self.cap), cap(s, tag, "cap2")?.unwrap_or(self.cap)];
                self.beams.push(Frustum { ends, radii: [first, second.unwrap_or(first)], caps });
                self.own_properties |= ["p1", "p2", "pid"].iter().any(|n| local(tag, n).is_some());
            }
            "ball" => {
                let radius = positive(s, tag, "r")?.unwrap_or(f64::NAN);
                self.balls.push((s.required(tag, "vindex")?, radius));
                self.own_properties |= ["p", "pid"].iter().any(|n| local(tag, n).is_some());
            }
            "beamset" => {
                if let Some(id) = local(tag, "identifier")
                    && !self.identifiers.insert(id.to_string())
                {
                    return Err(s.fault(format!("two beam sets have the identifier {}", shown(id.as_bytes()))));
                }
            }
            "ref" => self.most_referred = self.most_referred.max(Some(s.required(tag, "index")?)),
            "ballref" => self.balls_referred = self.balls_referred.max(Some(s.required(tag, "index")?)),
            _ => {}
        }
        Ok(())
    }

    /// Whether all that it names is there: in the object `id`, of a type, after the objects that were read before.
    pub(super) fn check(
        &self,
        s: &Source,
        id: u32,
        object: &Object,
        earlier: &HashMap<u32, Object>,
    ) -> Result<(), Fault> {
        let wrong = |message: String| Err(s.fault(format!("the beam lattice of object {id}: {message}")));
        if !matches!(object.kind.as_str(), "model" | "solidsupport") {
            return wrong(format!(
                "the object's type is {}; it must be model or solidsupport",
                shown(object.kind.as_bytes())
            ));
        }
        if !self.has_beams {
            return wrong("the element beams is missing".into());
        }
        let count = object.vertices.len();
        let outside = |n: &u32| *n as usize >= count;
        if let Some((i, b)) = self.beams.iter().enumerate().find(|(_, b)| b.ends.iter().any(outside)) {
            return wrong(format!("beam {i} joins vertices {:?}, but there are {count} (from 0)", b.ends));
        }
        let mut ends = vec![false; count];
        self.beams.iter().flat_map(|b| b.ends).for_each(|n| ends[n as usize] = true);
        if let Some((i, (n, _))) =
            self.balls.iter().enumerate().find(|(_, b)| !ends.get(b.0 as usize).is_some_and(|e| *e))
        {
            return wrong(format!("ball {i} is at vertex {n}, at which no beam ends"));
        }
        if let Some(n) = self.most_referred.filter(|n| *n as usize >= self.beams.len()) {
            return wrong(format!("a set names beam {n}, but there are {} (from 0)", self.beams.len()));
        }
        if let Some(n) = self.balls_referred.filter(|n| *n as usize >= self.balls.len()) {
            return wrong(format!("a set names ball {n}, but there are {} (from 0)", self.balls.len()));
        }
        if self.own_properties && !self.properties && !object.properties {
            return wrong("beams have properties, so the lattice or its object needs pid and pindex".into());
        }
        for (name, mesh) in [("clippingmesh", self.clip.as_ref().map(|c| c.0)), ("representationmesh", self.shown)] {
            let Some(mesh) = mesh else { continue };
            let Some(found) = earlier.get(&mesh) else {
                return wrong(format!("{name} is {mesh}; no object before this one has that id"));
            };
            // Files of the consortium name a mesh with beams where nothing is clipped.
            let used = name != "clippingmesh" || self.clip.as_ref().is_some_and(|c| c.1 != "none");
            if used && (found.lattice.is_some() || !found.components.is_empty() || found.kind != "model") {
                return wrong(format!("{name} is {mesh}; it must be a mesh of type model without beams"));
            }
        }
        Ok(())
    }
}

/// Reads the beams that the build places, in mm; if it places none, all where they are defined. Meshes are left out.
pub fn read_beam_lattice(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let placed = lattices(bytes, Which::Placed)?;
    if !placed.beams.is_empty() {
        return Ok(placed);
    }
    let mut defined = lattices(bytes, Which::Lattices)?;
    if defined.beams.is_empty() {
        return Err(Fault::new("", "the file has no beam lattice; a mesh is read as a region ([region.mesh])"));
    }
    defined.remarks.push("the build places no beams: read where they are defined".into());
    Ok(defined)
}

/// The beams of some of the objects.
fn lattices(bytes: &[u8], which: Which) -> Result<BeamGraph, Fault> {
    let mut graph = BeamGraph { in_mm: true, ..BeamGraph::default() };
    let (mut short, mut clipped, mut triangles) = (0, 0, 0);
    place_all(bytes, which, &mut |placed: &PlacedObject| {
        let Some(lattice) = &placed.object.lattice else { return Ok(()) };
        let factor = similarity(&placed.matrix).ok_or_else(|| {
            Fault::new("", "a beam lattice is placed with a transform that is no similarity: round beams would be oval")
        })? * placed.unit;
        let first = graph.nodes.len() as u32;
        let mut balls = vec![f64::NAN; placed.vertices.len()];
        if lattice.mode == "all" {
            lattice.beams.iter().flat_map(|b| b.ends).for_each(|n| balls[n as usize] = lattice.ball_radius * factor);
        }
        if lattice.mode != "none" {
            let usual = |r: f64| if r.is_nan() { lattice.ball_radius } else { r };
            lattice.balls.iter().for_each(|(n, r)| balls[*n as usize] = usual(*r) * factor);
        }
        graph.nodes.extend(&placed.vertices);
        graph.radii.extend(balls);
        for beam in &lattice.beams {
            let [p, q] = beam.ends.map(|n| placed.object.vertices[n as usize]);
            if norm(sub(p, q)) < lattice.min_length {
                short += 1;
                continue;
            }
            graph.flat.push(beam.caps.map(|c| c != Cap::Sphere));
            graph.beams.push(beam.ends.map(|n| first + n));
            graph.beam_radii.push(beam.radii.map(|r| r * factor));
        }
        clipped += usize::from(lattice.clip.as_ref().is_some_and(|c| c.1 != "none"));
        triangles += placed.object.triangles.len();
        Ok(())
    })?;
    graph.drop_unused();
    for (count, what, done) in [
        (short, "beam", "shorter than the file's minlength left out"),
        (clipped, "mesh", "by which beams are clipped left out: the region cuts them"),
        (triangles, "triangle", "that are joined to beams left out"),
    ] {
        if count > 0 {
            graph.remarks.push(format!("{} {done}", counted(count, what)));
        }
    }
    Ok(graph)
}

/// By how much lengths grow under a similarity; `None` for another map.
fn similarity(m: &Mat3) -> Option<f64> {
    let factor = determinant(m).abs().cbrt();
    let column = |k: usize| [m[0][k], m[1][k], m[2][k]];
    let fits = |i: usize, j: usize| {
        let expected = if i == j { factor * factor } else { 0.0 };
        (dot(column(i), column(j)) - expected).abs() <= SIMILAR * factor * factor
    };
    (factor > 0.0 && (0..3).all(|i| (i..3).all(|j| fits(i, j)))).then_some(factor)
}

/// Number of lattices in a model.
pub(super) fn count(model: &Model) -> usize {
    model.objects.values().filter(|o| o.lattice.is_some()).count()
}
