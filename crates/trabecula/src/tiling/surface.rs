//! Direct surface extraction from a tiling: every tetrahedron of the mesh is cut by itself, without a grid.
//!
//! Every tetrahedron is divided into the same small ones, and `tet_surface` has the surface in it. Where the level and the cell
//! are the same everywhere, that is done once and mapped to all tetrahedra. Where tetrahedra overlap, the blended function is
//! evaluated at the nodes of each.
//!
//! *Closed, oriented, manifold, embedded.* A tetrahedron takes its corners in the order of the mesh's nodes. On a common face
//! two tetrahedra then have the same small triangles, values and derivatives in all bits, hence the same vertices of the
//! surface; nothing is welded by comparing coordinates. Tetrahedra at the boundary may be bent onto a region (`bent_nodes`). The mesh's
//! boundary is a manifold (`component_links::manifold` refuses
//! others), and caps are polygons in its small triangles. Affine maps keep embedded surfaces embedded.
//!
//! *After rounding to single precision.* Vertices stay `MARGIN` of a step away from nodes, so parts of the surface that do not
//! meet are separated by that share of a small tetrahedron's height. Designs where rounding is not well below are refused.

mod bending;
mod bent_nodes;
mod component_links;
mod connectivity;
mod cubic_root;
mod shared_vertices;
mod small_simplices;
mod tet_surface;
mod volume_shift;

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::{NodalLevel, Tiling};
use crate::cell::tet::{NamedTetCell, Subdivision, SubdivisionNodes};
use crate::map::CarrierMesh;
use crate::map::tet_map::NONE;
use crate::surface_maker::{
    self, Estimate, Resolved, StlStream, Store, Summary, SurfaceMaker, SurfaceOptions, SurfaceSink, Totals, not_empty,
};
pub use bending::Bending;
use bent_nodes::{BentNodes, Places};
use component_links::ComponentLinks;
pub use connectivity::{Connectivity, ZonePair, connectivity, steps_enough};
use geometry::fault::{Fault, number, position};
use geometry::formats::stl;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;
use geometry::tetmesh::TetMesh;
use shared_vertices::SharedVertices;
use small_simplices::Template;
use tet_surface::{Core, CornerLevels, MARGIN, TetBuffers, TetSurface};
use volume_shift::Stencil;

/// Tetrahedra that a thread takes at once.
const CHUNK: usize = 128;
/// The least and the most steps along the edges of tetrahedra.
const STEPS: [usize; 2] = [4, 64];

/// Data common to all tetrahedra.
struct MeshingContext<'a> {
    tiling: &'a Tiling,
    /// The levels of the surface: of one cell those that make up for the volume that chords cost.
    level: NodalLevel,
    template: Template,
    /// For each cell, its values at nodes, divided by its scale, and its slopes along edges.
    cells: Vec<(SubdivisionNodes, Vec<f64>, Vec<[f64; 2]>)>,
    /// The surface for each set of capped faces, where all tetrahedra have the same.
    same: [OnceLock<TetSurface>; 16],
    /// Where the mesh is bent onto a region.
    bent: OnceLock<Option<BentNodes>>,
    middle: Vec3,
}

/// The surface in one tetrahedron: its own, or one shared by all with the same capped faces.
enum TetSurfaceRef<'a> {
    Shared(&'a TetSurface),
    Own(Box<TetSurface>),
}

impl std::ops::Deref for TetSurfaceRef<'_> {
    type Target = TetSurface;

    fn deref(&self) -> &TetSurface {
        match self {
            TetSurfaceRef::Shared(p) => p,
            TetSurfaceRef::Own(p) => p,
        }
    }
}

/// The surface in a range of tetrahedra.
struct Chunk<'a> {
    surfaces: Vec<TetSurfaceRef<'a>>,
    totals: Vec<Totals>,
    /// Binary STL records if requested, otherwise the positions of the vertices.
    records: Vec<u8>,
    positions: Vec<Vec3>,
}

