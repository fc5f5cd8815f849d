//! Shells: triangles on the mid-surface of a sheet, with the wall's thickness at each node.
//!
//! The two faces of a sheet are u − t and −u − t for one function u and the level t, so half their difference is u, whose zero
//! set in the region is the mid-surface, of one lattice or of a blend. It is extracted as the surface of the space on its one side,
//! without that space's cuts; triangles are improved; and nodes are moved onto it, those of the border within bounding planes. The
//! thickness is the length of the normal between the two faces.

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::fault::{Fault, counted, number};
use geometry::fe_mesh::{FeSet, ShellMesh};
use geometry::math::{Aabb, Interval, Vec3, add, dot, norm, scale, sub};
use geometry::progress::{Progress, Stage, Stopped};
use geometry::roots::{Bracket, Tolerance};
use geometry::smooth::smooth;
use geometry::surface_mesh::SurfaceMesh;
use rayon::prelude::*;

use crate::extract::surface;
use crate::field::{Block, Field};
use crate::implicit::Implicit;
use crate::region::Region;
use crate::solid::Solid;
use crate::volume_mesh::PLANES;

mod border_slivers;

/// Most that a node in the middle of an edge moves off it, as a share of its length.
const BULGE: f64 = 0.2;
/// A share of the mesh's size within which a node lies on a bounding plane.
const NEAR: f64 = 1e-6;
/// Most steps to a zero.
const STEPS: usize = 24;

/// How a shell is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellMeshOptions {
    /// Grid spacing, mm: edges are about as long.
    pub edge: f64,
    /// Whether triangles are quadratic.
    pub quadratic: bool,
}

/// The mesh of a shell, and what should be known about it.
pub struct MeshedShell {
    /// The mesh.
    pub mesh: ShellMesh,
    /// Edges of quadratic triangles that stayed straight, on the border where it is no plane normal to an axis.
    pub straight: usize,
    /// What should be known about it.
    pub warning: Option<Fault>,
}

/// The mesh of a sheet's mid-surface, with the border's edges on bounding planes, the whole border and `sets` as named sets. The same
/// for any number of threads.
///
/// # Errors
/// A design that is no sheet, or has a skin or keep zones; an edge too fine or too coarse; a wall without thickness; an interruption.
pub fn shell_mesh(
    solid: &Solid,
    sets: &[(String, Region)],
    options: &ShellMeshOptions,
    progress: &dyn Progress,
) -> Result<MeshedShell, Stopped> {
    let refuse = |message: &str| Err(Stopped::Refused(Fault::new("of", message)));
    let Some(faces) = solid.field.as_ref().and_then(|f| f.faces()) else {
        return refuse(
            "shells are made of sheets, whether of one lattice or of a blend of sheets; mesh this design as a solid",
        );
    };
    if !solid.filled.is_empty() {
        return refuse(
            "shells are made of a sheet alone; leave out skin and keep zones, or mesh this design as a solid",
        );
    }
    let lipschitz = faces[0].lipschitz().max(faces[1].lipschitz());
    let middle = Arc::new(MidSurface { faces, lipschitz });
    let half = Solid::new(solid.region.clone(), Some(middle.clone()), solid.wavelength);
    let stage = |from, to| Stage { whole: progress, from, to };
    let whole = surface(&half, options.edge, &stage(0.0, 0.4))?;
    let (better, _) = smooth(&whole, &stage(0.4, 0.9))?;
    let SurfaceMesh { mesh: mut open, .. } = better.uncapped();
    if open.triangles.is_empty() {
        return refuse("the region holds none of the sheet's mid-surface");
    }
    let bounds = solid.region.bounds();
    // First, since the border may then run through an edge of the bounds.
    let mut inner = vec![true; open.vertices.len()];
    let ends = |(t, k): (u32, u8)| [k, (k + 1) % 3].map(|k| open.triangles[t as usize][k as usize]);
    border(&open.triangles).into_iter().flat_map(ends).for_each(|n| inner[n as usize] = false);
    open.vertices.par_iter_mut().zip(&inner).for_each(|(p, inner)| {
        let common = planes(*p, &bounds);
        if *inner || common != 0 {
            *p = middle.nearest(*p, 0.5 * options.edge, |g| if *inner { g } else { held(g, common) }).unwrap_or(*p);
        }
    });
    border_slivers::merge(&mut open, &bounds, options.edge);
    let border = border(&open.triangles);
    let mut mesh = ShellMesh { nodes: open.vertices, triangles: open.triangles, ..ShellMesh::default() };
    let straight = if options.quadratic { add_middles(&mut mesh, &border, &middle, &bounds) } else { 0 };
    let reach = 0.5 * solid.wavelength;
    mesh.thickness = mesh.nodes.par_iter().map(|p| middle.thickness(*p, reach)).collect();
    if let Some(n) = mesh.thickness.iter().position(|t| *t <= NEAR * solid.wavelength) {
        let at = mesh.nodes[n].map(|x| number((1e3 * x).round() / 1e3)).join(", ");
        return refuse(&format!("the wall has no thickness at ({at}) mm; keep its level above 0 in the whole region"));
    }
    let warning = add_sets(&mut mesh, &border, &bounds, sets).or_else(|| thick(&mesh, options.edge));
    Ok(MeshedShell { mesh, straight, warning })
}

