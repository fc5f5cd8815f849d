//! Shells: nodes on the mid-surface, thickness between the faces, the border, quadratic edges.

use std::sync::Arc;

use geometry::math::{Vec3, norm, sub};
use geometry::progress::Silent;
use proptest::prelude::*;
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::Affine;
use trabecula::shell_mesh::{ShellMeshOptions, shell_mesh};

use crate::common::{ball, cases, cuboid, solid};

/// The value of one field at one point.
fn value(field: &dyn Field, p: Vec3) -> f64 {
    let mut v = [0.0];
    field.values(&[p], &mut v);
    v[0]
}

fn sheet(name: &str, level: Level, rotate: Vec3) -> Arc<Lattice> {
    let cell = Cell::new(Series::new(named(name).expect(name).terms()).expect(name));
    let map = Affine::rigid([1.0; 3], rotate, [0.0; 3], &[]).expect("map");
    Arc::new(Lattice::new(Arc::new(cell), Arc::new(map), Part::Sheet, level))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(6) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    /// 40 cases in `make campaign`.
    #[test]
    fn random_sheets_have_shells_between_their_faces(
        name in prop::sample::select(vec!["gyroid", "diamond", "primitive", "iwp", "neovius"]),
        fraction in 0.1..0.35f64,
        rotate in prop::array::uniform3(-40.0..40.0f64),
        round in any::<bool>(),
    ) {
        let sheet = sheet(name, Level::Fraction(Grade::Constant(fraction)), rotate);
        let region = if round { ball([0.1, 0.0, -0.2], 1.0) } else { cuboid([-0.7; 3], [0.8, 0.9, 1.0]) };
        let whole = solid(region, Some(sheet.clone()));
        let options = |quadratic| ShellMeshOptions { edge: 1.0 / 16.0, quadratic };
        let make = |quadratic| shell_mesh(&whole, &[], &options(quadratic), &Silent).expect("shells");
        let (linear, made) = (make(false).mesh, make(true));
        let mesh = &made.mesh;
        prop_assert_eq!(&mesh.triangles, &linear.triangles);
        prop_assert_eq!(&mesh.nodes[..linear.nodes.len()], &linear.nodes[..]);
        let border = mesh.set("BORDER").expect("a border");
        // |u| − t is least where u = 0; the level does not vary. On a curved border nodes are the mesh's own; middles of edges that are
        // short may be off and are counted.
        let exact = |n: usize| !round || border.nodes.binary_search(&(n as u32)).is_err();
        let t = sheet.uniform().expect("one level");
        let off: Vec<usize> = (0..mesh.nodes.len())
            .filter(|n| exact(*n) && (value(&*sheet, mesh.nodes[*n]) + t).abs() > 1e-9)
            .collect();
        prop_assert!(mesh.thickness.iter().all(|t| *t > 0.0));
        prop_assert!(off.len() <= made.straight && off.iter().all(|n| *n >= linear.nodes.len()), "{:?}", off);
        prop_assert!(off.len() * 1000 < mesh.nodes.len(), "{} of {}", off.len(), mesh.nodes.len());
        // Every edge of the border is on a bounding plane, or straight; and a closed curve: each node has two.
        let on_planes: usize =
            ["X0", "X1", "Y0", "Y1", "Z0", "Z1"].iter().filter_map(|s| mesh.set(s)).map(|s| s.faces.len()).sum();
        let all = if round { made.straight >= border.faces.len() } else { on_planes == border.faces.len() };
        prop_assert!(all, "{} straight, {} on planes, {} in all", made.straight, on_planes, border.faces.len());
        let mut ends = vec![0; linear.nodes.len()];
        border.faces.iter().flat_map(|e| mesh.edge(*e).take(2)).for_each(|n| ends[n as usize] += 1);
        prop_assert!(ends.iter().all(|n| *n == 0 || *n == 2));
        // Quadratic edges are nearly as long as straight ones: the middle is within a fifth of the length.
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]].map(|n| mesh.nodes[n as usize]);
                let mean = [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
                let off = norm(sub(mesh.nodes[mesh.middles[t][k] as usize], mean));
                prop_assert!(off <= 0.2 * norm(sub(b, a)) + 1e-12);
            }
        }
    }
}

#[test]
fn the_thickness_integrates_to_the_volume() {
    // Exact fractions of whole cells; the share t² K / 12 of a wall that bends is -0.5 % for these, at 8 % of a cell.
    for (name, width, euler) in [("gyroid", 0.08, -8.0), ("diamond", 0.05, -16.0), ("primitive", 0.08, -4.0)] {
        let sheet = sheet(name, Level::Thickness(Grade::Constant(width)), [0.0; 3]);
        let region = cuboid([0.0; 3], [1.0; 3]);
        let fraction = sheet.fraction(0.5 * width);
        let whole = solid(region, Some(sheet));
        let made =
            shell_mesh(&whole, &[], &ShellMeshOptions { edge: 1.0 / 40.0, quadratic: false }, &Silent).expect("shells");
        let (area, volume) = made.mesh.size();
        println!(
            "{name}: area {area:.4}, thickness {:.5} of {width}, volume {volume:.5} for {fraction:.5}",
            volume / area
        );
        assert!((volume / area / width - 1.0).abs() < 2e-3, "{name}: {}", volume / area);
        // Gauss and Bonnet: ∫ K dA of a periodic sheet is 2π times its Euler number, -4, -8 or -16 in a cell.
        let bent = width.powi(3) / 12.0 * std::f64::consts::TAU * euler;
        assert!((volume + bent - fraction).abs() < 3e-3 * fraction, "{name}: {} for {fraction}", volume + bent);
    }
}