/// The number of steps along the edge of a tetrahedron for a spacing of `edge` (mm).
fn steps(tets: &CarrierMesh, edge: f64) -> Result<usize, Fault> {
    let mean = tets.mean_edge();
    let n = (mean / edge).round();
    if !(edge > 0.0 && n <= STEPS[1] as f64) {
        let message = format!(
            "edge is {} mm; edges of tetrahedra are {mean:.3} mm long on average and are cut into at most {} steps: use {} mm or more",
            number(edge),
            STEPS[1],
            number((1e4 * mean / STEPS[1] as f64).ceil() / 1e4)
        );
        return Err(Fault::new("edge", message));
    }
    let n = (n as usize).max(STEPS[0]);
    for t in 0..tets.len() {
        let c = tets.corners(t);
        let largest = c.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let areas = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
            .map(|[i, j, k]| norm(cross(sub(c[j], c[i]), sub(c[k], c[i]))) / 2.0);
        let height = 3.0 * tets.volume(t) / areas.iter().fold(0.0f64, |m, a| m.max(*a));
        // Half an ulp along each axis, for both of two points, and as much again to be safe.
        let rounding = 4.0 * 3f64.sqrt() * largest * f64::from(f32::EPSILON) / 2.0;
        let apart = MARGIN * height / n as f64;
        if apart < rounding {
            let message = format!(
                "the tetrahedron at {} is {height:.2e} mm high: in {n} steps its surface is lost in the rounding \
                 of single precision; use a larger edge, or a mesh without such flat tetrahedra, or move the part nearer the origin",
                position(c[0])
            );
            return Err(Fault::new("edge", message));
        }
    }
    Ok(n)
}

