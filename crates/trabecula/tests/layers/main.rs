//! Laws of layers: closed forms, volumes, topology, distances.

mod sharp_beams;

use std::sync::Arc;

use geometry::layer::Layer;
use geometry::progress::Silent;
use trabecula::layers::{Adaptive, Plan, Slicer};
use trabecula::region::{Cuboid, Sphere};
use trabecula::{Design, Field, NoFiles, Region, Solid};

fn solid(design: &str) -> Solid {
    let text = format!("schema = 1\nunits = \"mm\"\n{design}");
    let built = Design::from_toml(&text).and_then(|d| d.build(&NoFiles)).expect("a design");
    built.solid
}

/// A region without a lattice.
fn full(region: Region) -> Solid {
    Solid::new(region, None, 1.0)
}

fn plan(layer: f64, step: f64) -> Plan {
    Plan { layer, tolerance: 1e-3, step, adaptive: None, range: [None; 2] }
}

fn layers(solid: &Solid, plan: &Plan) -> Vec<Layer> {
    let slicer = Slicer::new(solid, plan).expect("a slicer");
    let mut out = Vec::new();
    let take = |l: Layer| {
        out.push(l);
        Ok(())
    };
    slicer.each(0..slicer.len(), &Silent, |_, l| l.clone(), take).expect("layers");
    out
}

fn volume(layers: &[Layer]) -> f64 {
    layers.iter().map(|l| l.area() * l.height()).sum()
}

const GYROID: &str = "region.box.size = [8, 8, 8]\n[lattice.a]\ncell = \"gyroid\"\npart = \"sheet\"\nmap.affine.wavelength = 4\nlevel.porosity = 0.7\n";

#[test]
fn spheres_and_boxes_have_their_areas() {
    let ball = full(Arc::new(Sphere::new([0.0; 3], 5.0).unwrap()));
    for layer in layers(&ball, &plan(0.5, 0.5)) {
        let want = std::f64::consts::PI * (25.0 - layer.z * layer.z);
        assert_eq!(layer.loops.len(), 1);
        // Points are shifted to the area, of which the fourth order is left, and rounded to single precision.
        assert!((layer.area() / want - 1.0).abs() < 2e-6, "{} of {want}", layer.area());
        for p in &layer.loops[0] {
            assert!((p[0].hypot(p[1]) - (25.0 - layer.z * layer.z).sqrt()).abs() < 1e-3);
        }
    }
    let cuboid = full(Arc::new(Cuboid::new([-5.0, -10.0, 0.0], [5.0, 10.0, 3.0]).unwrap()));
    let made = layers(&cuboid, &plan(0.25, 0.7));
    assert_eq!(made.len(), 12);
    for layer in made {
        assert_eq!(layer.loops.len(), 1);
        assert_eq!(layer.loops[0].len(), 4, "{:?}", layer.loops);
        assert!((layer.area() - 200.0).abs() < 1e-4);
    }
}

#[test]
fn layers_of_a_lattice_have_its_volume() {
    // The midpoint rule's own error is of second order in the layer height, and all cells have it alike here: it is a quarter
    // with half the height, and little is left of it at a 400th of the cell.
    for (layer, error) in [(0.02, 4e-5), (0.01, 1e-5)] {
        let share = volume(&layers(&solid(GYROID), &plan(layer, 0.25))) / 512.0;
        assert!((share - 0.3).abs() < error, "{layer}: {share}");
    }
}

#[test]
fn contours_are_within_the_tolerance_of_the_field() {
    let gyroid = solid(GYROID);
    for layer in layers(&gyroid, &plan(0.4, 0.25)) {
        for l in &layer.loops {
            for (i, a) in l.iter().enumerate() {
                let b = l[(i + 1) % l.len()];
                for t in [0.0, 0.25, 0.5, 0.75] {
                    let p = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), layer.z];
                    let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                    gyroid.gradients(&[p], &mut v, &mut g);
                    let off = v[0] / g[0][0].hypot(g[0][1]);
                    assert!(off.abs() < 1.05e-3, "{p:?} is {off} mm off");
                }
            }
        }
    }
}

#[test]
fn adaptive_layers_keep_to_the_cusp() {
    let ball = full(Arc::new(Sphere::new([0.0; 3], 5.0).unwrap()));
    let adaptive = Some(Adaptive { cusp: 0.05, least: 0.05 });
    let made = layers(&ball, &Plan { adaptive, ..plan(0.4, 0.5) });
    // The integral of |z| / r over the cusp is 100 layers; with thicknesses rounded down to multiples of the least it is 132.
    assert!((100..140).contains(&made.len()), "{}", made.len());
    for layer in &made {
        // On a ball the vertical component of the normal is |z| / r, greatest at the layer's outer face.
        let slope = layer.bottom.abs().max(layer.top.abs()) / 5.0;
        assert!(layer.height() <= 0.05 / slope + 0.05, "{layer:?}");
        assert!(layer.height() > 0.0499 || layer.top == 5.0);
    }
    assert!((volume(&made) / (4.0 / 3.0 * std::f64::consts::PI * 125.0) - 1.0).abs() < 1e-3);
}
