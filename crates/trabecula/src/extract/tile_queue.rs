//! Tiles of a grid are extracted in parallel, a few at a time, and consumed in order.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use geometry::fault::Fault;
use geometry::progress::{Progress, Stopped};
use rayon::Scope;

use super::sampling_grid::SamplingGrid;
use super::tile::{self, TileBuffers, View};

/// A used buffer, or a new one: memory that is not returned to the system need not be cleared by it again.
pub(super) fn borrow<T: Default>(pool: &Mutex<Vec<T>>) -> T {
    pool.lock().ok().and_then(|mut p| p.pop()).unwrap_or_default()
}

pub(super) fn give_back<T>(pool: &Mutex<Vec<T>>, buffer: T) {
    if let Ok(mut p) = pool.lock() {
        p.push(buffer);
    }
}

/// Tiles per thread that may be extracted ahead of their turn: few enough to stay in the cache.
const AHEAD: usize = 4;

/// Most tiles that are searched to find how the work is spread over them.
const SAMPLED: usize = 256;

/// The work in some tiles, in octants that have a surface: the others take no time, and in a mesh region they are many and come
/// together.
struct Workload {
    /// Tiles from one that is searched to the next.
    every: usize,
    /// Octants with a surface in these tiles, up to each.
    busy: Vec<u64>,
}

impl Workload {
    fn new(grid: &SamplingGrid, tiles: &Range<usize>) -> Workload {
        let every = tiles.len().div_ceil(SAMPLED).max(1);
        let sampled = tiles.clone().skip(every / 2).step_by(every).map(|i| grid.tile(i));
        let busy_octants = |tile| {
            let (nodes, all) = (grid.nodes(tile), grid.block(tile).bounds());
            let octant = |i: usize| {
                let mut part = all;
                for (a, middle) in all.center().into_iter().enumerate() {
                    *(if i >> a & 1 == 0 { &mut part.max[a] } else { &mut part.min[a] }) = middle;
                }
                part
            };
            (0..8).filter(|i| grid.local(&nodes, &octant(*i)).is_some()).count() as u64
        };
        let busy = sampled.scan(0, |all, tile| {
            *all += busy_octants(tile);
            Some(*all)
        });
        Workload { every, busy: busy.collect() }
    }

    /// The work in the first tiles, in `every`ths of an octant.
    fn of(&self, tiles: usize) -> u64 {
        let (whole, rest) = (tiles / self.every, (tiles % self.every) as u64);
        let up_to = |n: usize| n.checked_sub(1).map_or(0, |n| self.busy[n.min(self.busy.len() - 1)]);
        let [low, high] = [whole, whole + 1].map(up_to);
        low * self.every as u64 + (high - low) * rest
    }
}

/// State shared by the threads.
struct Queue<T> {
    /// The next tile to extract.
    next: usize,
    /// The next tile to consume.
    turn: usize,
    /// Tiles that wait for their turn; `None` for those without surface.
    ready: HashMap<usize, Result<Option<T>, Fault>>,
    /// Whether a thread is consuming tiles.
    consuming: bool,
    /// Number of threads that have ended because too many tiles wait.
    idle: usize,
    ended: Result<(), Stopped>,
}

/// Extracts tiles, maps each by `map` on its thread and passes the results to `take` in order; those without surface are left out.
///
/// Buffers of threads are taken from `spare`, and left there for the next call.
///
/// Every thread extracts the next tile, then consumes what is ready unless another thread does. A thread that is too far
/// ahead ends and is started again when a tile has been consumed: none ever blocks, so there is no deadlock.
pub(super) fn each_tile<T: Send>(
    (grid, spare): (&SamplingGrid, &Mutex<Vec<TileBuffers>>),
    tiles: Range<usize>,
    progress: &dyn Progress,
    map: impl Fn(View) -> T + Sync,
    take: impl FnMut(T) -> Result<(), Stopped> + Send,
) -> Result<(), Stopped> {
    let start = tiles.start;
    let threads = rayon::current_num_threads();
    let work = TileWork {
        grid,
        progress,
        workload: Workload::new(grid, &tiles),
        tiles,
        ahead: AHEAD * threads,
        spare,
        map,
        take: Mutex::new(take),
        queue: Mutex::new(Queue {
            next: start,
            turn: start,
            ready: HashMap::new(),
            consuming: false,
            idle: 0,
            ended: Ok(()),
        }),
    };
    rayon::scope(|scope| (0..threads).for_each(|_| scope.spawn(|scope| work.run(scope))));
    let queue = work.queue.into_inner();
    queue.unwrap_or_else(PoisonError::into_inner).ended
}

/// The work on these tiles.
struct TileWork<'a, T, C, K> {
    grid: &'a SamplingGrid,
    progress: &'a dyn Progress,
    workload: Workload,
    tiles: Range<usize>,
    ahead: usize,
    spare: &'a Mutex<Vec<TileBuffers>>,
    map: C,
    take: Mutex<K>,
    queue: Mutex<Queue<T>>,
}

impl<T, C, K> TileWork<'_, T, C, K>
where
    T: Send,
    C: Fn(View) -> T + Sync,
    K: FnMut(T) -> Result<(), Stopped> + Send,
{
    /// The queue. No thread panics while it holds it.
    fn queue(&self) -> MutexGuard<'_, Queue<T>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run<'s>(&'s self, scope: &Scope<'s>) {
        let mut scratch = borrow(self.spare);
        while let Some(i) = self.claim() {
            let found = tile::extract(self.grid, self.grid.tile(i), &mut scratch).map(|view| view.map(&self.map));
            self.queue().ready.insert(i, found);
            self.take_ready(scope);
        }
        give_back(self.spare, scratch);
    }

    /// The next tile to extract, unless there is none or too many wait.
    fn claim(&self) -> Option<usize> {
        let mut q = self.queue();
        if q.next >= self.tiles.end || q.ended.is_err() {
            return None;
        }
        if q.next >= q.turn + self.ahead {
            q.idle += 1;
            return None;
        }
        q.next += 1;
        Some(q.next - 1)
    }

    /// Consumes the tiles whose turn it is, unless another thread does.
    fn take_ready<'s>(&'s self, scope: &Scope<'s>) {
        let mut q = self.queue();
        if q.consuming {
            return;
        }
        q.consuming = true;
        while q.ended.is_ok() {
            let turn = q.turn;
            let Some(found) = q.ready.remove(&turn) else {
                break;
            };
            drop(q);
            let taken = match (found, self.take.lock()) {
                (Ok(Some(found)), Ok(mut take)) => take(found),
                (Err(fault), _) => Err(Stopped::Refused(fault)),
                _ => Ok(()),
            };
            let [done, all] = [turn - self.tiles.start + 1, self.tiles.len()].map(|n| self.workload.of(n).max(1));
            let go_on = self.progress.step(done, all);
            q = self.queue();
            q.turn += 1;
            if q.ended.is_ok() {
                q.ended = taken.and(if go_on { Ok(()) } else { Err(Stopped::Interrupted) });
            }
            if q.idle > 0 {
                q.idle -= 1;
                scope.spawn(|scope| self.run(scope));
            }
        }
        q.consuming = false;
    }
}