impl<'a> MeshingContext<'a> {
    fn new(tiling: &'a Tiling, edge: f64) -> Result<MeshingContext<'a>, Fault> {
        MeshingContext::in_steps(tiling, steps(&tiling.map, edge)?)
    }

    /// With `n` steps along the edge of a tetrahedron.
    fn in_steps(tiling: &'a Tiling, n: usize) -> Result<MeshingContext<'a>, Fault> {
        let grid = Subdivision { n };
        component_links::manifold(&tiling.map)?;
        let template = Template::new(grid);
        let cells = tiling.cells.iter().map(|c| {
            let mut nodes = SubdivisionNodes::new(&c.cell, grid);
            let slopes = template.edges.iter().map(|[a, b]| {
                let (a, b) = (*a as usize, *b as usize);
                [nodes.slope(a, b) / c.scale, -nodes.slope(b, a) / c.scale]
            });
            let slopes = slopes.collect();
            let values = nodes.values.iter().map(|v| v / c.scale).collect();
            nodes.values = Vec::new();
            (nodes, values, slopes)
        });
        let cells: Vec<(SubdivisionNodes, Vec<f64>, Vec<[f64; 2]>)> = cells.collect();
        let level = match &cells[..] {
            [(nodes, values, slopes)] if tiling.map.overlap() <= 0.0 => {
                Stencil { nodes, template: &template, values, slopes }.shifted(tiling)
            }
            _ => tiling.level.clone(),
        };
        Ok(MeshingContext {
            tiling,
            level,
            cells,
            template,
            same: Default::default(),
            bent: OnceLock::new(),
            middle: tiling.map.bounds().center(),
        })
    }

    /// Whether all tetrahedra with the same capped faces have the same surface.
    fn alike(&self) -> bool {
        !self.tiling.varies() && self.tiling.map.overlap() <= 0.0
    }

    /// The faces on the boundary, one bit each.
    fn mask(&self, t: usize) -> u8 {
        let across = self.tiling.map.across(t);
        (0..4).fold(0, |m, i| m | u8::from(across[i] == NONE) << i)
    }

    /// The nodes of the small tetrahedra, where they are bent.
    fn places(&self, t: usize) -> Option<Places> {
        self.bent_nodes()?.places(&self.tiling.map, t, &self.cells[0].0)
    }

    /// How nodes are moved. Parallel itself, so it is asked for before parallel work that needs it, which would wait for itself.
    fn bent_nodes(&self) -> Option<&BentNodes> {
        let nodes = &self.cells[0].0;
        self.bent.get_or_init(|| BentNodes::new(&self.tiling.map, nodes, &self.template)).as_ref()
    }

    fn tet_surface(&self, t: usize, scratch: &mut TetBuffers) -> TetSurfaceRef<'_> {
        let mask = self.mask(t);
        if self.tiling.map.overlap() > 0.0 {
            return TetSurfaceRef::Own(Box::new(self.blended(t, mask, scratch)));
        }
        let (nodes, values, slopes) = &self.cells[0];
        let cut = |core: &Core, scratch: &mut TetBuffers| {
            TetSurface::new(nodes, &self.template, core, self.tiling.part, mask, scratch)
        };
        if let (NodalLevel::Same(level), true) = (&self.level, self.alike()) {
            let levels = CornerLevels::Same(*level);
            return TetSurfaceRef::Shared(self.same[mask as usize].get_or_init(|| {
                let core = Core { values, slopes, levels };
                cut(&core, &mut TetBuffers::default())
            }));
        }
        // What is linear in the tetrahedron, summed in the order of the mesh's nodes: a zero added changes no bit, so on a
        // face all who have it get the same.
        let ids = self.tiling.map.tet(t);
        let n = nodes.grid.n as f64;
        let linear = |of: &[f64]| -> Vec<f64> {
            let v = ids.map(|i| of[i as usize]);
            let at = |k: &[u16; 4]| (0..4).fold(0.0, |s, i| s + f64::from(k[i]) * v[i]) / n;
            nodes.whole.iter().map(at).collect()
        };
        let levels = match &self.level {
            NodalLevel::Same(v) => vec![*v; nodes.whole.len()],
            NodalLevel::Nodes(of) => linear(of),
        };
        let levels = CornerLevels::Each(&levels);
        let mixed = self.tiling.cells.iter().any(|c| c.weights.is_some());
        if !mixed {
            let core = Core { values, slopes, levels };
            return TetSurfaceRef::Own(Box::new(cut(&core, scratch)));
        }
        let mut sum = vec![0.0; values.len()];
        let mut turns = vec![[0.0; 2]; slopes.len()];
        for (c, (_, values, slopes)) in self.tiling.cells.iter().zip(&self.cells) {
            let w = match &c.weights {
                Some(w) => linear(w),
                None => vec![1.0; values.len()],
            };
            for (s, (v, w)) in sum.iter_mut().zip(values.iter().zip(&w)) {
                *s += v * w;
            }
            for ((s, g), [a, b]) in turns.iter_mut().zip(slopes).zip(&self.template.edges) {
                let (a, b) = (*a as usize, *b as usize);
                let step = w[b] - w[a];
                s[0] += w[a] * g[0] + values[a] * step;
                s[1] += w[b] * g[1] + values[b] * step;
            }
        }
        let core = Core { values: &sum, slopes: &turns, levels };
        TetSurfaceRef::Own(Box::new(cut(&core, scratch)))
    }

    /// The surface of the blended function in a tetrahedron. Nodes are placed and evaluated by position alone: on a common face
    /// both tetrahedra find the same in all bits, since a corner that does not count adds a zero.
    fn blended(&self, t: usize, mask: u8, scratch: &mut TetBuffers) -> TetSurface {
        let nodes = &self.cells[0].0;
        let (corners, n) = (self.tiling.map.corners(t), nodes.grid.n as f64);
        let place = |k: &[u16; 4]| {
            let sum = (0..4).fold([0.0; 3], |s, i| add(s, scale(corners[i], f64::from(k[i]))));
            sum.map(|v| v / n)
        };
        let bent = self.places(t);
        let places: Vec<Vec3> = bent.map_or_else(|| nodes.whole.iter().map(place).collect(), |p| p.nodes);
        let known = self.tiling.known(&places);
        let values: Vec<f64> = known.iter().map(|k| k.f).collect();
        let levels: Vec<f64> = known.iter().map(|k| k.t).collect();
        let slopes = self.template.edges.iter().map(|[a, b]| {
            let (a, b) = (*a as usize, *b as usize);
            let step = sub(places[b], places[a]);
            [a, b].map(|i| dot(known[i].slope, step))
        });
        let slopes: Vec<[f64; 2]> = slopes.collect();
        let core = Core { values: &values, slopes: &slopes, levels: CornerLevels::Each(&levels) };
        TetSurface::new(nodes, &self.template, &core, self.tiling.part, mask, scratch)
    }

    /// Cuts a range of tetrahedra and sums up the totals of their surface components.
    fn chunk(&self, range: Range<usize>, scratch: &mut TetBuffers, stl: bool) -> Chunk<'_> {
        let mut out = Chunk {
            surfaces: Vec::with_capacity(range.len()),
            totals: Vec::new(),
            records: Vec::new(),
            positions: Vec::new(),
        };
        let mut vertices: Vec<Vec3> = Vec::new();
        for t in range {
            let surface = self.tet_surface(t, scratch);
            let corners = self.tiling.map.corners(t);
            vertices.clear();
            vertices.extend(surface.vertices.iter().map(|l| {
                let ab = add(scale(corners[0], l[0]), scale(corners[1], l[1]));
                add(add(ab, scale(corners[2], l[2])), scale(corners[3], l[3]))
            }));
            if let Some(places) = self.places(t) {
                // What is not moved has the same bits as in tetrahedra that are not.
                for (v, ([a, b], at)) in surface.between.iter().enumerate().filter(|v| places.moved(surface.zero[v.0]))
                {
                    let [p, q] = [a, b].map(|n| places.nodes[*n as usize]);
                    vertices[v] = add(p, scale(sub(q, p), *at));
                }
            }
            let first = out.totals.len();
            out.totals.resize(first + surface.solid_of.len(), Totals::ZERO);
            for (v, p) in vertices.iter().enumerate() {
                let total = &mut out.totals[first + surface.component[v] as usize];
                total.bounds = total.bounds.with(*p);
            }
            if stl {
                out.records.reserve(surface.triangles.len() * stl::RECORD);
            }
            let flipped = self.tiling.map.flipped(t);
            let mut next = surface.triangles.iter();
            for (component, count) in surface.triangle_counts.iter().enumerate() {
                let total = &mut out.totals[first + component];
                for (v, cap) in next.by_ref().take(*count as usize) {
                    let [a, b, c] = turned(*v, flipped).map(|v| vertices[v as usize]);
                    let n = cross(sub(b, a), sub(c, a));
                    total.triangles += 1;
                    total.volume += dot(sub(a, self.middle), n) / 6.0;
                    total.area[usize::from(*cap)] += norm(n) / 2.0;
                    if stl {
                        let corners = [a, b, c].map(|p| p.map(|x| x as f32));
                        stl::push_record(&mut out.records, corners);
                    }
                }
            }
            if !stl {
                out.positions.extend_from_slice(&vertices);
            }
            out.surfaces.push(surface);
        }
        out
    }

