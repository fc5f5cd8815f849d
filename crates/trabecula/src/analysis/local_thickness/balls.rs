//! The largest balls that fit, and which voxels they cover.
//!
//! A ball that cannot grow touches the surface at two places or more. Its centre lies between voxels, so a distance
//! transform alone makes it too small by up to a step. Here the ball is grown from a voxel, away from the triangle that
//! is nearest there, until it touches a triangle that is nearest to one of the voxels around: for two planes, or a
//! cylinder or sphere, that is exact wherever the voxels lie.

use rayon::prelude::*;

use super::bits::{Bits, masks, ones};
use super::lines::{MeshInSteps, NONE, Site};
use super::nearest_site::distance_squared;
use super::{SolidVoxels, Watch};
use geometry::math::{Vec3, add, dot, norm, scale, sub, unit};
use geometry::progress::Stopped;

/// Two touching places whose directions differ by less than 30° are one: the surface is smooth between them.
const SMOOTH: f64 = 0.866;
/// Directions more than 150° apart are opposite: a wall, not an edge.
const OPPOSITE: f64 = -0.866;
/// Within this many steps of a triangle its plane stands for the surface, which goes on smoothly.
const BESIDE: f64 = 1.0;
/// A ball belongs to a voxel if its centre is this near (steps, along each axis): half a step and some more, so that
/// none falls between two voxels.
const NEAR: f64 = 0.8;
/// Sites of neighbours are at most this far apart on one smooth surface, steps squared.
const APART: f32 = 6.0;
/// Steps of a ball's climb.
const CLIMBS: usize = 5;
/// This close (steps) a ball touches.
const TOUCH: f64 = 0.02;
/// Of a ball across a wall both sides are as near as this (steps).
const WALL: f64 = 0.1;
/// A ball that gains less than this by a step's move is as large as it can be.
const FLAT: f64 = 0.2;
/// A ball is left out if it reaches beyond a larger one by less than this share of its radius.
const SLACK: f32 = 1.0 / 40.0;
/// Layers painted by one thread at a time.
const LAYERS: usize = 4;

/// An inscribed ball, in steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub center: [f32; 3],
    pub radius: f32,
    /// Where it touches the lattice on opposite sides, across a wall or a neck: the way from one to the other.
    pub wall: Option<f32>,
}

/// Where a ball may be.
pub(super) struct BallSpace<'a> {
    pub grid: &'a SolidVoxels,
    pub shape: &'a MeshInSteps<'a>,
    pub sites: &'a [Site],
    pub nearest: &'a [u32],
    /// For each triangle whether it is a cut; empty if that is not known.
    pub cut: &'a [bool],
    /// Voxels that count.
    pub inside: &'a Bits,
    /// −1 in the solid, 1 in the pores: the side of the triangles' normals on which the space lies.
    pub side: f64,
    /// Where the space ends without a wall: the distance in steps, for voxels at the end.
    pub open: Option<&'a (dyn Fn([usize; 3]) -> f64 + Sync)>,
}

/// The surface about a triangle, as seen from a point.
#[derive(Clone, Copy)]
struct Foot {
    triangle: u32,
    /// The nearest point, and the direction from it.
    at: Vec3,
    away: Vec3,
    distance: f64,
    /// Whether the surface is a plane here, rather than an edge or a corner.
    plane: bool,
}

/// How far a ball can grow.
struct TangentBall {
    foot: Foot,
    radius: f64,
    other: Option<Foot>,
}

impl TangentBall {
    fn center(&self) -> Vec3 {
        add(self.foot.at, scale(self.foot.away, self.radius))
    }
}

