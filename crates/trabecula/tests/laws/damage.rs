//! Meshes damaged at random, as regions: what comes out is closed, does not cross itself and holds what was there, or
//! it is refused with the reason.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use crate::common::{Random, cases, fault_of, lattice};
use geometry::math::{Vec3, add, apply, cross, norm, rotation, scale, sub, unit};
use geometry::mesh::Mesh;
use geometry::progress::Silent;
use geometry::repair::{CAPPED, Repair};
use rayon::prelude::*;
use trabecula::cell::Part;
use trabecula::extract::surface;
use trabecula::field::Field;
use trabecula::region::{MeshRegion, SignedDistance};
use trabecula::solid::Solid;

/// A cube [−1, 1]³ of n² squares a side, in triangles.
fn block(n: i32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut names: HashMap<[i32; 3], u32> = HashMap::new();
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let mut name = |u: i32, v: i32| {
                        let mut at = [0; 3];
                        (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, u, v);
                        *names.entry(at).or_insert_with(|| {
                            let place = at.map(|x| 2.0 * f64::from(x) / f64::from(n) - 1.0);
                            mesh.vertices.push(place);
                            mesh.vertices.len() as u32 - 1
                        })
                    };
                    let mut q = [name(i, j), name(i + 1, j), name(i + 1, j + 1), name(i, j + 1)];
                    if side == 0 {
                        q.reverse();
                    }
                    mesh.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                }
            }
        }
    }
    mesh
}

fn each(mut mesh: Mesh, f: impl Fn(Vec3) -> Vec3) -> Mesh {
    mesh.vertices.iter_mut().for_each(|v| *v = f(*v));
    mesh
}

/// A ring of 2·n·m triangles.
fn ring(n: u32, m: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let [u, v] = [f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)].map(|t| t * std::f64::consts::TAU);
            let r = 0.8 + 0.35 * v.cos();
            mesh.vertices.push([r * u.cos(), r * u.sin(), 0.35 * v.sin()]);
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A part about 1 in size, and a ball within it: a block, a ball, a ball with bumps, a ring.
fn part(some: &mut Random) -> (Mesh, Vec3, f64) {
    let n = 6 + some.below(7) as i32;
    let ball = |n| each(block(n), unit);
    let (mesh, at, clear) = match some.below(4) {
        0 => (each(block(n), |v| [v[0], 0.7 * v[1], 0.9 * v[2]]), 0.0, 0.7),
        1 => (ball(n), 0.0, 0.9),
        2 => {
            let bump = |v: Vec3| 1.0 + 0.1 * (5.0 * v[0]).sin() * (4.0 * v[1] + 1.0).cos();
            (each(ball(2 * n), |v| scale(v, bump(v))), 0.0, 0.8)
        }
        _ => (ring(3 * n as u32, 2 * n as u32), 0.8, 0.3),
    };
    let (turn, by) = (rotation(some.point(180.0)), some.point(2.0));
    let place = |v: Vec3| add(apply(&turn, v), by);
    (each(mesh, place), place([at, 0.0, 0.0]), clear)
}

/// A mesh that is being damaged, and what is known of the solid that it was.
struct Victim {
    mesh: Mesh,
    /// The boundary of the solid.
    truth: Mesh,
    /// A ball within the solid.
    inside: (Vec3, f64),
    /// By how much the damage explains a volume that is off, mm³.
    slack: f64,
    /// How far the damage may move the surface, mm.
    margin: f64,
    /// Share of the surface that is missing.
    missing: f64,
    /// Whether the numbers are not numbers.
    broken: bool,
}

const KINDS: [&str; 12] = [
    "jittered", // first: corners that are apart already would be torn
    "inner body",
    "common faces",
    "triangles lost",
    "patch lost",
    "flipped",
    "duplicates",
    "split corners",
    "not finite",
    "degenerate",
    "inside out",
    "scaled",
];

impl Victim {
    fn area(&self, i: usize) -> f64 {
        let [a, b, c] = self.mesh.corners(i);
        norm(cross(sub(b, a), sub(c, a))) / 2.0
    }

