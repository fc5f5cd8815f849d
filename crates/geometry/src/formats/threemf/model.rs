//! What a model of a 3MF file holds: objects, their uses, their beam lattices.

use std::collections::{HashMap, HashSet};
use std::io::BufRead;

use super::beam_lattice::{Cap, Frustum};
use crate::formats::xml::Scanner;
use crate::math::{IDENTITY, Mat3, Vec3, add, apply, product};

/// The text of a model.
pub(super) type Source<'a> = Scanner<&'a mut dyn BufRead>;

/// x ↦ m x + shift.
#[derive(Clone, Copy)]
pub(super) struct Placement {
    pub m: Mat3,
    pub shift: Vec3,
}

impl Placement {
    pub const NONE: Placement = Placement { m: IDENTITY, shift: [0.0; 3] };

    pub fn of(&self, x: Vec3) -> Vec3 {
        add(apply(&self.m, x), self.shift)
    }

    /// This one after `inner`.
    pub fn after(&self, inner: &Placement) -> Placement {
        Placement { m: product(&self.m, &inner.m), shift: self.of(inner.shift) }
    }
}

/// A use of an object: which file it is in (empty: the same), its number, and where it goes.
pub(super) struct ObjectReference {
    pub path: String,
    pub id: u32,
    pub placement: Placement,
}

/// An object of a model.
#[derive(Default)]
pub(super) struct Object {
    pub vertices: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub components: Vec<ObjectReference>,
    pub lattice: Option<Lattice>,
    /// The type: model, support and so on.
    pub kind: String,
    /// Its name; empty without one.
    pub name: String,
    /// Whether its mesh only stands for slices.
    pub slices: bool,
    /// Whether it has properties for what has none of its own.
    pub properties: bool,
}

impl Object {
    /// What one use of it costs: vertices, triangles and beams.
    pub fn size(&self) -> usize {
        self.vertices.len() + self.triangles.len() + self.lattice.as_ref().map_or(0, |l| l.beams.len())
    }

    pub fn is_support(&self) -> bool {
        matches!(self.kind.as_str(), "support" | "solidsupport")
    }
}

/// A model file.
#[derive(Default)]
pub(super) struct ModelFile {
    pub unit: f64,
    pub objects: HashMap<u32, Object>,
    pub items: Vec<ObjectReference>,
}

impl ModelFile {
    /// The number of its beam lattices.
    pub fn lattices(&self) -> usize {
        self.objects.values().filter(|o| o.lattice.is_some()).count()
    }
}

/// An object where the build has it.
pub(super) struct PlacedObject<'a> {
    pub object: &'a Object,
    /// The linear part of its placement.
    pub matrix: Mat3,
    /// Its vertices, mm.
    pub vertices: Vec<Vec3>,
    /// The file's unit, mm.
    pub unit: f64,
}

/// The beam lattice of an object, as it is read.
#[derive(Default)]
pub(super) struct Lattice {
    pub beams: Vec<Frustum>,
    /// Balls; NaN where the usual radius holds.
    pub balls: Vec<(u32, f64)>,
    pub identifiers: HashSet<String>,
    /// Greatest index of a beam and of a ball in a set.
    pub most_referred: Option<u32>,
    pub balls_referred: Option<u32>,
    pub radius: f64,
    pub cap: Cap,
    pub min_length: f64,
    pub mode: String,
    pub ball_radius: f64,
    /// The mesh that clips and its mode.
    pub clip: Option<(u32, String)>,
    pub shown: Option<u32>,
    pub has_beams: bool,
    pub properties: bool,
    /// Whether some beam or ball has properties of its own.
    pub own_properties: bool,
}