impl BallSpace<'_> {
    /// Balls at all voxels near which one ends its growth, the largest first.
    pub(super) fn balls(&self, watch: &Watch) -> Result<Vec<Ball>, Stopped> {
        let [nx, ny, nz] = self.grid.shape;
        let found: Vec<Vec<Ball>> = (0..nz)
            .into_par_iter()
            .map(|z| {
                let mut balls = Vec::new();
                if !watch.tick() {
                    return balls;
                }
                let mut around = Vec::with_capacity(27);
                for y in 0..ny {
                    for x in (0..nx).filter(|x| self.inside.has(z * ny + y, *x)) {
                        balls.extend(self.ball([x, y, z], &mut around));
                    }
                }
                balls
            })
            .collect();
        watch.check()?;
        let mut balls = found.concat();
        // Equal radii in the order of the voxels: a stable sort.
        balls.par_sort_by(|a, b| b.radius.total_cmp(&a.radius));
        Ok(balls)
    }

    /// Those that reach beyond a larger one near them by more than a small share of their radius, and half a step at
    /// most: what the others cover first is left to the larger one, or to `reaching`.
    pub(super) fn needed(&self, balls: &[Ball]) -> Vec<Ball> {
        let mut kept: Vec<Ball> = Vec::with_capacity(balls.len() / 4);
        let mut at = vec![NONE; self.nearest.len()];
        for ball in balls {
            let v: [usize; 3] =
                core::array::from_fn(|a| (ball.center[a].round().max(0.0) as usize).min(self.grid.shape[a] - 1));
            let slack = (ball.radius * SLACK).min(0.5);
            let covered = self.cube(v).any(|w| {
                kept.get(at[self.grid.index(w)] as usize).is_some_and(|k| {
                    let apart = (0..3).map(|a| (k.center[a] - ball.center[a]).powi(2)).sum::<f32>();
                    apart.sqrt() + ball.radius <= k.radius + slack
                })
            });
            if !covered {
                at[self.grid.index(v)] = kept.len() as u32;
                kept.push(*ball);
            }
        }
        kept
    }

    /// The ball of a voxel, if one ends its growth there.
    fn ball(&self, v: [usize; 3], around: &mut Vec<u32>) -> Option<Ball> {
        let edge = self.open.filter(|_| self.at_end(v)).map(|room| room(v).max(0.0));
        if edge.is_none() && !self.between(v) {
            return None;
        }
        self.around(v, around);
        let own = self.own(v, around)?;
        let mut grown = self.grow(v, own, around);
        if let Some(room) = edge {
            if grown.radius > own.distance + room {
                grown.radius = own.distance + room;
                grown.other = None;
            }
        } else if grown.other.is_none() {
            return None;
        }
        let mut center = grown.center();
        if edge.is_none() && (0..3).any(|k| (center[k] - v[k] as f64).abs() > NEAR) {
            return None;
        }
        if edge.is_none() {
            center = self.climb(v, center, around);
        }
        let feet: Vec<Foot> = around.iter().map(|t| self.foot(center, *t)).collect();
        let least = feet.iter().fold(f64::INFINITY, |m, f| m.min(f.distance));
        let lattice = |t: u32| !self.cut.get(t as usize).copied().unwrap_or(false);
        let touching = |f: &&Foot| f.distance <= least + WALL && lattice(f.triangle);
        let across = feet.iter().filter(touching).flat_map(|a| {
            let others = feet.iter().filter(touching);
            others.filter(|b| dot(a.away, b.away) < OPPOSITE).map(|b| a.distance + b.distance)
        });
        let wall = across.reduce(f64::min).map(|d| d as f32);
        (least > 0.0 && least.is_finite()).then(|| Ball {
            center: center.map(|c| c as f32),
            radius: least as f32,
            wall,
        })
    }

    /// A ball that touches at two places or more may still grow where they leave it room to: moves it there, but not
    /// away from its voxel.
    fn climb(&self, v: [usize; 3], from: Vec3, around: &[u32]) -> Vec3 {
        let mut best = (from, 0.0);
        let mut at = from;
        for _ in 0..CLIMBS {
            let feet: Vec<Foot> = around.iter().map(|t| self.foot(at, *t)).collect();
            let least = feet.iter().fold(f64::INFINITY, |m, f| m.min(f.distance));
            if least > best.1 {
                best = (at, least);
            }
            let touching = feet.iter().filter(|f| f.distance <= least + TOUCH);
            let way = between(touching.map(|f| f.away));
            let rate = norm(way);
            if rate < FLAT {
                break;
            }
            let way = scale(way, 1.0 / rate);
            let to_side = |k: usize| {
                let off = at[k] - v[k] as f64;
                if way[k] == 0.0 { f64::INFINITY } else { (NEAR - off * way[k].signum()) / way[k].abs() }
            };
            let mut far = to_side(0).min(to_side(1)).min(to_side(2)).max(0.0);
            for f in feet.iter().filter(|f| f.distance > least + TOUCH) {
                let closing = rate - dot(f.away, way);
                if closing > 0.0 {
                    far = far.min((f.distance - least) / closing);
                }
            }
            if far < TOUCH {
                break;
            }
            at = add(at, scale(way, far));
        }
        best.0
    }

    /// Whether a neighbour belongs to another part of the surface.
    fn between(&self, v: [usize; 3]) -> bool {
        let Some(own) = self.site(v) else {
            return false;
        };
        let normals = &self.shape.normals;
        let n = normals[own.triangle as usize];
        self.beside(v).into_iter().flatten().any(|w| {
            let Some(site) = self.site(w) else {
                return false;
            };
            if site.triangle == own.triangle {
                return false;
            }
            let m = normals[site.triangle as usize];
            let turn = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
            let gap = (0..3).map(|k| (site.point[k] - own.point[k]).powi(2)).sum::<f32>();
            turn < SMOOTH as f32 || gap > APART
        })
    }

    /// Whether a neighbour lies beyond the end of the space without belonging to the solid, or beyond the grid.
    fn at_end(&self, v: [usize; 3]) -> bool {
        self.beside(v).into_iter().any(|w| {
            w.is_none_or(|w| {
                let row = w[2] * self.grid.shape[1] + w[1];
                !self.inside.has(row, w[0]) && !self.grid.solid.has(row, w[0])
            })
        })
    }

    /// The six neighbours, where there are such.
    fn beside(&self, v: [usize; 3]) -> [Option<[usize; 3]>; 6] {
        core::array::from_fn(|i| {
            let mut w = v;
            let axis = i / 2;
            w[axis] = if i % 2 == 0 {
                v[axis].checked_sub(1)?
            } else {
                Some(v[axis] + 1).filter(|n| *n < self.grid.shape[axis])?
            };
            Some(w)
        })
    }

    fn site(&self, v: [usize; 3]) -> Option<&Site> {
        let id = self.nearest[self.grid.index(v)];
        (id != NONE).then(|| &self.sites[id as usize])
    }

    /// The triangles that are nearest to the voxel and the 26 around it.
    fn around(&self, v: [usize; 3], out: &mut Vec<u32>) {
        out.clear();
        for w in self.cube(v) {
            if let Some(site) = self.site(w)
                && !out.contains(&site.triangle)
            {
                out.push(site.triangle);
            }
        }
    }

    /// The voxel and its 26 neighbours, within the grid.
    fn cube(&self, v: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        let span = |a: usize| v[a].saturating_sub(1)..(v[a] + 2).min(self.grid.shape[a]);
        let (xs, ys, zs) = (span(0), span(1), span(2));
        zs.flat_map(move |z| {
            let xs = xs.clone();
            ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
        })
    }

    /// The nearest of these to the voxel.
    fn own(&self, v: [usize; 3], around: &[u32]) -> Option<Foot> {
        let p = v.map(|c| c as f64);
        around.iter().map(|t| self.foot(p, *t)).min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// The surface about a triangle, as seen from `p`.
    fn foot(&self, p: Vec3, triangle: u32) -> Foot {
        let corners = self.shape.corners(triangle);
        let n = self.shape.normals[triangle as usize].map(|x| f64::from(x) * self.side);
        let height = dot(n, sub(p, corners[0]));
        let below = sub(p, scale(n, height));
        let on = closest(p, corners);
        let beside = sub(on, below);
        let near = dot(beside, beside) <= BESIDE * BESIDE;
        if near && height >= 0.0 {
            return Foot { triangle, at: below, away: n, distance: height, plane: true };
        }
        let off = sub(p, on);
        // A plane that leaves the point on its other side does not stand for the surface: there, the surface turns away.
        let behind = near && height > -BESIDE;
        Foot {
            triangle,
            at: on,
            away: unit(off),
            distance: if behind { f64::INFINITY } else { norm(off) },
            plane: false,
        }
    }

    /// The largest ball that touches `own` and none of the other triangles.
    fn grow(&self, v: [usize; 3], own: Foot, around: &[u32]) -> TangentBall {
        let p = v.map(|c| c as f64);
        let mut grown = TangentBall { foot: own, radius: f64::INFINITY, other: None };
        for &t in around.iter().filter(|t| **t != own.triangle) {
            // The place where it touches moves as the ball grows; twice is enough to follow.
            let mut seen = p;
            let mut met = None;
            for _ in 0..2 {
                let foot = self.foot(seen, t);
                if dot(foot.away, own.away) > SMOOTH {
                    met = None;
                    break;
                }
                let towards = sub(own.at, foot.at);
                let radius = if foot.plane {
                    dot(foot.away, towards) / (1.0 - dot(foot.away, own.away))
                } else {
                    -dot(towards, towards) / (2.0 * dot(own.away, towards))
                };
                // No point of the surface is nearer than `own`: a smaller radius comes from another triangle at the same edge.
                if !(radius >= 0.9 * own.distance - 0.05 && radius < grown.radius) {
                    met = None;
                    break;
                }
                met = Some((radius, foot));
                seen = add(own.at, scale(own.away, radius));
            }
            if let Some((radius, foot)) = met {
                grown.radius = radius;
                grown.other = Some(foot);
            }
        }
        grown
    }

    /// The radius of the ball that touches where the voxel is nearest to the surface, for voxels that no other covers.
    fn reaching(&self, v: [usize; 3], around: &mut Vec<u32>) -> f64 {
        self.around(v, around);
        let Some(own) = self.own(v, around) else {
            return 0.0;
        };
        if own.away == [0.0; 3] {
            return own.distance;
        }
        let mut radius = own.distance;
        // From voxel to voxel away from the surface, until the ball ends near one.
        for k in 0.. {
            let at = add(v.map(|c| c as f64), scale(own.away, f64::from(k)));
            let w = at.map(|c| c.round().max(0.0) as usize);
            let within = (0..3).all(|a| w[a] < self.grid.shape[a]);
            if !within || !self.inside.has(w[2] * self.grid.shape[1] + w[1], w[0]) {
                break;
            }
            // Where the surface is nearer than the ball allows, its end lies behind.
            let away = self.site(w).map_or(0.0, |s| distance_squared(w.map(|c| c as f32), s).sqrt());
            if k > 0 && away < own.distance + f64::from(k) - 1.0 {
                break;
            }
            radius = own.distance + f64::from(k);
            self.around(w, around);
            let grown = self.grow(v, own, around);
            if grown.radius <= radius + 1.0 {
                return grown.radius.max(own.distance);
            }
        }
        radius
    }

    /// For each voxel the radius of the largest ball that covers it (steps), 0 outside the space.
    pub(super) fn paint(&self, balls: &[Ball], watch: &Watch) -> Result<Vec<f32>, Stopped> {
        let [nx, ny, _] = self.grid.shape;
        let stride = self.inside.stride;
        let mut radii = vec![0f32; self.nearest.len()];
        radii
            .par_chunks_mut(nx * ny * LAYERS)
            .zip(self.inside.words.par_chunks(stride * ny * LAYERS))
            .enumerate()
            .for_each(|(n, (radii, inside))| {
                let mut bare = inside.to_vec();
                let first = n * LAYERS;
                let layers = radii.len() / (nx * ny);
                for ball in balls {
                    paint_ball(ball, first, [nx, ny, layers], stride, &mut bare, radii);
                }
                let mut around = Vec::with_capacity(27);
                for row in 0..ny * layers {
                    for w in 0..stride {
                        for x in ones(bare[row * stride + w]).map(|i| w * 64 + i) {
                            let v = [x, row % ny, first + row / ny];
                            radii[row * nx + x] = self.reaching(v, &mut around) as f32;
                        }
                    }
                }
                (0..layers).for_each(|_| {
                    watch.tick();
                });
            });
        watch.check()?;
        Ok(radii)
    }
}

