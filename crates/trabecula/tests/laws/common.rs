//! What several suites need: regions, lattices, the judge of a surface, random numbers.

use std::collections::HashSet;
use std::io::Cursor;
use std::sync::Arc;

use geometry::math::{Aabb, Mat3, Vec3, dot, norm};
use geometry::measure::{non_manifold_vertices, self_intersections, size};
use geometry::mesh::Mesh;
use geometry::progress::{Silent, Stopped};
use geometry::random::random;
use geometry::surface_mesh::SurfaceMesh;
use proptest::prelude::*;
use trabecula::cell::{Cell, Part, Series, catalogue, named};
use trabecula::extract::GridSurface;
use trabecula::grade::Grade;
use trabecula::implicit::Implicit;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::Affine;
use trabecula::region::{Cuboid, Cylinder, Difference, HalfSpace, Intersection, Region, Sphere, Union};
use trabecula::solid::Solid;
use trabecula::surface_maker::{Components, Islands, Summary, SurfaceMaker, SurfaceOptions};

pub fn ball(center: Vec3, radius: f64) -> Region {
    Arc::new(Sphere::new(center, radius).expect("ball"))
}

pub fn cuboid(min: Vec3, max: Vec3) -> Region {
    Arc::new(Cuboid::new(min, max).expect("box"))
}

/// Points spread evenly over a box.
pub fn points(b: &Aabb, n: usize) -> impl Iterator<Item = Vec3> {
    let b = *b;
    (1..=n).map(move |i| {
        let s = [0.8191725, 0.6710436, 0.5497005].map(|s| (s * i as f64).fract());
        core::array::from_fn(|a| b.min[a] + s[a] * b.size()[a])
    })
}

/// Random points in a region.
pub fn within(region: &Region, count: usize, seed: u64) -> Vec<Vec3> {
    let (b, mut seed) = (region.bounds(), seed);
    let mut points = Vec::new();
    while points.len() < count {
        let p = [0, 1, 2].map(|a| b.center()[a] + 0.5 * b.size()[a] * random(&mut seed));
        if region.value(p) < 0.0 {
            points.push(p);
        }
    }
    points
}

/// The angle (degrees) between a line and the nearest of the axes of a map with this Jacobian.
pub fn off_axis(jacobian: &Mat3, along: Vec3) -> f64 {
    let cosine = jacobian.iter().map(|k| dot(*k, along).abs() / norm(*k)).fold(0.0, f64::max);
    cosine.min(1.0).acos().to_degrees()
}

