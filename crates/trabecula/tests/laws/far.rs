//! Surfaces far from the origin, where single precision is coarse: files are closed and embedded, or refused.

use std::io::Cursor;

use geometry::formats::read_mesh;
use geometry::measure::{defects, non_manifold_vertices, self_intersections};
use geometry::progress::{Silent, Stopped};
use proptest::prelude::*;
use trabecula::design::{Design, NoFiles};
use trabecula::extract::GridSurface;
use trabecula::surface_maker::{Islands, SurfaceMaker, SurfaceOptions};

use crate::common::cases;

/// Parts about 3 mm across, in which a curved face, an edge, a skin or a keep zone meets the lattice.
fn part(kind: usize, [x, y, z]: [f64; 3]) -> String {
    let cube = format!("{{ size = [2.5, 2.3, 2.1], center = [{x}, {y}, {z}] }}");
    let round = format!("{{ center = [{x}, {y}, {}], radius = 1.1 }}", z + 0.3);
    match kind {
        0 => format!("[region]\nsphere = {round}\n"),
        1 => format!("[region]\nbox = {cube}\n[skin]\nthickness = 0.2\n"),
        2 => format!("[region]\ndifference = [{{ box = {cube} }}, {{ sphere = {round} }}]\n"),
        _ => format!("[region]\nbox = {cube}\n[keep.ball]\nsphere = {round}\n"),
    }
}

/// The flaws of the STL file of a part, as it is read again.
fn flaws(part: &str, edge: f64) -> Result<[usize; 6], Stopped> {
    let core =
        "[lattice.core]\ncell = \"gyroid\"\npart = \"sheet\"\nmap.affine.wavelength = 1.5\nlevel.fraction = 0.3\n";
    let design = Design::from_toml(&format!("schema = 1\n{part}{core}")).expect("design");
    let built = design.build(&NoFiles).expect("solid");
    let mut file = Cursor::new(Vec::new());
    let options = SurfaceOptions { resolution: edge, islands: Islands::Keep };
    GridSurface(&built.solid).stream_stl(&options, &mut file, &Silent)?;
    let mesh = read_mesh(&file.into_inner(), "stl").expect("file").mesh;
    assert!(mesh.triangles.len() > 1000);
    let found = defects(&mesh);
    Ok([
        found.open_edges,
        found.crowded_edges,
        found.duplicate_triangles,
        found.degenerate_triangles,
        non_manifold_vertices(&mesh),
        self_intersections(&mesh, 10),
    ])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(12) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    /// Steps of 0.06 mm are 100 to 5000 units in the last place of single precision there.
    #[test]
    fn files_of_parts_far_away_are_closed_or_refused(
        kind in 0..4usize,
        far in 2.0..3.7f64,
        along in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let center = along.map(|c| c.signum() * (0.3 + 0.7 * c.abs()) * 10f64.powf(far));
        match flaws(&part(kind, center), 0.06) {
            Ok(found) => prop_assert_eq!(found, [0; 6]),
            Err(Stopped::Refused(fault)) => prop_assert!(fault.to_string().contains("single precision"), "{}", fault),
            Err(other) => panic!("{other:?}"),
        }
    }
}

/// At 200 mm nothing needs to be refused; three of these had files with triangles without area.
#[test]
fn parts_at_two_hundred_millimetres_are_made() {
    for kind in 0..4 {
        let found = flaws(&part(kind, [200.3, 200.1, 200.7]), 0.05).expect("file");
        assert_eq!(found, [0; 6], "kind {kind}");
    }
}