    /// Passes all tetrahedra to `take` in order.
    fn each<'s>(
        &'s self,
        progress: &dyn Progress,
        stl: bool,
        mut take: impl FnMut(usize, Chunk<'s>) -> Result<(), Stopped>,
    ) -> Result<(), Stopped> {
        self.bent_nodes();
        let total = self.tiling.map.len();
        let batch = CHUNK * 4 * rayon::current_num_threads();
        let make = |first: usize| -> Vec<Chunk> {
            let end = total.min(first + batch);
            let starts: Vec<usize> = (first..end).step_by(CHUNK).collect();
            starts
                .par_iter()
                .map_init(TetBuffers::default, |scratch, &i| self.chunk(i..end.min(i + CHUNK), scratch, stl))
                .collect()
        };
        let mut made = make(0);
        for first in (0..total).step_by(batch) {
            let end = total.min(first + batch);
            let mut next = Vec::new();
            // The next chunks are made while these are consumed.
            let taken = rayon::in_place_scope(|scope| {
                if end < total {
                    scope.spawn(|_| next = make(end));
                }
                (first..end)
                    .step_by(CHUNK)
                    .zip(std::mem::take(&mut made))
                    .try_for_each(|(start, chunk)| take(start, chunk))
            });
            taken?;
            made = next;
            if !progress.step(end as u64, total as u64) {
                return Err(Stopped::Interrupted);
            }
        }
        Ok(())
    }
}

#[inline]
fn turned([a, b, c]: [u32; 3], flipped: bool) -> [u32; 3] {
    if flipped { [a, c, b] } else { [a, b, c] }
}

/// Meshes a tiling, whose mesh is the whole region, by cutting its tetrahedra; the resolution is divided into their mean edge.
pub struct TilingSurface<'a>(pub &'a Tiling);

