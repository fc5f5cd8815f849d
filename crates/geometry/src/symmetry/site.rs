//! Points whose symmetry is that of a tetrahedron set upright in the cell.

use std::collections::HashMap;

use super::{Group, Operation, Rotation, WHOLE, times};
use crate::fault::Fault;

/// The 24 symmetries of the tetrahedron of corners (1, −1, −1), (−1, 1, −1), (−1, −1, 1), (1, 1, 1): the signed
/// permutations of the axes whose signs multiply to one.
fn tetrahedral() -> Vec<Rotation> {
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];
    let signs = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]];
    let one = |order: [usize; 3], sign: [i32; 3]| {
        let mut r = [[0; 3]; 3];
        (0..3).for_each(|i| r[i][order[i]] = sign[i]);
        r
    };
    let all = orders.iter().flat_map(|o| signs.iter().map(|s| one(*o, *s)));
    all.collect()
}

impl Group {
    /// The points (parts of 24, each from 0 to 23) about which the group has all symmetries of a tetrahedron whose corners
    /// lie on the diagonals of the cubic cell: T_d, oriented as in equations 10 and 11 of Chen et al.
    ///
    /// Every such point of every cubic group lies on this grid: its coordinates solve 2c ≡ t with t in 24ths that are
    /// multiples of 3.
    ///
    /// # Errors
    /// There is none, with the reason.
    pub fn tetrahedral_sites(&self) -> Result<Vec<[i32; 3]>, Fault> {
        let none = |why: &str| {
            let message = format!(
                "{} has no point of full tetrahedral symmetry ({why}), so its cells do not fit face to face in tetrahedra; \
                 the groups that have one are 215, 216, 217, 221, 224, 225, 227 and 229",
                self.name
            );
            Err(Fault::new("group", message))
        };
        let mut by_rotation: HashMap<Rotation, Vec<[i32; 3]>> = HashMap::new();
        for o in &self.operations {
            by_rotation.entry(o.rotation).or_default().push(o.translation);
        }
        let wanted = tetrahedral();
        let missing: Vec<&Rotation> = wanted.iter().filter(|r| !by_rotation.contains_key(*r)).collect();
        if let Some(r) = missing.first() {
            let turned = |r: &Rotation| determinant(r) > 0;
            return none(if missing.iter().all(|r| !turned(r)) {
                "it is chiral, or its mirrors are not the diagonal ones: it lacks the mirrors and rotoinversions of the tetrahedron"
            } else if turned(r) {
                "its axes are not those of a cube's diagonals"
            } else {
                "it lacks rotations and mirrors of the tetrahedron"
            });
        }
        let fixed = |c: [i32; 3], r: &Rotation| {
            let turned = times(r, c);
            let by = [0, 1, 2].map(|i| (c[i] - turned[i]).rem_euclid(WHOLE));
            by_rotation[r].contains(&by)
        };
        let steps = || (0..WHOLE).step_by(3);
        let points = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
        let sites: Vec<[i32; 3]> = points.filter(|c| wanted.iter().all(|r| fixed(*c, r))).collect();
        if sites.is_empty() {
            return none("it has the rotations and the mirrors, but as screws and glides, or not through one point");
        }
        Ok(sites)
    }

    /// Whether an operation of the group takes one point (parts of 24) to another, up to whole periods; the operation
    /// then is given.
    pub fn carries(&self, from: [i32; 3], to: [i32; 3]) -> Option<&Operation> {
        self.operations.iter().find(|o| {
            let turned = times(&o.rotation, from);
            (0..3).all(|i| (turned[i] + o.translation[i] - to[i]).rem_euclid(WHOLE) == 0)
        })
    }
}

fn determinant(r: &Rotation) -> i32 {
    let m = |a: usize, b: usize| r[1][a] * r[2][b] - r[1][b] * r[2][a];
    r[0][0] * m(1, 2) - r[0][1] * m(0, 2) + r[0][2] * m(0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(name: &str) -> Vec<f64> {
        let sites = Group::named(name).expect(name).tetrahedral_sites();
        let mut on: Vec<f64> = sites
            .expect(name)
            .iter()
            .filter(|c| c[0] == c[1] && c[1] == c[2])
            .map(|c| f64::from(c[0]) / 24.0)
            .collect();
        on.sort_by(f64::total_cmp);
        on
    }

    /// Table 1 of Chen et al., the garbled row being 216.
    #[test]
    fn sites_are_those_of_the_paper() {
        let quarters = vec![0.0, 0.25, 0.5, 0.75];
        for (name, c) in [
            ("215", vec![0.0, 0.5]),
            ("216", quarters.clone()),
            ("217", vec![0.0, 0.5]),
            ("221", vec![0.0, 0.5]),
            ("224:1", vec![0.0, 0.5]),
            ("224:2", vec![0.25, 0.75]),
            ("225", quarters.clone()),
            ("227:1", quarters),
            ("227:2", vec![0.125, 0.375, 0.625, 0.875]),
            ("229", vec![0.0, 0.5]),
        ] {
            // In body-centred groups the cell's middle is the origin again; the paper lists it once.
            assert_eq!(diagonal(name), c, "{name}");
        }
    }

    #[test]
    fn eight_groups_have_them_and_the_others_say_why_not() {
        let mut with = Vec::new();
        for (number, name, hall) in Group::all() {
            if number < 195 {
                continue;
            }
            let group = Group::named(&format!("hall: {hall}")).expect(&name);
            match group.tetrahedral_sites() {
                Ok(_) => with.push(number),
                Err(f) => assert!(f.message.contains("no point of full"), "{name}"),
            }
        }
        with.dedup();
        assert_eq!(with, [215, 216, 217, 221, 224, 225, 227, 229]);
        let why = |n: &str| {
            let f = Group::named(n).expect(n).tetrahedral_sites();
            f.expect_err(n).message
        };
        assert!(why("214").contains("chiral"), "{}", why("214"));
        assert!(why("230").contains("glides"), "{}", why("230"));
        assert!(why("220").contains("glides"), "{}", why("220"));
        assert!(why("19").contains("diagonals"), "{}", why("19"));
    }

    /// Seed 003's equivalences: pairs that an operation joins.
    #[test]
    fn equivalent_sites_are_joined() {
        for (name, a, b, joined) in [
            ("227:2", 3, 21, true),
            ("227:2", 3, 9, false),
            ("224:2", 6, 18, true),
            ("225", 6, 18, true),
            ("216", 0, 6, false),
        ] {
            let g = Group::named(name).expect(name);
            assert_eq!(g.carries([a; 3], [b; 3]).is_some(), joined, "{name}");
        }
    }
}
