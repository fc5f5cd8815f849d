//! The pieces of a solid, found while its tiles go by, and what becomes of all but the largest.
//!
//! Every tile adds up its own bodies (`bodies`), and here they are joined across the tiles' borders by the names of the
//! vertices that tiles share. A whole body of positive volume is the outside of a piece, one of negative volume the wall
//! of a cavity, as `measure` has it. A cavity belongs to the piece whose solid lies around it: along grid lines the
//! solid joins the bodies at its two ends. That is enough: beyond the last point of a cavity in +x, a line runs through
//! solid to the piece's outside, or to another cavity whose last point lies still farther on.
//!
//! What is held is a few numbers for each body of each tile, the names of border vertices in two layers of tiles (the
//! layer at work, and the one below it), and a number for each line of one row of tiles: never the mesh.

use std::collections::HashMap;

use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3};
use geometry::union_find::{find, unite};
use rustc_hash::FxHashMap;

use super::bodies::{Bodies, LINES, NONE, Sum};

/// What is to become of all pieces but the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Islands {
    /// They stay.
    #[default]
    Keep,
    /// They are left out.
    Drop,
    /// They are a reason to refuse.
    Error,
}

impl Islands {
    /// The word for it.
    pub fn named(word: &str) -> Option<Islands> {
        match word {
            "keep" => Some(Islands::Keep),
            "drop" => Some(Islands::Drop),
            "error" => Some(Islands::Error),
            _ => None,
        }
    }
}

/// A piece beside the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Island {
    /// Its volume, mm³, less its cavities.
    pub volume: f64,
    /// Lower and upper corner of its bounds, mm.
    pub bounds: [Vec3; 2],
}

impl Island {
    /// The middle of its bounds, mm.
    pub fn place(&self) -> Vec3 {
        let [low, high] = self.bounds;
        [0, 1, 2].map(|a| (low[a] + high[a]) / 2.0)
    }
}

/// The pieces of a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pieces {
    /// Solids in the result: bodies of the surface with positive volume.
    pub pieces: u64,
    /// Closed voids in the result: bodies of negative signed volume.
    pub cavities: u64,
    /// V − E + F of the result.
    pub euler: i64,
    /// Volume of the largest piece, less its cavities, mm³.
    pub largest: f64,
    /// The pieces beside the largest that were found.
    pub others: u64,
    /// Those of them that are not in the result.
    pub dropped: u64,
    /// Those of them that have surface on the region's boundary: mostly crumbs of walls and struts that it cuts off. The
    /// rest are islands inside.
    pub border: u64,
    /// Volume of all of them, mm³.
    pub volume: f64,
    /// The largest of them.
    pub island: Option<Island>,
}

impl Pieces {
    /// The largest piece's share of all the volume.
    pub fn share(&self) -> f64 {
        self.largest / (self.largest + self.volume)
    }

    /// What is to be said of the pieces beside the largest: how many, how large, where.
    pub fn words(&self) -> String {
        let Some(island) = self.island else {
            return "one piece".into();
        };
        let short = |v: f64| number(format!("{v:.2e}").parse().unwrap_or(v));
        // Rounded downwards: what is not all of it is never 100 %.
        let share = number((1e4 * self.share()).floor() / 100.0);
        // Plus zero: −0 is 0.
        let [x, y, z] = island.place().map(|v| number((1e3 * v).round() / 1e3 + 0.0));
        let (volume, largest) = (short(self.volume), short(island.volume));
        let place = format!("about ({x}, {y}, {z}) mm");
        match (self.others, self.border) {
            (1, b) => format!(
                "1 piece beside the largest ({share} % of the volume), of {volume} mm³, {} the region's boundary, {place}",
                if b > 0 { "at" } else { "away from" }
            ),
            (n, b) => format!(
                "{n} pieces beside the largest ({share} % of the volume), of {volume} mm³ in all, {b} of them at the \
                 region's boundary; the largest of them has {largest} mm³ and lies {place}"
            ),
        }
    }
}

/// The bodies of all tiles so far. They are numbered as they come.
#[derive(Default)]
pub(super) struct Census {
    sums: Vec<Sum>,
    /// Bodies that are parts of one.
    body: Vec<u32>,
    /// Bodies of one piece of solid.
    solid: Vec<u32>,
    /// Border vertices of the layer of tiles at work, and of the one below it, with a body.
    here: FxHashMap<u128, u32>,
    below: FxHashMap<u128, u32>,
    layer: usize,
    /// For each line of the row of tiles at work, the body that it entered the solid through, if it is inside.
    open: Vec<u32>,
    row: [usize; 2],
}

/// What is known in the end.
pub(super) struct Found {
    /// For each body of each tile, its triangles and whether they stay.
    pub parts: Vec<(u64, bool)>,
    /// What stays.
    pub sum: Sum,
    pub pieces: Pieces,
}

impl Census {
    /// Bodies that are joined already: those that are parts of one, and those of one piece of solid, by their lower roots.
    pub fn joined(sums: Vec<Sum>, body: Vec<u32>, solid: Vec<u32>) -> Census {
        Census { sums, body, solid, ..Census::default() }
    }

