//! The 230 space groups in all their usual settings, and the plane waves that they make of one.
//!
//! A group is known by its Hall symbol, from which its operations follow (`hall`). Everything is done in whole numbers:
//! translations are parts of 24, and the sum of a wave over the group is a sum of 24th roots of one, which is zero or not
//! without doubt (`orbit`).

mod hall;
mod orbit;
mod site;
mod spelling;

pub use orbit::ComplexPart;

use crate::fault::Fault;
use crate::math::Vec3;

/// Parts of a period in which translations are counted.
const WHOLE: i32 = 24;

/// A rotation in lattice coordinates.
pub type Rotation = [[i32; 3]; 3];

/// u → R u + t / 24, u in turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Operation {
    /// R.
    pub rotation: Rotation,
    /// t, from 0 to 23.
    pub translation: [i32; 3],
}

impl Operation {
    /// R u + t / 24.
    pub fn apply(&self, u: Vec3) -> Vec3 {
        let part = |i: usize| f64::from(self.translation[i]) / f64::from(WHOLE);
        let turned = |i: usize| (0..3).map(|k| f64::from(self.rotation[i][k]) * u[k]).sum::<f64>();
        [0, 1, 2].map(|i| turned(i) + part(i))
    }

    /// This operation after another.
    fn after(&self, first: &Operation) -> Operation {
        let (r, s) = (&self.rotation, &first.rotation);
        let rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| r[i][k] * s[k][j]).sum()));
        let moved = times(r, first.translation);
        Operation { rotation, translation: [0, 1, 2].map(|i| (moved[i] + self.translation[i]).rem_euclid(WHOLE)) }
    }

    /// The operation seen from an origin moved by −`shift`.
    fn about(&self, shift: [i32; 3]) -> Operation {
        let turned = times(&self.rotation, shift);
        let moved = |i: usize| self.translation[i] + shift[i] - turned[i];
        Operation { translation: [0, 1, 2].map(|i| moved(i).rem_euclid(WHOLE)), ..*self }
    }
}

fn times(r: &Rotation, v: [i32; 3]) -> [i32; 3] {
    r.map(|row| (0..3).map(|k| row[k] * v[k]).sum())
}

/// A space group in one of its settings.
#[derive(Clone, Debug)]
pub struct Group {
    /// Its number in the International Tables, if its symbol is one of theirs.
    pub number: Option<u16>,
    /// Its Hermann–Mauguin symbol and setting, or its Hall symbol.
    pub name: String,
    /// Its operations, centring translations included.
    pub operations: Vec<Operation>,
}

/// A row of the table: number, setting, short and full Hermann–Mauguin symbol, Hall symbol, and the short symbol before 1992
/// where the e-glide has changed it.
struct SpaceGroupEntry {
    number: u16,
    setting: &'static str,
    short: &'static str,
    full: &'static str,
    hall: &'static str,
    former: Option<&'static str>,
}

/// All settings, in the order of the International Tables; underscores and spaces left out of Hermann–Mauguin symbols.
fn rows() -> impl Iterator<Item = SpaceGroupEntry> {
    include_str!("symmetry/groups.txt").lines().filter_map(|l| {
        let mut fields = l.split('|');
        Some(SpaceGroupEntry {
            number: fields.next()?.parse().ok()?,
            setting: fields.next()?,
            short: fields.next()?,
            full: fields.next()?,
            hall: fields.next()?,
            former: fields.next(),
        })
    })
}

impl Group {
    /// A group by its number (`"227"`), its Hermann–Mauguin symbol, short or full (`"Fd-3m"`, `"P 1 21/c 1"`), either with
    /// a setting (`"227:2"`), or its Hall symbol (`"-F 4vw 2vw 3"`; `"hall: P 2"` where it could be the other). Usual
    /// spellings of Hermann–Mauguin symbols are read too: cubic ones without the bar (`"Fd3m"`), those before 1992
    /// (`"Cmca"`), and monoclinic ones without ones (`"P21/n"`, unique axis b first). Without a setting it is origin choice 2
    /// where there are two, hexagonal axes, or the first of the tables.
    ///
    /// # Errors
    /// A symbol or setting that does not exist; a Hall symbol that makes no group, or that has the form of a Hermann–Mauguin
    /// symbol.
    pub fn named(text: &str) -> Result<Group, Fault> {
        if let Some(symbol) = text.trim().strip_prefix("hall:") {
            return Group::of_hall(symbol);
        }
        let (symbol, setting) = match text.split_once(':') {
            Some((symbol, setting)) => (symbol.trim(), Some(setting.trim())),
            None => (text, None),
        };
        let bare: String = symbol.chars().filter(|c| !c.is_whitespace() && *c != '_').collect();
        let known = spelling::rows_of(&bare);
        if known.is_empty() {
            return spelling::other(text, &bare);
        }
        let found = match setting {
            Some(s) => known.iter().find(|r| r.setting.eq_ignore_ascii_case(s)),
            None => known.iter().find(|r| r.setting.starts_with('2')).or(known.first()),
        };
        let Some(row) = found else {
            let settings: Vec<&str> = known.iter().map(|r| r.setting).collect();
            let message = if settings == [""] {
                format!("{symbol} has one setting only; leave \":\" and what follows out")
            } else {
                format!(
                    "{symbol} has no setting \"{}\"; there are {}",
                    setting.unwrap_or_default(),
                    settings.join(", ")
                )
            };
            return Err(Fault::new("", message));
        };
        let name = match row.setting {
            "" => row.short.to_string(),
            setting => format!("{}:{setting}", row.short),
        };
        Ok(Group { number: Some(row.number), name, operations: operations(row.hall)? })
    }

