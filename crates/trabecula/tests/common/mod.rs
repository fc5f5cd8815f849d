//! What several suites need: the judge of a surface, a lattice, random numbers.
#![allow(dead_code)]

use std::collections::HashSet;
use std::sync::Arc;

use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::Surface;
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Affine, Map};
use trabecula::measure::{non_manifold_vertices, self_intersections, size};
use trabecula::mesh::Mesh;

/// What keeps a surface, as its file in single precision holds it, from bounding a solid.
pub fn fault(s: &Surface) -> Option<&'static str> {
    let vertices: Vec<[f64; 3]> = s
        .mesh
        .vertices
        .iter()
        .map(|v| v.map(|x| f64::from(x as f32) + 0.0))
        .collect();
    let places: HashSet<[u64; 3]> = vertices.iter().map(|v| v.map(f64::to_bits)).collect();
    let m = Mesh {
        vertices,
        triangles: s.mesh.triangles.clone(),
    };
    if places.len() < m.vertices.len() {
        Some("vertices fall together")
    } else if !size(&m).closed {
        Some("open")
    } else if non_manifold_vertices(&m) > 0 {
        Some("a vertex with two fans")
    } else if self_intersections(&m, 1) > 0 {
        Some("crosses itself")
    } else {
        None
    }
}

/// A lattice of one wavelength, turned.
pub fn lattice(name: &str, part: Part, fraction: f64, wavelength: f64) -> Arc<dyn Field> {
    let cell = Cell::new(Series::new(named(name).expect(name).terms()).expect(name));
    let map = Affine::rigid([wavelength; 3], [11.0, 22.0, 33.0], [0.0; 3], &[]).expect("map");
    let level = Level::Fraction(Grade::Constant(fraction));
    Arc::new(Lattice::new(Arc::new(cell), Map::Affine(map), part, level))
}

/// Random designs in one run: `make campaign` asks for more.
pub fn cases(few: u64) -> u64 {
    let asked = std::env::var("TRABECULA_CASES").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(few)
}

/// Random numbers, the same for the same seed (splitmix64).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// Below n.
    pub fn below(&mut self, n: usize) -> usize {
        (self.share() * n as f64) as usize
    }

    /// Each coordinate in [−reach, reach).
    pub fn point(&mut self, reach: f64) -> [f64; 3] {
        [0; 3].map(|_| self.between(-reach, reach))
    }
}
