//! 3MF with the beam lattice extension 1.2.0: frusta of cones between nodes, and balls at nodes.
//!
//! Source: 3MF Consortium, Beam Lattice Extension 1.2.0.

use std::borrow::Cow;
use std::io::{self, Write};

use super::{DeflatedChunk, ModelWriter, push_mesh, quoted};
use crate::formats::number::{push_f32, push_u32};
use crate::formats::{ByteSpool, Indexed, Metadata, in_order, invalid};
use crate::math::Vec3;

/// Namespaces of the extension and of its balls.
const BEAMS: &str = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02";
const BALLS: &str = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07";
/// The least length of beams that readers do not leave out, unless some are about as short, mm.
const MIN_LENGTH: f64 = 1e-4;
/// Rows made at once.
const CHUNK: usize = 1 << 14;

/// The end of a beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cap {
    /// A ball of the beam's radius there.
    #[default]
    Sphere,
    /// Half such a ball.
    Hemisphere,
    /// A disc.
    Butt,
}

impl Cap {
    /// All of them.
    pub const ALL: [Cap; 3] = [Cap::Sphere, Cap::Hemisphere, Cap::Butt];

    /// Its word in files.
    pub fn word(self) -> &'static str {
        match self {
            Cap::Sphere => "sphere",
            Cap::Hemisphere => "hemisphere",
            Cap::Butt => "butt",
        }
    }
}

/// A beam: the frustum of a cone between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Indices of the nodes.
    pub ends: [u32; 2],
    /// Radii there, mm.
    pub radii: [f64; 2],
    /// Its ends.
    pub caps: [Cap; 2],
}

/// Frusta and balls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BeamLattice {
    /// Nodes, mm.
    pub nodes: Vec<Vec3>,
    /// Beams.
    pub beams: Vec<Frustum>,
    /// Balls: the node and the radius, mm.
    pub balls: Vec<(u32, f64)>,
    /// Sets of beams by name.
    pub sets: Vec<(String, Vec<u32>)>,
}

/// Meshes that go with a lattice.
#[derive(Clone, Copy, Default)]
pub struct CompanionMeshes<'a> {
    /// What is left of the lattice lies in this.
    pub clip: Option<&'a dyn Indexed>,
    /// What programs show that do not know the extension, and others while they load.
    pub shown: Option<&'a dyn Indexed>,
}

/// Writes a lattice. Coordinates and radii are rounded to single precision, which is what readers of the format hold; whole
/// decimals of up to seven digits come back as they were. The bytes do not depend on the number of threads.
///
/// **Errors**: whatever `out` and `aside` report; `InvalidInput` for more than 2³¹ − 1 nodes or beams.
pub fn write_beam_lattice(
    lattice: &BeamLattice,
    meshes: CompanionMeshes,
    meta: &Metadata,
    aside: &mut dyn ByteSpool,
    out: &mut dyn Write,
) -> io::Result<()> {
    if lattice.nodes.len().max(lattice.beams.len()) >= i32::MAX as usize {
        return Err(invalid(format!("3MF counts to {}: the lattice has more nodes or beams", i32::MAX)));
    }
    let mut model = ModelWriter::new(aside);
    let balls = !lattice.balls.is_empty();
    let (of_balls, required) = if balls { (format!(" xmlns:b2=\"{BALLS}\""), "b b2") } else { (String::new(), "b") };
    let attributes = format!(
        " xmlns:b=\"{BEAMS}\"{of_balls} xmlns:trabecula=\"urn:trabecula:design\" requiredextensions=\"{required}\""
    );
    let mut head = format!("{}{}<resources>\n", ModelWriter::head(&attributes), meta.elements());
    let mut id = 0;
    let mut references = String::new();
    for (name, mesh, attribute) in
        [("clip", meshes.clip, " clippingmode=\"inside\" clippingmesh"), ("shown", meshes.shown, " representationmesh")]
    {
        let Some(mesh) = mesh else { continue };
        id += 1;
        head.push_str(&format!("<object id=\"{id}\" type=\"model\" name=\"{name}\">\n<mesh>\n<vertices>\n"));
        model.push(DeflatedChunk::of(head.as_bytes()))?;
        push_mesh(&mut model, mesh)?;
        head = "</triangles>\n</mesh>\n</object>\n".into();
        references.push_str(&format!("{attribute}=\"{id}\""));
    }
    id += 1;
    let name = if meta.title.is_empty() { String::new() } else { format!(" name=\"{}\"", quoted(&meta.title)) };
    head.push_str(&format!("<object id=\"{id}\" type=\"model\"{name}>\n<mesh>\n<vertices>\n"));
    model.push(DeflatedChunk::of(head.as_bytes()))?;
    super::push_vertices(&mut model, lattice.nodes.len(), |r| Ok(Cow::Borrowed(&lattice.nodes[r])))?;
    push_lattice(&mut model, lattice, &references)?;
    let tail = format!("</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"{id}\"/>\n</build>\n</model>\n");
    model.push(DeflatedChunk::of(tail.as_bytes()))?;
    model.finish(out)
}