/// The edges of one triangle only.
fn border(triangles: &[[u32; 3]]) -> Vec<(u32, u8)> {
    let mut edges: BTreeMap<[u32; 2], Option<(u32, u8)>> = BTreeMap::new();
    for (t, corners) in (0..).zip(triangles) {
        for k in 0..3u8 {
            let (a, b) = (corners[k as usize], corners[(k as usize + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).and_modify(|e| *e = None).or_insert(Some((t, k)));
        }
    }
    let mut border: Vec<(u32, u8)> = edges.into_values().flatten().collect();
    border.sort_unstable();
    border
}

/// The bounding planes, as bits, that a point lies on.
fn planes(p: Vec3, bounds: &Aabb) -> u8 {
    let near = NEAR * norm(bounds.size());
    let on = |a: usize, side: usize| (p[a] - [bounds.min[a], bounds.max[a]][side]).abs() <= near;
    (0..6).fold(0, |bits, k| bits | u8::from(on(k / 2, k % 2)) << k)
}

/// What of a vector is in bounding planes, given as bits.
fn held(g: Vec3, planes: u8) -> Vec3 {
    [0, 1, 2].map(|a| if planes >> (2 * a) & 3 != 0 { 0.0 } else { g[a] })
}

/// Adds the nodes in the middle of edges, on the mid-surface where it is near; counts those on straight edges of the border.
fn add_middles(mesh: &mut ShellMesh, border: &[(u32, u8)], middle: &MidSurface, bounds: &Aabb) -> usize {
    let mut names: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let corners = mesh.nodes.len() as u32;
    let mut ends: Vec<[u32; 2]> = Vec::new();
    for t in &mesh.triangles {
        mesh.middles.push([0, 1, 2].map(|k| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *names.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                ends.push([a.min(b), a.max(b)]);
                corners + ends.len() as u32 - 1
            })
        }));
    }
    let mut outer = vec![false; ends.len()];
    border.iter().for_each(|(t, k)| outer[(mesh.middles[*t as usize][*k as usize] - corners) as usize] = true);
    let place = |(ends, outer): (&[u32; 2], &bool)| {
        let [a, b] = ends.map(|n| mesh.nodes[n as usize]);
        let (mean, most) = (scale(add(a, b), 0.5), BULGE * norm(sub(b, a)));
        let common = planes(a, bounds) & planes(b, bounds);
        if *outer && common == 0 {
            return (mean, true);
        }
        match middle.nearest(mean, most, |g| if *outer { held(g, common) } else { g }) {
            Some(p) => (p, false),
            None => (mean, true),
        }
    };
    let placed: Vec<(Vec3, bool)> = ends.par_iter().zip(&outer).map(place).collect();
    mesh.nodes.extend(placed.iter().map(|p| p.0));
    placed.iter().filter(|p| p.1).count()
}

/// Adds the sets that are not empty; gives what to say of the first one of the design that is.
fn add_sets(mesh: &mut ShellMesh, border: &[(u32, u8)], bounds: &Aabb, sets: &[(String, Region)]) -> Option<Fault> {
    let of_edges = |mesh: &ShellMesh, name: &str, edges: Vec<(u32, u8)>| {
        let elements = ascending(edges.iter().map(|e| e.0));
        let nodes = ascending(edges.iter().flat_map(|e| mesh.edge(*e)));
        FeSet { name: name.into(), nodes, elements, faces: edges, bulk: false }
    };
    let on: Vec<u8> = mesh.nodes.iter().map(|p| planes(*p, bounds)).collect();
    for (k, name) in PLANES.iter().flatten().enumerate() {
        let within = |e: &&(u32, u8)| mesh.edge(**e).take(2).all(|n| on[n as usize] >> k & 1 == 1);
        let edges: Vec<(u32, u8)> = border.iter().filter(within).copied().collect();
        if !edges.is_empty() {
            mesh.sets.push(of_edges(mesh, name, edges));
        }
    }
    if !border.is_empty() {
        mesh.sets.push(of_edges(mesh, "BORDER", border.to_vec()));
    }
    let near = NEAR * norm(bounds.size());
    let mean = |t: &[u32; 3]| scale(t.iter().fold([0.0; 3], |s, n| add(s, mesh.nodes[*n as usize])), 1.0 / 3.0);
    let means: Vec<Vec3> = mesh.triangles.iter().map(mean).collect();
    let mut empty = None;
    for (name, region) in sets {
        let mut depth = vec![0.0; means.len()];
        depth.par_chunks_mut(1024).zip(means.par_chunks(1024)).for_each(|(d, p)| region.values(p, d));
        let elements: Vec<u32> = (0..means.len() as u32).filter(|t| depth[*t as usize] <= near).collect();
        if elements.is_empty() {
            let nearest = depth.iter().fold(f64::INFINITY, |m, d| m.min(*d));
            let message = format!(
                "the set is empty: no triangle of the mesh lies within its region, the nearest is {nearest:.3} mm away; \
                 enlarge the region or move it"
            );
            empty = empty.or(Some(Fault::new(format!("set.{name}"), message)));
            continue;
        }
        let edges = border.iter().filter(|e| depth[e.0 as usize] <= near).copied().collect();
        let nodes = ascending(elements.iter().flat_map(|t| mesh.nodes_of(*t as usize)));
        mesh.sets.push(FeSet { name: name.clone(), nodes, elements, faces: edges, bulk: true });
    }
    empty
}

