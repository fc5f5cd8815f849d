//! Choices at the nodes of a grid, made one after the other so that neighbours agree.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::phase_grid::PhaseGrid;
use geometry::progress::checkpoint;

/// Goes from node to node, the surest first, and makes each agree with the one that it was reached from: doubtful
/// nodes come last, so that none depends on them. Returns the first, which has the value that `first` gives it.
pub(super) fn comb<T: Copy>(
    grid: &PhaseGrid,
    values: &mut [T],
    sure: impl Fn(usize) -> f64,
    first: impl Fn(usize, &T) -> T,
    agree: impl Fn(usize, &T, &T) -> T,
) -> usize {
    let strides = grid.strides();
    let sure: Vec<f64> = (0..values.len()).map(sure).collect();
    // The surest first, of equals the first node: the number of a node in this order says when it is its turn, and of the nodes that
    // it may be reached from the least is the one.
    let mut order: Vec<u32> = (0..values.len() as u32).collect();
    order.par_sort_unstable_by(|&a, &b| sure[b as usize].total_cmp(&sure[a as usize]).then(a.cmp(&b)));
    let mut rank = vec![0u32; order.len()];
    order.iter().zip(0..).for_each(|(n, r)| rank[*n as usize] = r);
    let mut reached = vec![false; values.len()];
    let mut from_rank = vec![u32::MAX; values.len()];
    let mut heap = BinaryHeap::from([Reverse(0u64)]);
    let start = order.first().map_or(0, |n| *n as usize);
    values[start] = first(start, &values[start]);
    while let Some(Reverse(step)) = heap.pop() {
        checkpoint();
        let [node, from] = [step >> 32, step & 0xffff_ffff].map(|r| order[r as usize] as usize);
        if core::mem::replace(&mut reached[node], true) {
            continue;
        }
        values[node] = agree(node, &values[node], &values[from]);
        let at = grid.index(node);
        for a in 0..3 {
            let below = (at[a] > 0).then(|| node - strides[a]);
            let above = (at[a] + 1 < grid.shape[a]).then(|| node + strides[a]);
            for next in below.into_iter().chain(above).filter(|&n| !reached[n]) {
                if rank[node] < from_rank[next] {
                    from_rank[next] = rank[node];
                    heap.push(Reverse(u64::from(rank[next]) << 32 | u64::from(rank[node])));
                }
            }
        }
    }
    start
}

/// How sure nodes are, those in the part before all others, and of these the nearest to it first.
pub(super) fn first_in<'a>(outside: Option<&'a [f64]>, sure: impl Fn(usize) -> f64 + 'a) -> impl Fn(usize) -> f64 + 'a {
    move |n| match outside.map(|d| d[n]) {
        Some(distance) if distance > 0.0 => -distance,
        _ => sure(n),
    }
}
