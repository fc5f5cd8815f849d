//! The triangles of a grid cell for every pattern of solid corners, generated from three rules.
//!
//! 1. On every face, solid corners that only touch diagonally are cut off from each other. The rule looks at the face
//!    alone, so both adjacent cells agree, and the surface is closed and oriented.
//! 2. The segments on the six faces make loops (of 3 to 7 edge points). Each is filled with a fan whose diagonals do
//!    not lie in a face, so no triangle edge is shared with anything in the neighbouring cell.
//! 3. Of all triangulations by rule 2, the fans are free of self-intersection wherever the points stand on their
//!    edges (some others, of loops of seven, are not). The test below tries them.
//!
//! Source: Lorensen and Cline, SIGGRAPH 1987; the face rule after Nielson and Hamann, Visualization 1991.

use std::sync::LazyLock;

/// The twelve edges of a cell as (lower corner, axis); corner bits are x = 1, y = 2, z = 4.
pub(super) const EDGES: [(usize, usize); 12] =
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 0), (2, 2), (3, 2), (4, 0), (4, 1), (5, 1), (6, 0)];

/// Most triangles in a cell.
pub(super) const MOST: usize = 5;

/// What a pattern of solid corners makes.
pub(super) struct Case {
    /// Triangles as indices into `EDGES`, counter-clockwise seen from the void; only the first `count` are meant.
    pub triangles: [[u8; 3]; MOST],
    /// Number of triangles.
    pub count: usize,
    /// Whether there is one patch, and on no face solid corners that only touch diagonally.
    pub plain: bool,
    /// The loop around the patch, if it is plain: counter-clockwise seen from the void.
    pub ring: Vec<u8>,
}

/// For each pattern of solid corners, what it makes.
pub(super) static CASES: LazyLock<[Case; 256]> = LazyLock::new(|| {
    core::array::from_fn(|case| {
        let loops = loops(case);
        let (mut triangles, mut count) = ([[0; 3]; MOST], 0);
        for t in loops.iter().flat_map(|l| fan(l)) {
            triangles[count] = t;
            count += 1;
        }
        let diagonal = |f: [usize; 4]| {
            let s = f.map(|c| case >> c & 1);
            s[0] == s[2] && s[1] == s[3] && s[0] != s[1]
        };
        let plain = loops.len() == 1 && !faces().any(diagonal);
        let ring = loops.iter().take(1).flatten().map(|&e| e as u8).collect();
        Case { triangles, count, plain, ring }
    })
});

/// The edge between two corners.
fn edge(a: usize, b: usize) -> usize {
    let (low, axis) = (a & b, (a ^ b).trailing_zeros() as usize);
    EDGES.iter().position(|&e| e == (low, axis)).unwrap_or(0)
}

/// The corners of the six faces, counter-clockwise seen from outside the cell.
fn faces() -> impl Iterator<Item = [usize; 4]> {
    (0..3).flat_map(|axis| {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        [false, true].map(|far| {
            let base = usize::from(far) << axis;
            let ring = [base, base | u, base | u | v, base | v];
            if far { ring } else { [ring[3], ring[2], ring[1], ring[0]] }
        })
    })
}

/// The closed loops of edge points that bound the surface's patches.
fn loops(case: usize) -> Vec<Vec<usize>> {
    let solid = |c: usize| case >> c & 1 == 1;
    let mut next = [None; 12];
    for ring in faces() {
        for i in 0..4 {
            // Where a run of solid corners ends, go back to where it began: that joins nothing across a diagonal.
            if solid(ring[i]) && !solid(ring[(i + 1) % 4]) {
                let mut first = i;
                while solid(ring[(first + 3) % 4]) {
                    first = (first + 3) % 4;
                }
                next[edge(ring[(first + 3) % 4], ring[first])] = Some(edge(ring[i], ring[(i + 1) % 4]));
            }
        }
    }
    let mut found = Vec::new();
    for start in 0..12 {
        let mut at = start;
        let mut ring = Vec::new();
        while let Some(n) = next[at].take() {
            ring.push(at);
            at = n;
        }
        if !ring.is_empty() {
            found.push(ring);
        }
    }
    found
}

/// The fan of a loop about the first of its points that no diagonal joins within a face.
fn fan(ring: &[usize]) -> Vec<[u8; 3]> {
    let n = ring.len();
    let on_one_face = |a: usize, b: usize| {
        faces().any(|f| {
            let has = |e: usize| (0..4).any(|i| edge(f[i], f[(i + 1) % 4]) == e);
            has(a) && has(b)
        })
    };
    let apex = (0..n).find(|&s| (2..n - 1).all(|k| !on_one_face(ring[s], ring[(s + k) % n]))).unwrap_or(0);
    let at = |k: usize| ring[(apex + k) % n] as u8;
    (1..n - 1).map(|k| [at(0), at(k), at(k + 1)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{Vec3, cross, dot, sub};

    fn point(e: usize, t: f64) -> Vec3 {
        let (corner, axis) = EDGES[e];
        let mut p = [corner & 1, corner >> 1 & 1, corner >> 2].map(|b| b as f64);
        p[axis] = t;
        p
    }

    fn side(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> f64 {
        dot(cross(sub(b, a), sub(c, a)), sub(d, a))
    }

    fn pierces(p: Vec3, q: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
        let s = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
        side(a, b, c, p) * side(a, b, c, q) < -1e-24 && (s.iter().all(|&v| v > 1e-12) || s.iter().all(|&v| v < -1e-12))
    }

    #[test]
    fn every_pattern_is_closed_against_its_faces_and_faces_outwards() {
        for case in 1..255usize {
            let mut count = std::collections::HashMap::new();
            for t in &CASES[case].triangles[..CASES[case].count] {
                for k in 0..3 {
                    *count.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
                }
            }
            assert!(count.values().all(|&n| n == 1));
            // Inner edges appear both ways, edges on faces once: as many of these as there are edge points.
            let single = count.keys().filter(|(a, b)| !count.contains_key(&(*b, *a))).count();
            let crossed = EDGES.iter().filter(|&&(c, a)| (case >> c & 1) != (case >> (c | 1 << a) & 1)).count();
            assert_eq!(single, crossed, "case {case}");
        }
        // One solid corner at the origin: the normal points away from it.
        let [a, b, c] = CASES[1].triangles[0].map(|e| point(e as usize, 0.5));
        assert!(side(a, b, c, [0.0; 3]) < 0.0);
    }

    #[test]
    fn no_pattern_crosses_itself_wherever_its_points_stand() {
        let mut seed = 1u64;
        let mut random = || (geometry::random::random(&mut seed) + 1.0) / 2.0;
        for case in 1..255usize {
            for round in 0..300 {
                let at: [f64; 12] = core::array::from_fn(|_| match round % 3 {
                    0 => random(),
                    1 => [1e-3, 1.0 - 1e-3][usize::from(random() < 0.5)],
                    _ => {
                        if random() < 0.5 {
                            random()
                        } else {
                            [1e-3, 1.0 - 1e-3][usize::from(random() < 0.5)]
                        }
                    }
                });
                let p = |e: u8| point(e as usize, at[e as usize]);
                for s in &CASES[case].triangles[..CASES[case].count] {
                    for t in &CASES[case].triangles[..CASES[case].count] {
                        for k in 0..3 {
                            let (a, b) = (s[k], s[(k + 1) % 3]);
                            if !t.contains(&a) && !t.contains(&b) {
                                assert!(!pierces(p(a), p(b), t.map(p)), "case {case}: {s:?} through {t:?}");
                            }
                        }
                    }
                }
            }
        }
    }
}
