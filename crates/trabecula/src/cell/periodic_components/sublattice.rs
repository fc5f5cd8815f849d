//! Sublattices of Z³, by generators in Hermite normal form (up to the entries above the pivots).

/// An integer vector.
pub(in crate::cell) type Int3 = [i32; 3];

/// A subgroup of Z³ as rows in echelon form: row k begins with k zeros and a positive pivot, or is all zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::cell) struct Sublattice([Int3; 3]);

impl Sublattice {
    /// Adds a generator; whether the subgroup grew.
    pub(super) fn insert(&mut self, mut v: Int3) -> bool {
        if v == [0; 3] {
            return false;
        }
        let mut grew = false;
        for k in 0..3 {
            if v[k] == 0 {
                continue;
            }
            let row = &mut self.0[k];
            if row[k] == 0 {
                *row = v.map(|c| c * v[k].signum());
                return true;
            }
            // Euclid on the pivots, carried out on the whole rows.
            let before = row[k];
            while v[k] != 0 {
                let q = row[k] / v[k];
                let rest = [0, 1, 2].map(|a| row[a] - q * v[a]);
                *row = v;
                v = rest;
            }
            let sign = row[k].signum();
            *row = row.map(|c| c * sign);
            grew |= row[k] != before;
        }
        grew
    }

    /// Adds all generators of another subgroup; whether this one grew.
    pub(super) fn absorb(&mut self, o: &Sublattice) -> bool {
        o.0.iter().fold(false, |grew, row| self.insert(*row) | grew)
    }

    /// Whether `v` belongs to it.
    pub(super) fn contains(&self, mut v: Int3) -> bool {
        for (k, row) in self.0.iter().enumerate() {
            if v[k] != 0 {
                if row[k] == 0 || v[k] % row[k] != 0 {
                    return false;
                }
                let q = v[k] / row[k];
                v = [0, 1, 2].map(|a| v[a] - q * row[a]);
            }
        }
        true
    }

    /// The number of its independent directions.
    pub(in crate::cell) fn rank(&self) -> usize {
        (0..3).filter(|k| self.0[*k][*k] != 0).count()
    }

    /// Whether it is all of Z³.
    pub(super) fn is_full(&self) -> bool {
        (0..3).all(|k| self.0[k][k] == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_exactly_when_the_generators_have_index_one() {
        let of = |rows: &[Int3]| {
            let mut l = Sublattice::default();
            rows.iter().for_each(|r| {
                l.insert(*r);
            });
            l
        };
        assert!(!of(&[]).is_full());
        assert!(of(&[[1, 0, 0], [0, 1, 0], [0, 0, 1]]).is_full());
        assert!(!of(&[[1, 1, 0], [0, 1, 1], [1, 0, 1]]).is_full(), "fcc has index 2");
        assert!(of(&[[1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1]]).is_full());
        assert!(of(&[[2, 0, 0], [3, 0, 0], [5, 1, 0], [7, 9, -1]]).is_full());
        assert!(!of(&[[2, 0, 0], [0, 1, 0], [0, 0, 1]]).is_full());
        assert!(!of(&[[1, 2, 3], [4, 5, 6]]).is_full());
    }

    #[test]
    fn membership_follows_the_generators() {
        let mut l = Sublattice::default();
        for g in [[1, 1, 0], [0, 1, 1], [1, 0, 1]] {
            assert!(l.insert(g));
        }
        for x in -3..4 {
            for y in -3..4 {
                for z in -3..4 {
                    let even = (x + y + z) % 2 == 0;
                    assert_eq!(l.contains([x, y, z]), even);
                    assert_eq!(l.clone().insert([x, y, z]), !even);
                }
            }
        }
    }
}