pub fn mean(of: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = of.collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Regions of all kinds, by three numbers about one.
pub fn region(kind: usize, r: f64, s: f64, t: f64) -> Region {
    let cylinder = |axis| Arc::new(Cylinder::new([s, -s, -t], axis, r * 0.7, 1.0 + t).expect("cylinder")) as Region;
    let block = || cuboid([-r, -1.0, -t], [t, r, 1.0]);
    match kind {
        0 => block(),
        1 => ball([0.0; 3], r),
        2 => cylinder([0.0, 0.0, 1.0]),
        3 => cylinder([0.3, 0.2 + s, 1.0]),
        4 => Arc::new(Union::new(vec![block(), ball([0.0; 3], r)]).expect("union")),
        5 => Arc::new(Difference::new(vec![block(), cylinder([1.0, 0.0, 0.0])]).expect("difference")),
        _ => {
            let half = HalfSpace::new([s, 0.0, 0.1], [s, 1.0, 0.5]).expect("half-space");
            let parts = vec![ball([0.0; 3], r), Arc::new(half) as Region];
            Arc::new(Intersection::new(parts).expect("intersection"))
        }
    }
}

/// A named cell at a fraction, through a rigid map.
pub fn lattice(name: &str, part: Part, fraction: f64, wavelength: Vec3, rotate: Vec3) -> Arc<dyn Implicit> {
    let level = Level::Fraction(Grade::Constant(fraction));
    lattice_at(name, part, level, wavelength, rotate)
}

/// The same at any level.
pub fn lattice_at(name: &str, part: Part, level: Level, wavelength: Vec3, rotate: Vec3) -> Arc<dyn Implicit> {
    let cell = Cell::new(Series::new(named(name).expect(name).terms()).expect(name));
    let map = Affine::rigid(wavelength, rotate, [0.0; 3], &[]).expect("map");
    Arc::new(Lattice::new(Arc::new(cell), Arc::new(map), part, level))
}

/// What a lattice is made of.
#[derive(Clone, Debug)]
pub struct Drawn {
    name: &'static str,
    part: Part,
    fraction: f64,
    wavelength: Vec3,
    rotate: Vec3,
}

impl Drawn {
    pub fn lattice(&self) -> Arc<dyn Implicit> {
        lattice(self.name, self.part, self.fraction, self.wavelength, self.rotate)
    }
}

prop_compose! {
    /// Any named cell, part and fraction, stretched and turned.
    pub fn drawn()(
        cell in prop::sample::select(catalogue()),
        part in prop::sample::select(vec![Part::Sheet, Part::Lower, Part::Upper]),
        fraction in 0.03..0.97f64,
        rotate in prop::array::uniform3(-180.0..180.0f64),
        wavelength in prop::array::uniform3(0.5..1.5f64),
    ) -> Drawn {
        Drawn { name: cell.name, part, fraction, wavelength, rotate }
    }
}

pub fn solid(region: Region, field: Option<Arc<dyn Implicit>>) -> Solid {
    Solid::new(region, field, 1.0)
}

/// The mesh as files in single precision hold it; −0 is 0.
pub fn rounded(mesh: &Mesh) -> Mesh {
    let place = |v: &Vec3| v.map(|x| f64::from(x as f32) + 0.0);
    Mesh { vertices: mesh.vertices.iter().map(place).collect(), triangles: mesh.triangles.clone() }
}

/// What keeps a mesh, as its file holds it, from bounding a solid.
pub fn fault(mesh: &Mesh) -> Option<&'static str> {
    let m = rounded(mesh);
    let places: HashSet<[u64; 3]> = m.vertices.iter().map(|v| v.map(f64::to_bits)).collect();
    let degenerate = |i: usize| {
        let [a, b, c] = m.corners(i);
        a == b || b == c || c == a
    };
    if places.len() < m.vertices.len() {
        Some("vertices fall together")
    } else if (0..m.triangles.len()).any(degenerate) {
        Some("a degenerate triangle")
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

/// Every guarantee.
pub fn check(what: &str, s: &SurfaceMesh) {
    assert_eq!(s.cut.len(), s.mesh.triangles.len(), "{what}");
    if let Some(why) = fault(&s.mesh) {
        panic!("{what}: {why}");
    }
}

/// What keeps a solid's surface from bounding one, in memory or streamed: tiles that a vertex is common to must each put
/// it in the same place.
pub fn fault_of(solid: &Solid, edge: f64, s: &SurfaceMesh) -> Option<&'static str> {
    fault(&s.mesh).or_else(|| match stream(solid, edge, Islands::Keep) {
        Ok((bytes, _)) if bytes == stl(s) => None,
        _ => Some("streamed otherwise"),
    })
}

/// Every guarantee, in memory and streamed.
pub fn check_both(what: &str, solid: &Solid, edge: f64, s: &SurfaceMesh) {
    if let Some(why) = fault_of(solid, edge, s) {
        panic!("{what}: {why}");
    }
}

/// A solid as a streamed STL.
pub fn stream(solid: &Solid, edge: f64, islands: Islands) -> Result<(Vec<u8>, Summary), Stopped> {
    let mut stl = Cursor::new(Vec::new());
    let summary = GridSurface(solid).stream_stl(&SurfaceOptions { resolution: edge, islands }, &mut stl, &Silent)?;
    Ok((stl.into_inner(), summary))
}

/// The surface that a method makes, and its connected components.
pub fn meshed(
    maker: &dyn SurfaceMaker,
    resolution: f64,
    islands: Islands,
) -> Result<(SurfaceMesh, Components), Stopped> {
    let made = maker.mesh(&SurfaceOptions { resolution, islands }, &Silent)?;
    Ok((made.surface, made.components))
}

/// The mesh as a file of its triangles in their order.
pub fn stl(s: &SurfaceMesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    geometry::formats::write_mesh(&s.mesh, "stl", &Default::default(), &mut bytes).expect("memory");
    bytes
}

/// Random designs in one run: `few`, or as many as TRABECULA_CASES names, which `make campaign` sets.
pub fn cases(few: u64) -> u64 {
    asked().unwrap_or(few)
}

/// Whether all combinations of a fixed list are run, as in `make campaign`, or a selection that has every entry once.
pub fn campaign() -> bool {
    asked().is_some()
}

/// The rows of a fixed list that are run: the first `few`, or all in `make campaign`.
pub fn rows<T>(few: usize, all: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    all.into_iter().take(if campaign() { usize::MAX } else { few })
}

fn asked() -> Option<u64> {
    std::env::var("TRABECULA_CASES").ok()?.parse().ok()
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