    /// Length of an edge, on average (of even triangles).
    fn edge(&self) -> f64 {
        (2.31 * self.truth.area() / self.truth.triangles.len() as f64).sqrt()
    }

    /// Triangles that hang together, from one on.
    fn patch(&self, first: usize, count: usize) -> Vec<usize> {
        let mut found = vec![first];
        let mut corners: HashSet<u32> = self.mesh.triangles[first].into();
        while found.len() < count {
            let next = (0..self.mesh.triangles.len()).find(|i| {
                let t = &self.mesh.triangles[*i];
                !found.contains(i) && t.iter().filter(|v| corners.contains(v)).count() >= 2
            });
            let Some(next) = next else { break };
            corners.extend(self.mesh.triangles[next]);
            found.push(next);
        }
        found
    }

    /// Leaves out a patch that begins somewhere.
    fn lose(&mut self, some: &mut Random, count: usize) {
        let all = self.truth.area();
        let mut gone = self.patch(some.below(self.mesh.triangles.len()), count);
        let area: f64 = gone.iter().map(|i| self.area(*i)).sum();
        let places = gone.iter().flat_map(|i| self.mesh.corners(*i));
        let from = self.mesh.corners(gone[0])[0];
        let wide = places.map(|p| norm(sub(p, from))).fold(0.0, f64::max);
        self.missing += area / all;
        // The cap lies over the gap, no farther from the surface that was there than the gap is wide.
        self.slack += area * wide;
        self.margin = self.margin.max(wide);
        gone.sort_unstable();
        for i in gone.into_iter().rev() {
            self.mesh.triangles.swap_remove(i);
        }
    }

