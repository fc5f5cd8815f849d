//! Connected components of a solid and of its surface.
//!
//! A surface maker finds its surface in parts: tiles or tetrahedra. Each part adds up the totals of its own surface
//! components, and a `ComponentGraph` joins them: components of the surface, and components of the solid between them. A
//! whole surface component of positive volume is the outer boundary of a component of the solid; one of negative volume is
//! the wall of a cavity, which belongs to the solid component around it.

use std::collections::HashMap;

use geometry::fault::{Fault, number, position};
use geometry::math::{Aabb, Vec3};
use geometry::union_find::{find, unite};

use super::Summary;

/// Grid cells: a component with less volume is under two grid steps across.
pub const SMALL: f64 = 8.0;
/// Grid cells: a component with less volume is no part of the design, but of its sampling.
pub const DUST: f64 = 0.01;
/// Grid cells: a cavity with less volume is not resolved.
pub const CRUMB: f64 = 1.0;
/// A share of the largest component's volume: less is no loss.
pub const NEGLIGIBLE: f64 = 1e-3;

/// Treatment of all connected components of the solid but the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Islands {
    /// They are kept.
    Keep,
    /// Those at the region's boundary with less than the volume of `SMALL` grid cells and `NEGLIGIBLE` of the largest are
    /// removed: what the boundary cuts off that the grid cannot resolve. So are those of less than `DUST` grid cells anywhere,
    /// and cavities of less than `CRUMB` are filled: what surfaces that nearly touch leave between them.
    #[default]
    DropSmall,
    /// They are removed, and such cavities are filled.
    Drop,
    /// They are an error.
    Error,
}

impl Islands {
    /// The value of this name: "keep", "drop-small", "drop" or "error".
    pub fn named(word: &str) -> Option<Islands> {
        match word {
            "keep" => Some(Islands::Keep),
            "drop-small" => Some(Islands::DropSmall),
            "drop" => Some(Islands::Drop),
            "error" => Some(Islands::Error),
            _ => None,
        }
    }
}

/// A connected component other than the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Component {
    /// Its volume without its cavities, mm³.
    pub volume: f64,
    /// Lower and upper corner of its bounds, mm.
    pub bounds: [Vec3; 2],
}

impl Component {
    /// The centre of its bounds, mm.
    pub fn center(&self) -> Vec3 {
        let [low, high] = self.bounds;
        [0, 1, 2].map(|a| (low[a] + high[a]) / 2.0)
    }
}

/// The connected components of a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Components {
    /// Components in the result: surface components with positive volume.
    pub count: u64,
    /// Cavities in the result: surface components with negative volume.
    pub cavities: u64,
    /// V − E + F of the result.
    pub euler: i64,
    /// Volume of the largest component without its cavities, mm³.
    pub largest: f64,
    /// Number of components found other than the largest.
    pub others: u64,
    /// How many of them are not in the result.
    pub dropped: u64,
    /// The total volume of those, mm³.
    pub dropped_volume: f64,
    /// How many cavities were filled.
    pub filled: u64,
    /// The total volume of those, mm³.
    pub filled_volume: f64,
    /// How many of them touch the region's boundary: mostly fragments of walls and struts that it cuts off. The rest lie
    /// inside.
    pub border: u64,
    /// Their total volume, mm³.
    pub volume: f64,
    /// The largest of them.
    pub second: Option<Component>,
}

impl Components {
    /// Whether all that was found is in the result.
    pub fn unchanged(&self) -> bool {
        self.dropped == 0 && self.filled == 0
    }

    /// The largest component's share of the total volume.
    pub fn share(&self) -> f64 {
        self.largest / (self.largest + self.volume)
    }

    /// One sentence on the components other than the largest: number, volume, position.
    pub fn description(&self) -> String {
        let Some(second) = self.second else {
            return "one piece".into();
        };
        let short = |v: f64| number(format!("{v:.2e}").parse().unwrap_or(v));
        // Rounded downwards: what is not all of it is never 100 %.
        let share = number((1e4 * self.share()).floor() / 100.0);
        let (volume, largest) = (short(self.volume), short(second.volume));
        let place = format!("about {}", position(second.center()));
        let sentence = match (self.others, self.border) {
            (1, b) => format!(
                "1 connected component besides the largest ({share} % of the volume), of {volume} mm³, {} the region's boundary, {place}",
                if b > 0 { "at" } else { "away from" }
            ),
            (n, b) => format!(
                "{n} connected components besides the largest ({share} % of the volume), of {volume} mm³ in all, {b} of them at the \
                 region's boundary; the largest of them has {largest} mm³ and lies {place}"
            ),
        };
        match self.dropped {
            0 => sentence,
            n if n == self.others => format!("{sentence}; dropped"),
            1 => format!("{sentence}; 1 of them, of {} mm³, is dropped", short(self.dropped_volume)),
            n => format!("{sentence}; {n} of them, of {} mm³, are dropped", short(self.dropped_volume)),
        }
    }
}