impl SurfaceMaker for TilingSurface<'_> {
    fn make(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn SurfaceSink,
        progress: &dyn Progress,
    ) -> Result<Resolved, Stopped> {
        let work = MeshingContext::new(self.0, options.resolution).map_err(Stopped::Refused)?;
        let (mut links, mut shared) = (ComponentLinks::default(), SharedVertices::default());
        let (mut vertices, mut count) = (0, 0u64);
        work.each(progress, false, |start, chunk| {
            let (mut totals, mut positions) = (&chunk.totals[..], &chunk.positions[..]);
            let (mut new, mut triangles, mut cut) = (Vec::new(), Vec::new(), Vec::new());
            for (t, surface) in (start..).zip(&chunk.surfaces) {
                let (mine, rest) = positions.split_at(surface.vertices.len());
                positions = rest;
                let ids = self.0.map.tet(t);
                let numbers = shared.numbers(ids, surface, mine, vertices, &mut new)?;
                let flipped = self.0.map.flipped(t);
                for (v, cap) in &surface.triangles {
                    triangles.push(turned(*v, flipped).map(|v| numbers[v as usize]));
                    cut.push(*cap);
                }
                let (of, rest) = totals.split_at(surface.solid_of.len());
                totals = rest;
                links.add(&self.0.map, t, work.mask(t), surface, of).map_err(Stopped::Refused)?;
            }
            vertices += new.len();
            count += triangles.len() as u64;
            out.add(&new, &triangles, &cut).map_err(Stopped::Io)
        })?;
        not_empty(count, options.resolution)?;
        links.graph().resolve(options.islands, options.resolution).map_err(Stopped::Refused)
    }

    /// Memory is bounded by the tetrahedra in flight and a few numbers for each.
    fn stream_stl(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn Store,
        progress: &dyn Progress,
    ) -> Result<Summary, Stopped> {
        let work = MeshingContext::new(self.0, options.resolution).map_err(Stopped::Refused)?;
        let mut links = ComponentLinks::default();
        let mut triangles = 0u64;
        let mut stream = StlStream::new(out, options.islands, progress)?;
        let scaled = stream.progress();
        work.each(&scaled, true, |start, chunk| {
            triangles += (chunk.records.len() / stl::RECORD) as u64;
            surface_maker::check_count(triangles)?;
            let mut totals = &chunk.totals[..];
            for (t, surface) in (start..).zip(&chunk.surfaces) {
                let (of, rest) = totals.split_at(surface.solid_of.len());
                totals = rest;
                links.add(&self.0.map, t, work.mask(t), surface, of).map_err(Stopped::Refused)?;
            }
            stream.write(&chunk.records)
        })?;
        not_empty(triangles, options.resolution)?;
        let found = links.graph().resolve(options.islands, options.resolution).map_err(Stopped::Refused)?;
        stream.finish(found, triangles)
    }

    /// Counted where the surface is the same in all tetrahedra, otherwise estimated from some of them.
    fn estimate(&self, edge: f64) -> Result<Estimate, Fault> {
        const SAMPLES: usize = 64;
        let work = MeshingContext::new(self.0, edge)?;
        let total = self.0.map.len();
        let step = if work.alike() { 1 } else { total.div_ceil(SAMPLES) };
        let mut scratch = TetBuffers::default();
        let (mut count, mut sampled) = (0.0, 0.0);
        for t in (step / 2..total).step_by(step) {
            count += work.tet_surface(t, &mut scratch).triangles.len() as f64;
            sampled += 1.0;
        }
        let triangles = count * total as f64 / sampled;
        let n = work.cells[0].0.grid.n as u64;
        Ok(Estimate {
            cells: [n * total as u64, n, n],
            triangles,
            held: 0.0,
            // Half as many vertices as triangles, of three f64 each.
            memory: triangles * (12.0 + 12.0 + 1.0),
            stl: stl::HEADER as f64 + triangles * stl::RECORD as f64,
        })
    }
}

/// The surface of a named tetrahedral cell at its own fraction, in a regular tetrahedron of edge 1 mm divided into `steps`
/// steps.
///
/// # Errors
/// Steps below 4 or above 64.
pub fn cell_surface(named: &NamedTetCell, steps: usize, progress: &dyn Progress) -> Result<SurfaceMesh, Stopped> {
    let cell = named.cell().map_err(Stopped::Refused)?;
    let h = 0.5f64.sqrt() / 2.0;
    let mesh = TetMesh {
        nodes: vec![[h, -h, -h], [-h, h, -h], [-h, -h, h], [h, h, h]],
        tets: vec![[0, 1, 2, 3]],
        zones: Vec::new(),
    };
    let map = CarrierMesh::new(&mesh, 0.0).map_err(Stopped::Refused)?;
    let level = NodalLevel::Same(cell.iso(named.part, named.fraction));
    let tiling = Tiling::new(Arc::new(map), Arc::new(cell), named.part, level);
    Ok(TilingSurface(&tiling).mesh(&SurfaceOptions::new(1.0 / steps as f64), progress)?.surface)
}