/// Gives its radius to the voxels of some layers that it covers and that have none.
fn paint_ball(
    ball: &Ball,
    first: usize,
    [nx, ny, layers]: [usize; 3],
    stride: usize,
    bare: &mut [u64],
    radii: &mut [f32],
) {
    let [cx, cy, cz] = ball.center;
    let r = ball.radius;
    let span = |c: f32, r: f32, first: usize, n: usize| {
        let low = (c - r).ceil().max(first as f32) as usize;
        let high = ((c + r).floor() + 1.0).max(0.0) as usize;
        low..high.min(first + n)
    };
    for z in span(cz, r, first, layers) {
        let left = r * r - (z as f32 - cz).powi(2);
        for y in span(cy, left.max(0.0).sqrt(), 0, ny) {
            let half = (left - (y as f32 - cy).powi(2)).max(0.0).sqrt();
            let row = (z - first) * ny + y;
            for (w, mask) in masks(span(cx, half, 0, nx)) {
                let word = &mut bare[row * stride + w];
                let new = *word & mask;
                *word &= !mask;
                ones(new).for_each(|i| radii[row * nx + w * 64 + i] = r);
            }
        }
    }
}

/// The point of the convex hull of some directions that is nearest to the origin, by the method of Frank and Wolfe,
/// which needs few steps for so few directions.
fn between(directions: impl Iterator<Item = Vec3> + Clone) -> Vec3 {
    let Some(mut mean) = directions.clone().next() else {
        return [0.0; 3];
    };
    for _ in 0..24 {
        let least = directions.clone().min_by(|a, b| dot(*a, mean).total_cmp(&dot(*b, mean)));
        let Some(to) = least.map(|d| sub(d, mean)) else {
            return mean;
        };
        let share = -dot(mean, to) / dot(to, to).max(1e-12);
        if share < 1e-3 {
            break;
        }
        mean = add(mean, scale(to, share.min(1.0)));
    }
    mean
}

/// The point of a triangle nearest to `p`.
fn closest(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let (bb, bc, cc) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let (pb, pc) = (dot(ab, sub(p, a)), dot(ac, sub(p, a)));
    let whole = bb * cc - bc * bc;
    let (s, t) = (cc * pb - bc * pc, bb * pc - bc * pb);
    if whole > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= whole {
        return add(a, add(scale(ab, s / whole), scale(ac, t / whole)));
    }
    let on_side = |u: Vec3, v: Vec3| {
        let uv = sub(v, u);
        let square = dot(uv, uv);
        let t = if square > 0.0 { dot(sub(p, u), uv) / square } else { 0.0 };
        add(u, scale(uv, t.clamp(0.0, 1.0)))
    };
    let off = |q: &Vec3| dot(sub(p, *q), sub(p, *q));
    let [x, y, z] = [on_side(a, b), on_side(b, c), on_side(c, a)];
    let nearer = |q: Vec3, r: Vec3| if off(&r) < off(&q) { r } else { q };
    nearer(nearer(x, y), z)
}