fn ascending(of: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut of: Vec<u32> = of.collect();
    of.sort_unstable();
    of.dedup();
    of
}

/// What to say of a wall as thick as its triangles are wide: no shell.
fn thick(mesh: &ShellMesh, edge: f64) -> Option<Fault> {
    let thicker = mesh.thickness.iter().filter(|t| **t > 2.0 * edge).count();
    (2 * thicker > mesh.thickness.len()).then(|| {
        let mean = mesh.thickness.iter().sum::<f64>() / mesh.thickness.len() as f64;
        let message = format!(
            "the wall, {mean:.2} mm thick in the mean, is thicker than two edges of {} mm at {}; use an edge of {:.2} mm or \
             more, or mesh the design as a solid",
            number(edge),
            counted(thicker, "node"),
            0.5 * mean,
        );
        Fault::new("edge", message)
    })
}

/// The function u of a sheet whose faces are u − t and −u − t.
struct MidSurface {
    faces: [Arc<dyn Implicit>; 2],
    lipschitz: f64,
}

impl MidSurface {
    /// The zero of u from `p` on, by Newton's steps along what `along` makes of the gradient; `None` if it is farther than `most` (mm).
    fn nearest(&self, start: Vec3, most: f64, along: impl Fn(Vec3) -> Vec3) -> Option<Vec3> {
        let mut p = start;
        for _ in 0..STEPS {
            let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
            self.gradients(&[p], &mut value, &mut gradient);
            let way = along(gradient[0]);
            let slope = dot(gradient[0], way);
            if slope <= 0.0 {
                return None;
            }
            let step = scale(way, -value[0] / slope);
            p = add(p, step);
            if norm(sub(p, start)) > most {
                return None;
            }
            if norm(step) <= 1e-12 * (1.0 + norm(p)) {
                break;
            }
        }
        Some(p)
    }

    /// The length (mm) of the normal at `p` between both faces, each taken to be at most `reach` away.
    fn thickness(&self, p: Vec3, reach: f64) -> f64 {
        let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
        self.gradients(&[p], &mut value, &mut gradient);
        let long = norm(gradient[0]);
        let normal = scale(gradient[0], 1.0 / long);
        let [upper, lower] = [0, 1].map(|k| {
            let way = if k == 0 { normal } else { scale(normal, -1.0) };
            way_out(&*self.faces[k], p, way, reach)
        });
        upper + lower
    }
}

/// How far (mm) it is from `p` in the direction `way` to where a function that is negative at `p` becomes positive, at most `reach`: Newton's method
/// between bounds, after the first of even steps at which it is.
fn way_out(face: &dyn Implicit, p: Vec3, way: Vec3, reach: f64) -> f64 {
    let at = |s: f64| {
        let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
        face.gradients(&[add(p, scale(way, s))], &mut value, &mut gradient);
        [value[0], dot(gradient[0], way)]
    };
    let march = reach / 32.0;
    let mut high = march;
    while at(high)[0] <= 0.0 {
        high += march;
        if high > reach {
            return reach;
        }
    }
    Bracket::of_signs(high - march, high).newton(high, Tolerance::absolute(1e-13 * reach), at)
}

impl Field for MidSurface {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut other = vec![0.0; out.len()];
        self.faces[0].values(points, out);
        self.faces[1].values(points, &mut other);
        out.iter_mut().zip(other).for_each(|(u, o)| *u = 0.5 * (*u - o));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut others, mut slopes) = (vec![0.0; values.len()], vec![[0.0; 3]; values.len()]);
        self.faces[0].gradients(points, values, gradients);
        self.faces[1].gradients(points, &mut others, &mut slopes);
        values.iter_mut().zip(others).for_each(|(u, o)| *u = 0.5 * (*u - o));
        gradients.iter_mut().zip(slopes).for_each(|(g, o)| *g = scale(sub(*g, o), 0.5));
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let [upper, lower] = [0, 1].map(|k| self.faces[k].bound(b));
        Interval { lo: 0.5 * (upper.lo - lower.hi), hi: 0.5 * (upper.hi - lower.lo) }
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        let mut other = vec![0.0; out.len()];
        self.faces[0].fill(block, out);
        self.faces[1].fill(block, &mut other);
        out.iter_mut().zip(other).for_each(|(u, o)| *u = 0.5 * (*u - o));
    }
}

impl Implicit for MidSurface {
    fn lipschitz(&self) -> f64 {
        self.lipschitz
    }

    fn has_creases(&self) -> bool {
        self.faces.iter().any(|f| f.has_creases())
    }
}
