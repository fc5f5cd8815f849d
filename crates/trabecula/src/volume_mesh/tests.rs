//! Laws of volume meshes.

use super::*;
use crate::design::{Design, NoFiles};
use geometry::progress::Silent;

fn built(region: &str, cell: &str, part: &str) -> crate::design::Built {
    let text = format!(
        "schema = 1\nunits = \"mm\"\nregion.{region}\n[lattice.a]\ncell = \"{cell}\"\npart = \"{part}\"\n\
         map.affine.wavelength = 4\nlevel.fraction = 0.3\n"
    );
    Design::from_toml(&text).and_then(|d| d.build(&NoFiles)).expect("a design")
}

fn made(region: &str, options: &VolumeMeshOptions) -> MeshedVolume {
    built(region, "gyroid", "sheet").volume_mesh(options, &Silent).expect("a mesh")
}

const BOX: &str = "box = { min = [0, 0, 0], max = [4, 4, 4] }";

fn options(edge: f64) -> VolumeMeshOptions {
    VolumeMeshOptions { edge, of: VolumeTarget::Solid, order: 1, periodic: false, largest: false }
}

#[test]
fn meshes_conform_and_do_not_intersect_themselves() {
    for region in
        [BOX, "sphere.radius = 2.2", "cylinder = { base = [0, 0, 0], axis = [1, 1, 2], radius = 2, height = 3 }"]
    {
        let mesh = made(region, &options(0.25)).mesh;
        let (_, checked) = mesh.corners().checked().expect("a mesh without mistakes");
        assert_eq!((checked.pinched, checked.turned, checked.unused), (0, false, 0), "{region}");
        let (least, most) = mesh.angles().map_or((0.0, 180.0), |a| (a.min, a.max));
        assert!(least > 12.0 && most < 160.0, "{region}: {least} {most}");
    }
}

#[test]
fn nodes_on_curved_surfaces_of_quadratic_meshes_lie_on_them() {
    let design = built(BOX, "gyroid", "sheet");
    let made = design.volume_mesh(&VolumeMeshOptions { order: 2, ..options(0.3) }, &Silent).expect("a mesh");
    let mesh = made.mesh;
    let lattice = mesh.set("LATTICE").expect("its own surface");
    let points: Vec<Vec3> = lattice.nodes.iter().map(|n| mesh.nodes[*n as usize]).collect();
    let mut values = vec![0.0; points.len()];
    crate::field::Field::values(&design.solid, &points, &mut values);
    let on = values.iter().filter(|v| v.abs() < 1e-9).count();
    assert!(on + made.straight >= points.len(), "{on} of {}, {} straight", points.len(), made.straight);
    // The least det J at corners and edges is the fifth of the straight one's that is asked for.
    for i in 0..mesh.tets.len() {
        assert!((0..4).all(|c| mesh.jacobian(i, core::array::from_fn(|k| f64::from(u8::from(k == c)))) > 0.0));
    }
}

#[test]
fn domains_fill_the_region() {
    for (cell, part, names) in [("gyroid", "sheet", 3), ("primitive", "lower", 2)] {
        let all = VolumeMeshOptions { of: VolumeTarget::All, ..options(0.3) };
        let mesh = built(BOX, cell, part).volume_mesh(&all, &Silent).expect("a mesh").mesh;
        // Sums of a hundred thousand volumes.
        assert!((mesh.volume() - 64.0).abs() < 1e-10 && mesh.domains.len() == names);
        assert!(mesh.domain.windows(2).all(|d| d[0] <= d[1]));
    }
}

#[test]
fn nodes_of_a_lattice_over_tetrahedra_stay_in_the_region() {
    // Where the gradient of its field nearly vanishes, a value over it is no distance.
    let text = "schema = 1\nunits = \"mm\"\n[region]\ndifference = [\n\
                { cylinder = { base = [0, 0, 0], radius = 8, height = 4 } },\n\
                { cylinder = { base = [0, 0, -1], radius = 4, height = 6 } } ]\n\
                [lattice.a]\npart = \"lower\"\ncell.tet.name = \"iwp\"\nmap.tets.size = 4\nlevel.fraction = 0.3\n";
    let design = Design::from_toml(text).and_then(|d| d.build(&NoFiles)).expect("a design");
    let made = design.volume_mesh(&options(0.4), &Silent).expect("a mesh");
    // Shifts of up to a twentieth of an edge or so are not asked.
    let bounds = Aabb { min: [-8.0, -8.0, 0.0], max: [8.0, 8.0, 4.0] }.grown(0.04);
    assert!(made.mesh.nodes.iter().all(|p| bounds.distance(*p) == 0.0));
    assert!(made.deviation < 1.0, "{}", made.deviation);
}

/// Faces that bridge a strut have normals along it, which meet no surface: they were said to be a whole edge off.
#[test]
fn faces_across_a_thin_strut_are_as_far_off_as_its_surface() {
    let text = "schema = 1\nregion.box.size = [6, 6, 6]\n[beams.a]\nradius = 0.4\nstruts = [[0, 1], [1, 2], [2, 0], [2, 3]]\n\
                nodes = [[-2, -2, -2], [-0.5, -2, -2], [-1, -0.8, -2], [2, 2, 2]]\n";
    let design = Design::from_toml(text).and_then(|d| d.build(&NoFiles)).expect("a design");
    let made = design.volume_mesh(&options(0.5), &Silent).expect("a mesh");
    // A point within a strut or this near to it is at most its radius from its surface.
    assert!(made.deviation < 0.4, "{}", made.deviation);
}

/// A graded sheet of which the box cuts off a chip at a corner: a component of its own, left out on request, to the volume.
#[test]
fn the_largest_component_alone_is_kept_on_request() {
    let text = "schema = 1\nunits = \"mm\"\nregion.box.size = [12, 8, 8]\n[lattice.a]\ncell = \"gyroid\"\npart = \"sheet\"\n\
                map.affine.wavelength = 4\nlevel.fraction = { linear = { along = [1, 0, 0], stops = [[-6, 0.15], [6, 0.55]] } }\n";
    let design = Design::from_toml(text).and_then(|d| d.build(&NoFiles)).expect("a design");
    let all = design.volume_mesh(&options(4.0 / 24.0), &Silent).expect("a mesh");
    let one = design.volume_mesh(&VolumeMeshOptions { largest: true, ..options(4.0 / 24.0) }, &Silent).expect("a mesh");
    assert!(all.pieces > 1 && one.pieces == 1, "{} {}", all.pieces, one.pieces);
    assert!(one.loose > 0.0 && all.loose == 0.0);
    // Faces apart are balanced each by itself: the chip's volume is that of its unbalanced chords.
    let left = all.mesh.volume() - one.mesh.volume();
    assert!((one.loose / left - 1.0).abs() < 0.1, "{} {left}", one.loose);
}
