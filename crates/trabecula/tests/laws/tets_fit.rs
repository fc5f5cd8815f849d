//! How tetrahedral meshes fit their region: volumes outside it, features that are not kept, distances both ways.

use std::sync::Arc;

use crate::common::{Random, ball, cuboid};
use crate::tets::{fit_of, mesh, sag, sound};
use geometry::math::{Vec3, add, norm, rotation, scale, sub};
use geometry::similarity::Similarity;
use geometry::tetmesh::surface_fit::LostKind;
use trabecula::grade::Grade;
use trabecula::region::{Cylinder, Difference, Region, Union};

/// The volume of tetrahedra outside the region is none for a box however it is turned; for a hole, into which flat faces bulge, it is that of many points
/// of each.
#[test]
fn the_volume_outside_the_region_is_known() {
    let space = cuboid([0.0; 3], [2.0, 1.6, 1.0]);
    for turn in [[30.0, 20.0, 10.0], [0.0, 0.0, 45.0], [77.0, -31.0, 5.0]] {
        let by = Similarity::new(1.0, rotation(turn), [0.0; 3], [0.3, -0.2, 7.0]);
        let (mesh, fit) = mesh(&space.clone().moved(&by).expect("turned"), &Grade::Constant(0.3));
        sound("turned", &mesh);
        // Planes are met to the rounding of their coordinates.
        assert!((mesh.volume() / 3.2 - 1.0).abs() < 1e-9);
        assert!(fit.gained < 1e-9 && fit.missed < 1e-9, "{turn:?}: {} {}", fit.gained, fit.missed);
    }
    let mut random = Random(7);
    for size in [0.2, 0.35] {
        let center = [0.9, 0.8, 0.5];
        let parts = vec![cuboid([0.0; 3], [2.0, 1.6, 1.2]), ball(center, 0.4)];
        let space: Region = Arc::new(Difference::new(parts).expect("hole"));
        let (mesh, fit) = mesh(&space, &Grade::Constant(size));
        let mut outside = 0.0;
        for i in 0..mesh.tets.len() {
            let corners = mesh.corners(i);
            let is_outside = (0..200).filter(|_| {
                // Evenly spread barycentric coordinates: the differences of three ordered numbers.
                let mut cuts = [0; 3].map(|_| random.between(0.0, 1.0));
                cuts.sort_by(f64::total_cmp);
                let weights = [cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1.0 - cuts[2]];
                let p = corners.iter().zip(weights).fold([0.0; 3], |sum, (c, w)| add(sum, scale(*c, w)));
                norm(sub(p, center)) < 0.4
            });
            outside += is_outside.count() as f64 / 200.0 * geometry::tetmesh::volume(corners);
        }
        // The root of the number of samples outside, some hundreds to thousands, three times.
        assert!((fit.gained / outside - 1.0).abs() < 0.15, "{size}: {} for {outside}", fit.gained);
    }
}

/// A block of 12 × 12 × 6 mm less one part, or with one more.
fn marred(of: Region, less: bool) -> Region {
    let block = cuboid([0.0; 3], [12.0, 12.0, 6.0]);
    if less {
        return Arc::new(Difference::new(vec![block, of]).expect("difference"));
    }
    Arc::new(Union::new(vec![block, of]).expect("union"))
}

#[test]
fn features_that_are_not_kept_are_named_with_place_and_width() {
    let rod = |radius: f64, low: f64, height: f64| -> Region {
        Arc::new(Cylinder::new([6.0, 6.0, low], [0.0, 0.0, 1.0], radius, height).expect("cylinder"))
    };
    let cases: [(LostKind, Region, Vec3, f64); 4] = [
        (LostKind::Hole, marred(rod(0.4, -1.0, 8.0), true), [6.0, 6.0, 3.0], 0.8),
        (LostKind::Slot, marred(cuboid([5.7, -1.0, 2.0], [6.3, 13.0, 7.0]), true), [6.0, 6.0, 4.0], 0.6),
        (LostKind::Wall, marred(cuboid([5.8, 0.0, 6.0], [6.2, 12.0, 9.0]), false), [6.0, 6.0, 7.5], 0.4),
        (LostKind::Pin, marred(rod(0.3, 5.0, 5.0), false), [6.0, 6.0, 8.0], 0.6),
    ];
    let size = 2.0;
    for (kind, space, middle, width) in cases {
        let block = cuboid([0.0; 3], [12.0, 12.0, 6.0]);
        let (mesh, _) = mesh(&block, &Grade::Constant(size));
        let fit = fit_of(&mesh, &space, 0.0);
        let found = fit.lost.first().unwrap_or_else(|| panic!("{kind:?}: nothing is lost: {fit:?}"));
        assert_eq!(found.kind, kind, "{fit:?}");
        // Samples are an eighth of a size apart.
        assert!((found.size - width).abs() < 0.25 * size && found.size > 0.5 * width, "{kind:?}: {found:?}");
        assert!(norm(sub(found.at, middle)) < 6.5, "{kind:?}: {found:?}");
        assert!((fit.from_part.max - found.depth).abs() < 1e-12 && fit.from_part.max > fit.to_part.p99, "{fit:?}");
        // Depth is at most the distance to the nearest place where the mesh can have its boundary.
        assert!(found.depth > size / 8.0, "{found:?}");
        drop(mesh);
    }
}

#[test]
fn distances_of_a_ball_are_sags_of_chords_both_ways() {
    for size in [1.0, 0.5] {
        let (mesh, fit) = mesh(&ball([0.1, 0.2, 0.3], 4.0), &Grade::Constant(size));
        let sag = sag(&mesh, 4.0);
        assert!(fit.to_part.max <= sag && fit.from_part.max <= 1.05 * sag, "{fit:?} of {sag}");
        assert!((fit.to_part.max / fit.from_part.max - 1.0).abs() < 0.1, "{fit:?}");
        assert!(fit.gained == 0.0 && fit.lost.is_empty(), "{fit:?}");
        // The cut segments, exactly: volume of the ball less that of the mesh, here by 20 000 points.
        let short = 4.0 / 3.0 * std::f64::consts::PI * 64.0 - mesh.volume();
        assert!((fit.missed - short).abs() < 0.5 * short, "{} of {short}", fit.missed);
    }
}