    /// Adds the bodies of the next tile.
    pub fn add(&mut self, tile: Bodies) -> Result<(), Fault> {
        let base = self.sums.len();
        if base + tile.sums.len() >= NONE as usize {
            let message = "the surface falls into more than 4e9 bodies; use a larger edge";
            return Err(Fault::new("edge", message));
        }
        let base = base as u32;
        self.sums.extend(&tile.sums);
        self.body.extend(base..self.sums.len() as u32);
        self.solid.extend(base..self.sums.len() as u32);
        // A vertex is shared within a layer of tiles or with the layer below, so names need not be kept for longer.
        if tile.tile[2] != self.layer {
            let last = std::mem::take(&mut self.here);
            self.below = if tile.tile[2] == self.layer + 1 { last } else { FxHashMap::default() };
            self.layer = tile.tile[2];
        }
        for (name, body) in tile.border {
            let body = base + body;
            let known = self.below.get(&name).copied();
            let first = known.unwrap_or_else(|| *self.here.entry(name).or_insert(body));
            if first == body && known.is_none() {
                self.sums[body as usize].vertices += 1;
            } else {
                unite(&mut self.body, body, first);
            }
        }
        for (a, b) in tile.beside {
            unite(&mut self.solid, base + a, base + b);
        }
        if self.row != [tile.tile[1], tile.tile[2]] || self.open.is_empty() {
            self.row = [tile.tile[1], tile.tile[2]];
            self.open.clear();
            self.open.resize(LINES, NONE);
        }
        // Lines side by side mostly join the same two bodies.
        let mut joined = (NONE, NONE);
        for line in &tile.lines {
            let open = &mut self.open[line.row as usize];
            if line.first != NONE && *open != NONE && joined != (line.first, *open) {
                joined = (line.first, *open);
                unite(&mut self.solid, base + line.first, *open);
            }
            *open = if line.last == NONE { NONE } else { base + line.last };
        }
        Ok(())
    }

    /// Says what the pieces are and which bodies stay.
    pub fn judge(mut self, islands: Islands) -> Result<Found, Fault> {
        let count = self.sums.len();
        // Roots are never above their members: a pass upwards gathers whole bodies at their roots.
        let mut whole = self.sums.clone();
        for i in 0..count {
            let root = find(&mut self.body, i as u32);
            unite(&mut self.solid, i as u32, root);
            if root as usize != i {
                let part = whole[i];
                whole[root as usize].add(&part);
            }
        }
        let roots: Vec<usize> = (0..count).filter(|&i| self.body[i] as usize == i).collect();
        // The outside of each piece of solid, and its volume without its cavities.
        let mut outside: HashMap<u32, usize> = HashMap::new();
        for &i in roots.iter().filter(|i| whole[**i].volume > 0.0) {
            let at = outside.entry(find(&mut self.solid, i as u32)).or_insert(i);
            if whole[i].volume > whole[*at].volume {
                *at = i;
            }
        }
        let mut net: Vec<f64> = whole.iter().map(|s| s.volume).collect();
        let mut owner = vec![NONE; count];
        for &i in &roots {
            let positive = whole[i].volume > 0.0;
            owner[i] = if positive {
                i as u32
            } else {
                // A void that no line meets is smaller than a grid step. It has no owner, and is filled where anything
                // is dropped: so nothing inside out can be left over.
                let piece = find(&mut self.solid, i as u32);
                outside.get(&piece).map_or(NONE, |o| *o as u32)
            };
            if !positive && owner[i] != NONE {
                net[owner[i] as usize] += whole[i].volume;
            }
        }
        let pieces = || roots.iter().copied().filter(|&i| whole[i].volume > 0.0);
        let largest = pieces().reduce(|a, b| if net[b] > net[a] { b } else { a });
        let mut told = Pieces::default();
        for i in pieces() {
            if Some(i) == largest {
                told.largest = net[i];
                continue;
            }
            told.others += 1;
            told.border += u64::from(whole[i].area[1] > 0.0);
            told.volume += net[i];
            if told.island.is_none_or(|o| net[i] > o.volume) {
                let Aabb { min, max } = whole[i].bounds;
                told.island = Some(Island { volume: net[i], bounds: [min, max] });
            }
        }
        if islands == Islands::Error && told.others > 0 {
            return Err(Fault::new("islands", refusal(&told)));
        }
        let drops = islands == Islands::Drop && told.others > 0;
        let stays = |i: usize| !drops || largest.is_some_and(|l| owner[i] == l as u32);
        let mut sum = Sum::NONE;
        for &i in roots.iter().filter(|i| stays(**i)) {
            sum.add(&whole[i]);
            told.pieces += u64::from(whole[i].volume > 0.0);
            told.cavities += u64::from(whole[i].volume < 0.0);
        }
        if drops {
            told.dropped = told.others;
        }
        // Closed and made of triangles: three edges for two of them.
        told.euler = sum.vertices as i64 - (sum.triangles / 2) as i64;
        let part = |i: usize| (self.sums[i].triangles, stays(self.body[i] as usize));
        Ok(Found { parts: (0..count).map(part).collect(), sum, pieces: told })
    }
}

/// Why a solid in several pieces is refused.
fn refusal(p: &Pieces) -> String {
    let words = p.words();
    format!("the solid is not in one piece: {words}; drop them, make walls thicker, or change what cuts them off")
}