    fn damage(&mut self, kind: &str, some: &mut Random) {
        let count = self.mesh.triangles.len();
        let edge = self.edge();
        match kind {
            "jittered" => {
                // Corners may pass their neighbours: the surface folds and crosses itself.
                let by = edge * some.between(0.0, 0.4);
                for v in &mut self.mesh.vertices {
                    *v = add(*v, some.point(by));
                }
                self.slack += by * self.truth.area();
                self.margin += 3f64.sqrt() * by;
            }
            "triangles lost" => {
                for _ in 0..1 + some.below(8) {
                    self.lose(some, 1);
                }
            }
            "patch lost" => {
                let most = if some.share() < 0.2 { count / 5 } else { count / 40 };
                let patch = 2 + some.below(most);
                self.lose(some, patch);
            }
            "flipped" => {
                let share = some.between(0.0, 0.3);
                let mut flipped: Vec<usize> = (0..count).filter(|_| some.share() < share).collect();
                // A body within with half its faces flipped, as one of twelve may have, is another body.
                let (at, clear) = self.inside;
                let near = |v: &Vec3| norm(sub(*v, at)) < 0.6 * clear;
                let inner = |i: &usize| self.mesh.corners(*i).iter().all(near);
                let of_inner = flipped.iter().filter(|i| inner(i)).count();
                if 2 * of_inner >= (0..count).filter(inner).count() {
                    flipped.retain(|i| !inner(i));
                }
                for i in flipped {
                    self.mesh.triangles[i].swap(0, 1);
                }
            }
            "duplicates" => {
                for _ in 0..1 + some.below(40) {
                    let [a, b, c] = self.mesh.triangles[some.below(count)];
                    let copy = if some.share() < 0.5 { [b, c, a] } else { [b, a, c] };
                    self.mesh.triangles.push(copy);
                }
            }
            "split corners" => {
                // Every triangle with its own corners, the same or as rough exporters write them.
                let by = edge * [0.0, 1e-7, 1e-3][some.below(3)];
                let mut vertices = Vec::new();
                for t in &mut self.mesh.triangles {
                    *t = t.map(|v| {
                        vertices.push(add(self.mesh.vertices[v as usize], some.point(by)));
                        vertices.len() as u32 - 1
                    });
                }
                self.mesh.vertices = vertices;
                self.slack += 2.0 * by * self.truth.area();
                self.margin += 4.0 * by;
            }
            "not finite" => {
                let v = self.mesh.triangles[some.below(count)][some.below(3)] as usize;
                let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][some.below(3)];
                self.mesh.vertices[v][some.below(3)] = bad;
                self.broken = true;
            }
            "degenerate" => {
                for _ in 0..1 + some.below(20) {
                    let [a, b, _] = self.mesh.triangles[some.below(count)];
                    let middle = self.mesh.vertices.len() as u32;
                    let [p, q] = [a, b].map(|v| self.mesh.vertices[v as usize]);
                    self.mesh.vertices.push(scale(add(p, q), 0.5));
                    let flat = [[a, b, middle], [a, a, b], [middle; 3]][some.below(3)];
                    self.mesh.triangles.push(flat);
                }
            }
            "inner body" => {
                // Within the solid, facing out (it changes nothing) or in (a cavity).
                let cavity = some.share() < 0.5;
                let (at, clear) = self.inside;
                let mut body = each(block(1 + some.below(3) as i32), |v| add(scale(v, 0.3 * clear), at));
                if cavity {
                    body.triangles.iter_mut().for_each(|t| t.swap(0, 1));
                    join(&mut self.truth, &body);
                }
                join(&mut self.mesh, &body);
            }
            "common faces" => {
                // A second body, whose base is a patch of the surface and whose tip is in the solid.
                let off = |i: &usize| norm(sub(self.mesh.corners(*i)[0], self.inside.0));
                let near = (0..count).min_by(|a, b| off(a).total_cmp(&off(b)));
                let patch = self.patch(near.unwrap_or(0), 1 + some.below(count / 20));
                let tip = self.mesh.vertices.len() as u32;
                self.mesh.vertices.push(self.inside.0);
                let own: Vec<[u32; 3]> = patch.iter().map(|i| self.mesh.triangles[*i]).collect();
                let sides = own.iter().flat_map(|t| [0, 1, 2].map(|k| (t[k], t[(k + 1) % 3])));
                let sides: HashSet<(u32, u32)> = sides.collect();
                let rim = sides.iter().filter(|(a, b)| !sides.contains(&(*b, *a)));
                let mut walls: Vec<[u32; 3]> = rim.map(|(a, b)| [*b, *a, tip]).collect();
                walls.sort_unstable();
                self.mesh.triangles.extend(own);
                self.mesh.triangles.extend(walls);
            }
            "inside out" => self.mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2)),
            "scaled" => {
                let by = 10f64.powf(some.between(-3.0, 3.0));
                for mesh in [&mut self.mesh, &mut self.truth] {
                    mesh.vertices.iter_mut().for_each(|v| *v = scale(*v, by));
                }
                self.slack *= by.powi(3);
                self.margin *= by;
                self.inside = (scale(self.inside.0, by), self.inside.1 * by);
            }
            _ => unreachable!("{kind}"),
        }
    }
}

/// Adds a body to a mesh.
fn join(mesh: &mut Mesh, body: &Mesh) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(&body.vertices);
    let moved = body.triangles.iter().map(|t| t.map(|v| v + first));
    mesh.triangles.extend(moved);
}

