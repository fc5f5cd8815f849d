//! The surface of a range of tiles, as another process or another run of this one makes it: its triangles, and what joins it to the
//! rest.

use std::ops::Range;
use std::sync::Mutex;

use geometry::fault::Fault;
use geometry::formats::stl;
use geometry::math::Vec3;
use geometry::progress::{Progress, Stopped};

use super::range_partial::RangeSweep;
use super::sampling_grid::Grid;
use super::tile::{Scratch, View};
use super::tile_components::TileComponents;
use super::tile_figures::{FigureSums, TileFigures};
use super::tile_queue::{borrow, each_tile, give_back};
use crate::solid::Solid;

/// A solid on its grid, whose tiles are taken range by range. Tiles are numbered, x fastest.
pub struct TileRanges {
    grid: Grid,
    /// The apex of the cones by which volumes are summed.
    middle: Vec3,
    /// Buffers of threads, and of tiles' triangles: a range of few tiles is made in the memory of the one before.
    scratch: Mutex<Vec<Scratch>>,
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
        Ok(TileRanges { grid: Grid::new(solid, edge)?, middle: solid.region.bounds().center(), scratch, spare })
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
        let map = |view: View| {
            let mut records = borrow(&self.spare);
            let positions = view.positions();
            let components = TileComponents::each_triangle(&view, 0, self.middle, |t, _| {
                stl::push_record(&mut records, t.map(|v| positions[v as usize].map(|x| x as f32)));
            });
            (components, records)
        };
        let add = |open: &mut Open, (components, mut records): (TileComponents, Vec<u8>)| {
            open.records.extend_from_slice(&records);
            records.clear();
            give_back(&self.spare, records);
            components
        };
        self.each([tiles.start, tiles.end, size], None, progress, (map, |c| c.0.tile, add), take)
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
        let map = |view: View| TileFigures::of(&view, self.middle);
        let add = |open: &mut Open, tile: TileFigures| match &mut open.figures {
            Some(sums) => sums.add(tile),
            None => tile.components,
        };
        let none = Some(FigureSums::default());
        self.each([tiles.start, tiles.end, size], none, progress, (map, |t| t.components.tile, add), take)
    }

    /// Takes tiles from a first to before a last one in ranges of a size, of which nothing is measured or `none` yet: by a function of a tile, which tile a result is of, and how it
    /// is added to the range that is open.
    fn each<T: Send>(
        &self,
        [start, end, size]: [usize; 3],
        none: Option<FigureSums>,
        progress: &dyn Progress,
        (map, tile_of, add): (
            impl Fn(View) -> T + Sync,
            impl Fn(&T) -> [usize; 3] + Sync,
            impl Fn(&mut Open, T) -> TileComponents + Sync,
        ),
        mut take: impl FnMut(RangeMade) -> Result<(), Stopped> + Send,
    ) -> Result<(), Stopped> {
        let (end, size) = (end.min(self.tiles()), size.max(1));
        let start = start.min(end);
        let begin = |start: usize| {
            let tiles = start..((start / size + 1).saturating_mul(size)).min(end);
            Open { sweep: RangeSweep::new(tiles.clone()), records: Vec::new(), figures: none.clone(), tiles }
        };
        let mut open = begin(start);
        each_tile((&self.grid, &self.scratch), start..end, progress, map, |made| {
            let tile = self.grid.number(tile_of(&made));
            while tile >= open.tiles.end {
                let next = begin(open.tiles.end);
                take(std::mem::replace(&mut open, next).close(&self.grid))?;
            }
            let components = add(&mut open, made);
            open.sweep.add(&self.grid, components).map_err(Stopped::Refused)
        })?;
        while !open.tiles.is_empty() {
            let next = begin(open.tiles.end);
            take(std::mem::replace(&mut open, next).close(&self.grid))?;
        }
        Ok(())
    }
}

/// A range whose tiles come in.
struct Open {
    tiles: Range<usize>,
    records: Vec<u8>,
    sweep: RangeSweep,
    figures: Option<FigureSums>,
}

impl Open {
    fn close(self, grid: &Grid) -> RangeMade {
        RangeMade { tiles: self.tiles, records: self.records, partial: self.sweep.finish(grid, self.figures).pack() }
    }
}
