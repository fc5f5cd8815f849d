//! Reading of the beam lattice extension of 3MF, with what it demands of files.
//!
//! Source: 3MF Consortium, Beam Lattice Extension 1.2.0. Names count without their prefixes: some files have balls in the namespace of
//! beams.

use std::collections::HashMap;

use quick_xml::events::BytesStart;

use super::beam_lattice::{Cap, Frustum};
use super::model::{Lattice, Object, Source};
use crate::fault::Fault;
use crate::formats::text::shown;
use crate::formats::xml::attribute_where;

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