/// What became of a case.
enum End {
    /// A solid, and its volume's error over what the damage explains.
    Solid(f64),
    Refused(&'static str),
}

/// One damaged mesh: its damages, and what became of it or what is wrong.
fn run(seed: u64) -> (Vec<&'static str>, Result<End, String>) {
    let mut some = Random(seed);
    let (mesh, at, clear) = part(&mut some);
    let mut kinds: Vec<&str> = Vec::new();
    for _ in 0..1 + some.below(4) {
        let kind = KINDS[some.below(KINDS.len())];
        if !kinds.contains(&kind) && (kind != "not finite" || some.share() < 0.3) {
            kinds.push(kind);
        }
    }
    // A second body must know what is solid; and where two have faces in common none can tell a flipped one.
    if kinds.contains(&"common faces") {
        kinds.retain(|k| !["inner body", "flipped"].contains(k));
    }
    kinds.sort_by_key(|k| KINDS[..3].iter().position(|f| f == k).unwrap_or(3));
    let mut victim =
        Victim { truth: mesh.clone(), mesh, inside: (at, clear), slack: 0.0, margin: 0.0, missing: 0.0, broken: false };
    for kind in &kinds {
        victim.damage(kind, &mut some);
    }
    let end = judge(victim);
    (kinds, end)
}

fn judge(victim: Victim) -> Result<End, String> {
    let truth = MeshRegion::new(victim.truth, Repair::Refuse).map_err(|e| e.message)?;
    let region = match MeshRegion::new(victim.mesh, Repair::Auto) {
        Err(e) if victim.broken && e.message.contains("vertex") => {
            return Ok(End::Refused("numbers that are not finite"));
        }
        Err(e) if victim.missing > 0.5 * CAPPED && e.message.contains("hole") => {
            return Ok(End::Refused("holes too large"));
        }
        Err(e) => return Err(format!("refused: {}", e.message)),
        Ok(_) if victim.broken => return Err("taken though not finite".into()),
        Ok(region) => region,
    };
    let (got, want) = (region.mesh().volume(), truth.mesh().volume());
    let area = truth.mesh().area();
    let size = norm(truth.bounds().size());
    let rounding = 1e-9 * size * area;
    let share = (got - want).abs() / (victim.slack + rounding);
    if share > 1.0 {
        return Err(format!("volume {got}, not {want} within {:e}: {:?}", victim.slack, region.repaired()));
    }
    // Inside and outside are where they were.
    let mut some = Random(7);
    let middle = truth.bounds().center();
    for _ in 0..300 {
        let p = add(middle, some.point(0.6 * size));
        let (d, t) = (region.value(p), truth.value(p));
        if t.abs() > victim.margin + 1e-9 * size && (d < 0.0) != (t < 0.0) {
            return Err(format!("{d} at {p:?}, not {t}: {:?}", region.repaired()));
        }
    }
    let shared: Arc<dyn SignedDistance> = Arc::new(region);
    let wavelength = size / some.between(3.0, 6.0);
    let field = lattice("gyroid", Part::Sheet, 0.4, [wavelength; 3], [11.0, 22.0, 33.0]);
    for (what, field) in [("full", None), ("gyroid", Some(field))] {
        let edge = wavelength / some.between(4.0, 9.0);
        let full = field.is_none();
        let solid = Solid::new(shared.clone(), field, wavelength);
        let s = surface(&solid, edge, &Silent).map_err(|e| format!("{what}: {e:?}"))?;
        if let Some(fault) = fault_of(&solid, edge, &s) {
            return Err(format!("{what} at {edge}: {fault}"));
        }
        // The surface stays in the cells that the boundary passes, and their middles are half a step off it on average.
        if full && (s.mesh.volume() - got).abs() > 0.5 * edge * area {
            return Err(format!("{what} at {edge}: {} for {got}", s.mesh.volume()));
        }
    }
    Ok(End::Solid(share))
}

/// 2000 cases in `make campaign`.
#[test]
fn damaged_meshes_are_repaired_or_refused() {
    let all: Vec<_> = (0..cases(14)).into_par_iter().map(run).collect();
    let (mut solids, mut worst, mut refused) = (0, 0.0f64, BTreeMap::new());
    let mut faults = Vec::new();
    for (seed, (kinds, end)) in all.iter().enumerate() {
        match end {
            Ok(End::Solid(share)) => (solids, worst) = (solids + 1, worst.max(*share)),
            Ok(End::Refused(why)) => *refused.entry(why).or_insert(0) += 1,
            Err(what) => faults.push(format!("{seed} {kinds:?}: {what}")),
        }
    }
    println!(
        "{} damaged meshes: {solids} solids (volume off by {worst:.3} of what is explained at most), refused {refused:?}, wrong {}",
        all.len(),
        faults.len()
    );
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(solids > all.len() / 2);
}