/// What most beams have in common: it is not repeated.
struct BeamDefaults {
    radius: f32,
    cap: Cap,
}

impl BeamDefaults {
    fn of(lattice: &BeamLattice) -> BeamDefaults {
        let mut radii: Vec<f32> = lattice.beams.iter().map(|b| b.radii[0] as f32).collect();
        let middle = radii.len() / 2;
        let radius = if radii.is_empty() { 1.0 } else { *radii.select_nth_unstable_by(middle, f32::total_cmp).1 };
        let count = |cap: Cap| lattice.beams.iter().flat_map(|b| b.caps).filter(|c| *c == cap).count();
        let cap = Cap::ALL.into_iter().rev().max_by_key(|c| count(*c)).unwrap_or_default();
        BeamDefaults { radius, cap }
    }

    /// Appends the row of a beam.
    fn push(&self, beam: &Frustum, text: &mut Vec<u8>) {
        let mut number = |name: &str, v: u32| {
            text.extend_from_slice(name.as_bytes());
            push_u32(text, v);
        };
        number("<b:beam v1=\"", beam.ends[0]);
        number("\" v2=\"", beam.ends[1]);
        let [a, b] = beam.radii.map(|r| r as f32);
        if a != self.radius || b != self.radius {
            text.extend_from_slice(b"\" r1=\"");
            push_f32(text, a);
            if b != a {
                text.extend_from_slice(b"\" r2=\"");
                push_f32(text, b);
            }
        }
        for (name, cap) in ["cap1", "cap2"].into_iter().zip(beam.caps) {
            if cap != self.cap {
                text.extend_from_slice(format!("\" {name}=\"{}", cap.word()).as_bytes());
            }
        }
        text.extend_from_slice(b"\"/>\n");
    }
}

/// Adds beams, balls and sets, after the nodes.
fn push_lattice(model: &mut ModelWriter, lattice: &BeamLattice, references: &str) -> io::Result<()> {
    let defaults = BeamDefaults::of(lattice);
    let length = |b: &Frustum| {
        let [p, q] = b.ends.map(|n| lattice.nodes[n as usize]);
        crate::math::norm(crate::math::sub(p, q))
    };
    let shortest = lattice.beams.iter().map(length).fold(f64::INFINITY, f64::min);
    let least = MIN_LENGTH.min(0.5 * shortest) as f32;
    let balls = match lattice.balls.first() {
        Some((_, radius)) => format!(" b2:ballmode=\"mixed\" b2:ballradius=\"{}\"", *radius as f32),
        None => String::new(),
    };
    let mut text = format!("</vertices>\n<b:beamlattice radius=\"{}\" minlength=\"", defaults.radius).into_bytes();
    push_f32(&mut text, least);
    let cap = defaults.cap.word();
    text.extend_from_slice(format!("\" cap=\"{cap}\"{references}{balls}>\n<b:beams>\n").as_bytes());
    let mut put = |piece| model.push(piece);
    put(DeflatedChunk::of(&text))?;
    let rows = |r: std::ops::Range<usize>| {
        let mut text = Vec::with_capacity(r.len() * 48);
        lattice.beams[r].iter().for_each(|b| defaults.push(b, &mut text));
        Ok(DeflatedChunk::of(&text))
    };
    in_order(lattice.beams.len(), CHUNK, rows, &mut put)?;
    put(DeflatedChunk::of(b"</b:beams>\n"))?;
    if !lattice.sets.is_empty() {
        put(DeflatedChunk::of(b"<b:beamsets>\n"))?;
        for (name, members) in &lattice.sets {
            let name = quoted(name);
            put(DeflatedChunk::of(format!("<b:beamset name=\"{name}\" identifier=\"{name}\">\n").as_bytes()))?;
            let rows = |r: std::ops::Range<usize>| {
                let mut text = Vec::with_capacity(r.len() * 24);
                for index in &members[r] {
                    text.extend_from_slice(b"<b:ref index=\"");
                    push_u32(&mut text, *index);
                    text.extend_from_slice(b"\"/>\n");
                }
                Ok(DeflatedChunk::of(&text))
            };
            in_order(members.len(), CHUNK, rows, &mut put)?;
            put(DeflatedChunk::of(b"</b:beamset>\n"))?;
        }
        put(DeflatedChunk::of(b"</b:beamsets>\n"))?;
    }
    if !lattice.balls.is_empty() {
        put(DeflatedChunk::of(b"<b2:balls>\n"))?;
        let rows = |r: std::ops::Range<usize>| {
            let mut text = Vec::with_capacity(r.len() * 36);
            for (node, radius) in &lattice.balls[r] {
                text.extend_from_slice(b"<b2:ball vindex=\"");
                push_u32(&mut text, *node);
                text.extend_from_slice(b"\" r=\"");
                push_f32(&mut text, *radius as f32);
                text.extend_from_slice(b"\"/>\n");
            }
            Ok(DeflatedChunk::of(&text))
        };
        in_order(lattice.balls.len(), CHUNK, rows, &mut put)?;
        put(DeflatedChunk::of(b"</b2:balls>\n"))?;
    }
    put(DeflatedChunk::of(b"</b:beamlattice>\n"))
}
