//! The moves that cancel the volume errors of triangles.

use std::ops::Range;

use multiversion::multiversion;

use super::{BlockNodes, TileBuffers};
use crate::extract::sampling_grid::{LocalSolid, SamplingGrid};
use crate::extract::vertex_numbers::numbered;
use geometry::math::Vec3;

/// A turn of more than 45 degrees within a triangle is an edge of the surface, not its curvature; the cosine.
const EDGE: f32 = 0.7;
/// Where edges are known, one of more than 25 degrees is: as many are shown in any case, and points next to them stay on
/// the surface.
const CREASE: f32 = 0.906;

/// Moves vertices along their edges so that each triangle's contour error in volume cancels.
///
/// A surface that is locally quadratic, through the corners of a triangle, lies on average Σ II(e)/24 above it, e the
/// triangle's edges and II the second fundamental form; and II(e) = Δn · e with Δn the change of the unit normal along
/// e. The triangle hands this volume, with opposite sign, to its corners in shares (n · e)², e now the corner's grid
/// edge: what surfaces its edge can move without running far along it.
pub(super) fn balance(
    s: &mut TileBuffers,
    grid: &SamplingGrid,
    local: &LocalSolid,
    nodes: &BlockNodes,
    own: &[Range<usize>; 3],
) {
    s.moments.clear();
    s.moments.resize(s.vertices.len(), (0.0, 0.0));
    let mut rest = &s.plain.triangles[..];
    for (surface, numbers) in s.numbers.iter().enumerate().take(local.live.len()) {
        let (triangles, others) = rest.split_at(s.plain.counts[surface]);
        rest = others;
        // The surface's vertices on edges along x come first, then y, then z.
        let starts = [numbers.offset[1][0], numbers.offset[2][0]];
        let id = local.live[surface];
        let least = if grid.has_creases(id) {
            CREASE
        } else if grid.surfaces[id].has_creases {
            EDGE
        } else {
            f32::NEG_INFINITY
        };
        share_out(triangles, starts, least, &s.positions, &s.normals, &mut s.moments);
    }
    // Contours over corners were grid-aligned between points where these are.
    for key in s.edges.contour_ends() {
        if let Some(v) = numbered(&s.numbers, nodes, key) {
            s.moments[v as usize] = (0.0, 0.0);
        }
    }
    // The contours around its border a tile knows only where no edge is near: its neighbour may lay others there.
    let creased: Vec<bool> = local.live.iter().map(|id| grid.has_creases(*id)).collect();
    if creased.contains(&true) {
        for (v, m) in s.vertices.iter().zip(&mut s.moments) {
            let node = v.node.map(usize::from);
            let on_border =
                (0..3).filter(|a| *a != usize::from(v.axis)).any(|a| node[a] == own[a].start || node[a] == own[a].end);
            if on_border && creased[usize::from(v.surface)] && s.edges.traced.are_near(nodes, node) {
                *m = (0.0, 0.0);
            }
        }
    }
    let margin = grid.margin as f32;
    for ((v, position), &(volume, area)) in s.vertices.iter_mut().zip(&mut s.positions).zip(&s.moments) {
        // Volume gained per unit of t: a third of the ring's area as seen along the edge.
        let gain = area * v.reach(nodes) as f32 / 3.0;
        if gain > 0.0 {
            let step = (volume / gain).clamp(-0.25, 0.25);
            v.t = (v.t + step).clamp(margin, 1.0 - margin);
            *position = v.at(nodes, f64::from(v.t));
        }
    }
}

/// Gives the corners of a surface's triangles their shares, but for triangles within which normals turn so that their product
/// is below `least`.
///
/// Single precision is ample for a move that is a small share of an edge, and neighbouring tiles still agree: it is used
/// on differences of positions that they have in common.
#[multiversion(targets("x86_64+avx2", "aarch64+neon"))]
fn share_out(
    triangles: &[[u32; 3]],
    starts: [u32; 2],
    least: f32,
    positions: &[Vec3],
    normals: &[[f32; 3]],
    moments: &mut [(f32, f32)],
) {
    type Short = [f32; 3];
    let sub = |a: Short, b: Short| -> Short { core::array::from_fn(|i| a[i] - b[i]) };
    let dot = |a: Short, b: Short| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let [na, nb, nc] = t.map(|v| normals[v as usize]);
        let edge = |p: Vec3, q: Vec3| -> Short { core::array::from_fn(|i| (q[i] - p[i]) as f32) };
        let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
        if dot(na, nb).min(dot(nb, nc)).min(dot(nc, na)) < least {
            continue;
        }
        let above = (dot(sub(nb, na), ab) + dot(sub(nc, nb), bc) + dot(sub(na, nc), ca)) / 24.0;
        let n = [ca[1] * ab[2] - ca[2] * ab[1], ca[2] * ab[0] - ca[0] * ab[2], ca[0] * ab[1] - ca[1] * ab[0]];
        let volume = above * 0.5 * dot(n, n).sqrt();
        let facing = t.map(|v| match v {
            v if v < starts[0] => n[0],
            v if v < starts[1] => n[1],
            _ => n[2],
        });
        let sum = dot(facing, facing);
        if sum > 0.0 {
            let share = volume / sum;
            for (&v, facing) in t.iter().zip(facing) {
                let m = &mut moments[v as usize];
                m.0 += share * facing * facing;
                m.1 += 0.5 * facing;
            }
        }
    }
}
