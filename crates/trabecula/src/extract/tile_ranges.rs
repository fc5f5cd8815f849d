//! The surface of a range of tiles, as another process or another run of this one makes it: its triangles, and what joins it to the
//! rest.

use std::ops::Range;
use std::sync::Mutex;

use geometry::fault::Fault;
use geometry::math::Vec3;
use geometry::progress::{Progress, Stopped};

use super::range_partial::RangeSweep;
use super::sampling_grid::SamplingGrid;
use super::tile::{TileBuffers, View};
use super::tile_components::TileComponents;
use super::tile_figures::{FigureSums, TileFigures};
use super::tile_queue::{borrow, each_tile, give_back};
use crate::solid::Solid;

/// A solid on its grid, whose tiles are taken range by range. Tiles are numbered, x fastest.
pub struct TileRanges {
    grid: SamplingGrid,
    /// The apex of the cones by which volumes are summed.
    middle: Vec3,
    /// Buffers of threads, and of tiles' triangles: a range of few tiles is made in the memory of the one before.
    scratch: Mutex<Vec<TileBuffers>>,
    spare: Mutex<Vec<Vec<u8>>>,
}

/// What is made of a range of tiles.
pub struct RangeMade {
    /// The tiles.
    pub tiles: Range<usize>,
    /// Their triangles, records of a binary STL: the bytes at their place in the file of the whole, before anything is dropped.
    pub records: Vec<u8>,
    /// Their components, for [`JoinedRanges`](super::JoinedRanges).
    pub partial: Vec<u8>,
}

impl TileRanges {
    /// The tiles of a solid at grid spacing `edge` (mm).
    ///
    /// # Errors
    /// A spacing at which there is no grid.
    pub fn new(solid: &Solid, edge: f64) -> Result<TileRanges, Fault> {
        let (scratch, spare) = Default::default();
        Ok(TileRanges { grid: SamplingGrid::new(solid, edge)?, middle: solid.region.bounds().center(), scratch, spare })
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.grid.all().len()
    }

    /// The surface in some tiles, in ranges that end at multiples of `size` and at the last tile. Memory is bounded by the tiles in
    /// flight and one range. Same bytes for any number of threads.
    ///
    /// # Errors
    /// An interruption; more components than can be numbered; what `take` says.
    pub fn surface(
        &self,
        tiles: Range<usize>,
        size: usize,
        progress: &dyn Progress,
        take: impl FnMut(RangeMade) -> Result<(), Stopped> + Send,
    ) -> Result<(), Stopped> {
        self.each(&Triangles { middle: self.middle, spare: &self.spare }, tiles, size, progress, take)
    }

    /// What is measured of the surface in some tiles, as `surface` takes them; there are no triangles.
    ///
    /// # Errors
    /// As `surface`.
    pub fn figures(
        &self,
        tiles: Range<usize>,
        size: usize,
        progress: &dyn Progress,
        take: impl FnMut(RangeMade) -> Result<(), Stopped> + Send,
    ) -> Result<(), Stopped> {
        self.each(&MeasureWork { middle: self.middle }, tiles, size, progress, take)
    }

    /// Does some work in tiles, in ranges that end at multiples of `size` and at the last tile.
    fn each<W: RangeWork>(
        &self,
        work: &W,
        tiles: Range<usize>,
        size: usize,
        progress: &dyn Progress,
        mut take: impl FnMut(RangeMade) -> Result<(), Stopped> + Send,
    ) -> Result<(), Stopped> {
        let (end, size) = (tiles.end.min(self.tiles()), size.max(1));
        let start = tiles.start.min(end);
        let begin = |start: usize| {
            let tiles = start..((start / size + 1).saturating_mul(size)).min(end);
            OpenRange::<W> { sweep: RangeSweep::new(tiles.clone()), sum: W::Sum::default(), tiles }
        };
        let mut open = begin(start);
        each_tile(
            (&self.grid, &self.scratch),
            start..end,
            progress,
            |view| work.of_tile(&view),
            |made| {
                let tile = self.grid.number(W::tile(&made));
                while tile >= open.tiles.end {
                    let next = begin(open.tiles.end);
                    take(std::mem::replace(&mut open, next).close(&self.grid))?;
                }
                let components = work.add(&mut open.sum, made);
                open.sweep.add(&self.grid, components).map_err(Stopped::Refused)
            },
        )?;
        while !open.tiles.is_empty() {
            let next = begin(open.tiles.end);
            take(std::mem::replace(&mut open, next).close(&self.grid))?;
        }
        Ok(())
    }
}

/// What is done in each tile of a range, and how tiles are put together.
trait RangeWork: Sync {
    /// What is made of a tile.
    type Made: Send;
    /// What the tiles of a range so far add up to.
    type Sum: Default + Send;

    fn of_tile(&self, view: &View) -> Self::Made;

    /// Which tile it is of.
    fn tile(made: &Self::Made) -> [usize; 3];

    /// Adds the next tile, and gives its components.
    fn add(&self, sum: &mut Self::Sum, made: Self::Made) -> TileComponents;

    /// The bytes of a range, and what is measured of it besides its components.
    fn finish(sum: Self::Sum) -> (Vec<u8>, Option<FigureSums>);
}

/// Triangles, as records of a binary STL.
struct Triangles<'a> {
    middle: Vec3,
    spare: &'a Mutex<Vec<Vec<u8>>>,
}

impl RangeWork for Triangles<'_> {
    type Made = (TileComponents, Vec<u8>);
    type Sum = Vec<u8>;

    fn of_tile(&self, view: &View) -> Self::Made {
        let mut records = borrow(self.spare);
        (TileComponents::with_records(view, self.middle, &mut records), records)
    }

    fn tile((components, _): &Self::Made) -> [usize; 3] {
        components.tile
    }

    fn add(&self, all: &mut Vec<u8>, (components, mut records): Self::Made) -> TileComponents {
        all.append(&mut records);
        give_back(self.spare, records);
        components
    }

    fn finish(all: Vec<u8>) -> (Vec<u8>, Option<FigureSums>) {
        (all, None)
    }
}

/// What is measured of a surface.
struct MeasureWork {
    middle: Vec3,
}

impl RangeWork for MeasureWork {
    type Made = TileFigures;
    type Sum = FigureSums;

    fn of_tile(&self, view: &View) -> TileFigures {
        TileFigures::of(view, self.middle)
    }

    fn tile(made: &TileFigures) -> [usize; 3] {
        made.components.tile
    }

    fn add(&self, sums: &mut FigureSums, made: TileFigures) -> TileComponents {
        sums.add(made)
    }

    fn finish(sums: FigureSums) -> (Vec<u8>, Option<FigureSums>) {
        (Vec::new(), Some(sums))
    }
}

/// A range whose tiles come in.
struct OpenRange<W: RangeWork> {
    tiles: Range<usize>,
    sweep: RangeSweep,
    sum: W::Sum,
}

impl<W: RangeWork> OpenRange<W> {
    fn close(self, grid: &SamplingGrid) -> RangeMade {
        let (records, figures) = W::finish(self.sum);
        RangeMade { tiles: self.tiles, records, partial: self.sweep.finish(grid, figures).pack() }
    }
}