/// No component.
pub(crate) const NONE: u32 = u32::MAX;

/// Totals over the triangles and vertices of a surface component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Totals {
    pub triangles: u64,
    /// A vertex that several parts share is counted in one of them.
    pub vertices: u64,
    /// Signed sum of cones from a common apex, mm³; the volume once the component is complete.
    pub volume: f64,
    /// Area on the lattice and on the region's boundary, mm².
    pub area: [f64; 2],
    pub bounds: Aabb,
}

impl Totals {
    pub const ZERO: Totals = Totals { triangles: 0, vertices: 0, volume: 0.0, area: [0.0; 2], bounds: Aabb::EMPTY };

    pub fn add(&mut self, o: &Totals) {
        self.triangles += o.triangles;
        self.vertices += o.vertices;
        self.volume += o.volume;
        self.area[0] += o.area[0];
        self.area[1] += o.area[1];
        self.bounds = self.bounds.union(o.bounds);
    }
}

/// Surface components of all parts so far, numbered as they come, and how they are joined.
#[derive(Default)]
pub(crate) struct ComponentGraph {
    /// Totals of each component within its part.
    pub totals: Vec<Totals>,
    /// Union-find over parts of one surface component.
    pub surface: Vec<u32>,
    /// Union-find over surface components of one solid component.
    pub solid: Vec<u32>,
}

/// The connected components of a complete surface, and which of its triangles stay.
pub struct Resolved {
    /// For each component of each part, in order, its number of triangles and whether it stays.
    pub(crate) parts: Vec<(u64, bool)>,
    /// For each of them, the first of its surface component.
    pub(crate) first: Vec<u32>,
    /// The walls of cavities that stay, by the first of each, with their totals.
    pub(crate) walls: Vec<(u32, Totals)>,
    /// Totals of what stays.
    pub(crate) totals: Totals,
    /// The components.
    pub components: Components,
    /// Greatest distance of triangles from the surface (mm), where the method measures it.
    pub error: Option<f64>,
}

impl Resolved {
    /// The triangles that stay, by their numbers in order.
    pub fn kept(&self) -> Vec<std::ops::Range<u64>> {
        super::compact::ranges(&self.parts)
    }

    /// What is left of the surface.
    pub fn summary(self) -> Summary {
        Summary {
            triangles: self.totals.triangles,
            volume: self.totals.volume,
            area_lattice: self.totals.area[0],
            area_cut: self.totals.area[1],
            components: self.components,
            error: self.error,
        }
    }
}

impl ComponentGraph {
    /// Adds the components of the next part and `inner` solid components without surface; returns the first number.
    pub fn add(&mut self, totals: &[Totals], inner: usize) -> Result<u32, Fault> {
        let base = self.totals.len();
        let end = base + totals.len() + inner;
        if end >= NONE as usize {
            return Err(Fault::new("edge", "the surface has more than 4e9 connected components; use a larger edge"));
        }
        self.totals.extend(totals);
        self.totals.resize(end, Totals::ZERO);
        self.surface.extend(base as u32..end as u32);
        self.solid.extend(base as u32..end as u32);
        Ok(base as u32)
    }