    /// The group of a Hall symbol.
    fn of_hall(symbol: &str) -> Result<Group, Fault> {
        let words: Vec<&str> = symbol.split_whitespace().collect();
        let symbol = words.join(" ");
        let row = rows().find(|r| r.hall == symbol);
        Ok(Group { number: row.map(|r| r.number), operations: operations(&symbol)?, name: symbol })
    }

    /// The symbols of all settings, for listings: number, Hermann–Mauguin symbol with setting, Hall symbol.
    pub fn all() -> impl Iterator<Item = (u16, String, &'static str)> {
        rows().map(|r| {
            let mark = if r.setting.is_empty() { "" } else { ":" };
            (r.number, format!("{}{mark}{}", r.full, r.setting), r.hall)
        })
    }
}

fn operations(hall: &str) -> Result<Vec<Operation>, Fault> {
    hall::operations(hall).map_err(|why| Fault::new("", format!("\"{hall}\" is no Hall symbol: {why}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn order(name: &str) -> usize {
        Group::named(name).expect(name).operations.len()
    }

    #[test]
    fn every_setting_is_a_group_and_settings_of_one_are_of_one_size() {
        assert_eq!(rows().count(), 530);
        let mut primitive: Vec<Option<usize>> = vec![None; 231];
        for row in rows() {
            let ops = operations(row.hall).expect(row.hall);
            let all: HashSet<Operation> = ops.iter().copied().collect();
            assert_eq!(all.len(), ops.len(), "{}", row.hall);
            // Closed: every product is there; so is every inverse, in a finite set.
            for a in ops.iter().step_by(5) {
                assert!(ops.iter().all(|b| all.contains(&a.after(b))), "{}", row.hall);
            }
            // Rhombohedral and hexagonal cells differ in size, but not in rotations.
            let rotations: HashSet<Rotation> = ops.iter().map(|o| o.rotation).collect();
            let known = &mut primitive[usize::from(row.number)];
            assert_eq!(*known.get_or_insert(rotations.len()), rotations.len(), "{}", row.hall);
        }
        assert!(primitive[1..].iter().all(Option::is_some));
    }

    #[test]
    fn orders_are_those_of_the_tables() {
        // International Tables A: order of the point group times centring points.
        let groups = ["215", "216", "217", "221", "224", "225", "227", "229", "230", "1", "2", "146", "146:R", "194"];
        let orders = [24, 96, 48, 48, 48, 192, 192, 96, 96, 1, 2, 9, 3, 24];
        assert_eq!(groups.map(order), orders);
    }

    #[test]
    fn groups_go_by_many_names() {
        let same = |a: &str, b: &str| {
            let all = |n| {
                let ops = Group::named(n).expect(n).operations;
                ops.into_iter().collect::<HashSet<_>>()
            };
            all(a) == all(b)
        };
        for name in ["227:2", "Fd-3m", "F d -3 m : 2", "F4_1/d-32/m:2", "-F 4vw 2vw 3", "hall: -F 4vw 2vw 3"] {
            assert!(same("227", name), "{name}");
        }
        assert!(!same("227:1", "227:2"));
        assert!(same("P 1 21/c 1", "14"));
        assert!(!same("P 2", "hall: P 2"), "the one about b, the other about c");
        assert!(same("3:c", "hall: P 2"));
        let wrong = |n| Group::named(n).expect_err("no group").message;
        assert!(wrong("231").contains("1 to 230"));
        assert!(wrong("227:3").contains("there are 1, 2"));
        assert!(wrong("229:2").contains("one setting only"));
        assert!(wrong("Fd3n").contains("no space group"));
        assert!(wrong("hall: P 5").contains("1, 2, 3, 4 or 6"));
        assert!(wrong("hall: P 2 (1 2)").contains("twelfths"));
        assert!(wrong("").contains("no space group"));
    }
}
