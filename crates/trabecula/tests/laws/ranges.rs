//! A surface that is made range by range, and joined, is that of one run to the last bit: its triangles and all that is said of it.

use std::io::Cursor;
use std::ops::Range;

use geometry::formats::stl;
use geometry::progress::{Silent, Stopped};
use proptest::prelude::*;
use trabecula::cell::Part;
use trabecula::extract::{GridSurface, JoinedRanges, RangeMade, TileRanges, WholeSurface};
use trabecula::solid::Solid;
use trabecula::surface_maker::{Islands, Summary, SurfaceMaker, SurfaceOptions};

use crate::common::{ball, cases, drawn, lattice, region, solid};

/// The file of one run, and what is said of it.
fn whole(solid: &Solid, options: &SurfaceOptions) -> Result<(Vec<u8>, Summary), Stopped> {
    let mut file = Cursor::new(Vec::new());
    let found = GridSurface(solid).stream_stl(options, &mut file, &Silent)?;
    Ok((file.into_inner(), found))
}

/// All ranges of at most `size` tiles, made as so many runs, each beginning at a multiple of it.
fn ranges(solid: &Solid, edge: f64, size: usize, runs: usize) -> Vec<RangeMade> {
    let tiles = TileRanges::new(solid, edge).expect("a grid");
    let (mut made, count) = (Vec::new(), tiles.tiles().div_ceil(size));
    for run in 0..runs {
        let part = |n: usize| count * n / runs * size;
        let take = |range| {
            made.push(range);
            Ok(())
        };
        tiles
            .surface(part(run)..if run + 1 == runs { usize::MAX } else { part(run + 1) }, size, &Silent, take)
            .expect("ranges");
    }
    made
}

fn joined(made: &[RangeMade], options: &SurfaceOptions) -> Result<(Vec<u8>, WholeSurface), Stopped> {
    let mut join = JoinedRanges::default();
    made.iter().for_each(|range| join.add(&range.partial).expect("a partial result"));
    let found = join.finish(options)?;
    let records: Vec<u8> = made.iter().flat_map(|range| range.records.iter().copied()).collect();
    assert_eq!(records.len() as u64, found.triangles * stl::RECORD as u64);
    let mut file = stl::header(found.summary.triangles as u32).to_vec();
    for Range { start, end } in &found.kept {
        file.extend(&records[*start as usize * stl::RECORD..*end as usize * stl::RECORD]);
    }
    Ok((file, found))
}

/// Holds the ranges of a solid to its file, and gives the number of pieces dropped and of voids filled.
fn held(solid: &Solid, options: &SurfaceOptions, size: usize, runs: usize) -> [u64; 2] {
    let (file, said) = whole(solid, options).expect("surface");
    let (again, found) = joined(&ranges(solid, options.resolution, size, runs), options).expect("joined");
    assert_eq!(found.summary, said);
    assert!(file == again, "{} bytes for {}", again.len(), file.len());
    [said.components.dropped, said.components.filled]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(12) as u32, ..ProptestConfig::default() })]

    /// Random solids on grids of up to some hundred tiles, in ranges of any size.
    #[test]
    fn ranges_of_random_solids_join_to_their_files(
        drawn in drawn(),
        kind in 0..7usize,
        (r, s, t) in (0.7..1.4f64, -0.3..0.3f64, 0.2..0.9f64),
        edge in 0.008..0.05f64,
        (size, runs) in (1..30usize, 1..4usize),
        islands in prop_oneof![Just(Islands::DropSmall), Just(Islands::Keep), Just(Islands::Drop), Just(Islands::Error)],
    ) {
        let solid = solid(region(kind, r, s, t), Some(drawn.lattice()));
        let options = SurfaceOptions { resolution: edge, islands };
        match whole(&solid, &options) {
            Ok(_) => drop(held(&solid, &options, size, runs)),
            Err(_) => prop_assert!(joined(&ranges(&solid, edge, size, runs), &options).is_err()),
        }
    }
}

/// What is measured range by range is what one run measures: the percentile of angles and the points in voids too.
#[test]
fn figures_of_ranges_join_to_those_of_one_run() {
    let shells = lattice("primitive", Part::Upper, 0.4, [1.0, 1.1, 0.9], [5.0, 15.0, 25.0]);
    let solid = solid(ball([0.0; 3], 1.7), Some(shells));
    let options = SurfaceOptions::new(0.02);
    let one = GridSurface(&solid).measure(&options, &Silent).expect("figures");
    let tiles = TileRanges::new(&solid, 0.02).expect("a grid");
    for size in [1, 4, 9, 1000] {
        let mut join = JoinedRanges::default();
        let take = |range: RangeMade| join.add(&range.partial).map_err(Stopped::Refused);
        tiles.figures(0..usize::MAX, size, &Silent, take).expect("ranges");
        assert_eq!(join.measured(&options).expect("joined"), one);
    }
}

/// Loose blobs all over four by four by four tiles, of which some reach through several: dropped, kept, and in ranges that end
/// within rows, rows that end within layers, and one range.
#[test]
fn pieces_are_dropped_across_ranges() {
    let blobs = lattice("primitive", Part::Lower, 0.1, [1.0, 1.1, 0.9], [5.0, 15.0, 25.0]);
    let solid = solid(ball([0.0; 3], 1.7), Some(blobs));
    for size in [1, 3, 4, 7, 1000] {
        let dropped = [Islands::Keep, Islands::DropSmall, Islands::Drop]
            .map(|islands| held(&solid, &SurfaceOptions { resolution: 0.015, islands }, size, 1 + size % 3)[0]);
        assert!(dropped[0] == 0 && dropped[2] > 10, "{dropped:?}");
    }
}

/// A partial result with one byte changed, or cut off, is refused or read as another; it never panics.
#[test]
fn damaged_partial_results_are_refused() {
    let blobs = lattice("primitive", Part::Lower, 0.1, [1.0, 1.1, 0.9], [5.0, 15.0, 25.0]);
    let made = ranges(&solid(ball([0.0; 3], 1.7), Some(blobs)), 0.05, 3, 1);
    let bytes = &made[0].partial;
    for cut in (0..bytes.len()).step_by(bytes.len() / 200) {
        assert!(JoinedRanges::default().add(&bytes[..cut]).is_err());
        let mut changed = bytes.clone();
        changed[cut] ^= 0x55;
        let mut join = JoinedRanges::default();
        let _ = join.add(&changed).and_then(|()| join.add(&made[1].partial));
    }
}