    /// Determines the connected components and which of them stay; `spacing` (mm) is the grid's.
    pub fn resolve(mut self, islands: Islands, spacing: f64) -> Result<Resolved, Fault> {
        let count = self.totals.len();
        // Roots are never above their members: an ascending pass gathers whole components at their roots.
        let mut whole = self.totals.clone();
        for i in 0..count {
            let root = find(&mut self.surface, i as u32);
            unite(&mut self.solid, i as u32, root);
            if root as usize != i {
                let part = whole[i];
                whole[root as usize].add(&part);
            }
        }
        let roots: Vec<usize> = (0..count).filter(|&i| self.surface[i] as usize == i).collect();
        let owner = self.owners(&whole, &roots);
        let mut net: Vec<f64> = whole.iter().map(|s| s.volume).collect();
        for &i in roots.iter().filter(|i| owner[**i] != NONE && owner[**i] as usize != **i) {
            net[owner[i] as usize] += whole[i].volume;
        }
        let outer = || roots.iter().copied().filter(|&i| whole[i].volume > 0.0);
        let largest = outer().reduce(|a, b| if net[b] > net[a] { b } else { a });
        let cells = |n: f64| largest.map_or(0.0, |l| (n * spacing.powi(3)).min(NEGLIGIBLE * net[l]));
        let [small, dust, crumb] = [SMALL, DUST, CRUMB].map(cells);
        let mut found = Components::default();
        let mut drops = vec![false; count];
        for i in outer().filter(|&i| Some(i) != largest) {
            let border = whole[i].area[1] > 0.0;
            found.others += 1;
            found.border += u64::from(border);
            drops[i] = match islands {
                Islands::Drop => true,
                Islands::DropSmall => net[i] < if border { small } else { dust },
                Islands::Keep | Islands::Error => false,
            };
            if drops[i] {
                found.dropped += 1;
                found.dropped_volume += net[i];
            }
        }
        let fills = match islands {
            Islands::DropSmall | Islands::Drop => crumbs(&whole, &roots, crumb),
            Islands::Keep | Islands::Error => Vec::new(),
        };
        // A cavity goes with its solid.
        for i in fills {
            drops[i] = owner[i] == NONE || !drops[owner[i] as usize];
            if !drops[i] {
                continue;
            }
            found.filled += 1;
            found.filled_volume -= whole[i].volume;
            if owner[i] != NONE {
                net[owner[i] as usize] -= whole[i].volume;
            }
        }
        for i in outer() {
            if Some(i) == largest {
                found.largest = net[i];
                continue;
            }
            found.volume += net[i];
            if found.second.is_none_or(|o| net[i] > o.volume) {
                let Aabb { min, max } = whole[i].bounds;
                found.second = Some(Component { volume: net[i], bounds: [min, max] });
            }
        }
        if islands == Islands::Error && found.others > 0 {
            return Err(Fault::new("islands", refusal(&found)));
        }
        let stays = |i: usize| match owner[i] {
            NONE => found.dropped == 0 && !drops[i],
            o => !drops[o as usize] && !drops[i],
        };
        let (mut sum, mut solids, mut walls) = (Totals::ZERO, 0, Vec::new());
        for &i in roots.iter().filter(|i| stays(**i)) {
            sum.add(&whole[i]);
            solids += u64::from(whole[i].volume > 0.0);
            if whole[i].volume < 0.0 {
                walls.push((i as u32, whole[i]));
            }
        }
        // Closed and made of triangles: three edges for two of them.
        let euler = sum.vertices as i64 - (sum.triangles / 2) as i64;
        let parts = (0..count).map(|i| (self.totals[i].triangles, stays(self.surface[i] as usize))).collect();
        let components = Components { count: solids, cavities: walls.len() as u64, euler, ..found };
        Ok(Resolved { parts, first: self.surface, walls, totals: sum, components, error: None })
    }

    /// For each root of a surface the outer boundary of its solid component: itself, or that around a cavity. A cavity that no
    /// grid line meets is smaller than a grid step: it has none and is filled where anything is dropped, so that no inverted
    /// component can be left over.
    fn owners(&mut self, whole: &[Totals], roots: &[usize]) -> Vec<u32> {
        let mut outside: HashMap<u32, usize> = HashMap::new();
        for &i in roots.iter().filter(|i| whole[**i].volume > 0.0) {
            let at = outside.entry(find(&mut self.solid, i as u32)).or_insert(i);
            if whole[i].volume > whole[*at].volume {
                *at = i;
            }
        }
        let mut owner = vec![NONE; whole.len()];
        for &i in roots {
            let solid = find(&mut self.solid, i as u32);
            owner[i] = if whole[i].volume > 0.0 { i as u32 } else { outside.get(&solid).map_or(NONE, |o| *o as u32) };
        }
        owner
    }
}

/// Whether a box holds another.
fn encloses(outer: &Aabb, inner: &Aabb) -> bool {
    (0..3).all(|a| inner.min[a] >= outer.min[a] && inner.max[a] <= outer.max[a])
}

/// The cavities of less than a volume that can be filled: with nothing in them, and without a part of the region's boundary.
fn crumbs(whole: &[Totals], roots: &[usize], limit: f64) -> Vec<usize> {
    let least = roots.iter().filter(|i| whole[**i].volume > 0.0 && whole[**i].volume < limit);
    let mut least: Vec<&Aabb> = least.map(|i| &whole[*i].bounds).collect();
    least.sort_by(|a, b| a.min[0].total_cmp(&b.min[0]));
    // Only solids that begin within a cavity, in x, can lie in it.
    let within = |b: &Aabb| {
        let from = least.partition_point(|inner| inner.min[0] < b.min[0]);
        least[from..].iter().take_while(|inner| inner.min[0] <= b.max[0]).any(|inner| encloses(b, inner))
    };
    let tiny = |i: &usize| {
        let Totals { volume, area, bounds, .. } = &whole[*i];
        *volume < 0.0 && -volume < limit && area[1] == 0.0 && !within(bounds)
    };
    roots.iter().copied().filter(tiny).collect()
}

/// Why a solid in several pieces is refused.
fn refusal(p: &Components) -> String {
    let words = p.description();
    format!("the solid is not in one piece: {words}; drop them, make walls thicker, or change what cuts them off")
}
