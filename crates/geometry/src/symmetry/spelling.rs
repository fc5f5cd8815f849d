//! Spellings of Hermann–Mauguin symbols, and the nearest known ones.

use super::{Group, SpaceGroupEntry, rows};
use crate::fault::{Fault, nearest};

/// The rows that a number or a Hermann–Mauguin symbol without spaces and underscores names: by the symbols of the tables or,
/// if there are none, by its other usual spellings.
pub(super) fn rows_of(bare: &str) -> Vec<SpaceGroupEntry> {
    let is = |symbol: &str| bare.eq_ignore_ascii_case(symbol);
    let number = bare.parse().ok();
    let known: Vec<SpaceGroupEntry> =
        rows().filter(|r| number == Some(r.number) || is(r.short) || is(r.full)).collect();
    if !known.is_empty() {
        return known;
    }
    rows().filter(|r| spellings(r).any(|s| is(&s))).collect()
}

/// Other usual spellings of a row's symbol; none is a symbol of the tables for another group.
fn spellings(row: &SpaceGroupEntry) -> impl Iterator<Item = String> {
    // Cubic symbols without the bar are those before 1935, and of most papers on minimal surfaces: Fd3m, I43d.
    let cubic = (row.number >= 195 && row.short.contains('-')).then(|| row.short.replace('-', ""));
    cubic.into_iter().chain(row.former.map(String::from)).chain(monoclinic(row))
}

/// A full monoclinic symbol without the ones that tell the unique axis. Not of rotations alone: I 2 is also one of Hall's, about
/// c.
fn monoclinic(row: &SpaceGroupEntry) -> Option<String> {
    let (lattice, axes) = row.full.split_at_checked(1).filter(|_| (3..=15).contains(&row.number))?;
    let about = match row.setting.trim_start_matches('-').as_bytes().first()? {
        b'b' => axes.strip_prefix('1')?.strip_suffix('1')?,
        b'c' => axes.strip_prefix("11")?,
        _ => axes.strip_suffix("11")?,
    };
    about.contains(|c: char| c.is_ascii_alphabetic()).then(|| format!("{lattice}{about}"))
}

/// A symbol that is none of Hermann and Mauguin's: Hall's, unless it looks like one of theirs.
pub(super) fn other(text: &str, bare: &str) -> Result<Group, Fault> {
    if bare.chars().all(|c| c.is_ascii_digit()) && !bare.is_empty() {
        let message = format!("there is no space group {bare}; they are numbered from 1 to 230");
        return Err(Fault::new("", message));
    }
    let near = || {
        // `nearest` knows no letter case and no hyphens.
        let plain = |s: &str| s.to_lowercase().replace('-', "_");
        let symbols = rows().flat_map(|r| [r.short, r.full]).filter(|s| s.get(..1) == bare.get(..1));
        let known: Vec<(String, &str)> = symbols.map(|s| (plain(s), s)).collect();
        let found = nearest(bare, known.iter().map(|k| k.0.as_str()));
        let found = found.and_then(|f| known.iter().find(|k| k.0 == f));
        found.map_or(String::new(), |k| format!("did you mean \"{}\"? ", k.1))
    };
    let group = Group::of_hall(text).map_err(|f| {
        let message = format!(
            "\"{text}\" is no space group: neither a number from 1 to 230 nor a Hermann–Mauguin symbol (such as Fd-3m or \
             227:2), and {}",
            f.message
        );
        let near = near();
        let message = if near.is_empty() { message } else { format!("{message}; {}", near.trim_end()) };
        Fault::new("", message)
    })?;
    if group.number.is_none() && !only_hall(text) {
        let message = format!(
            "\"{text}\" has the form of a Hermann–Mauguin symbol, but is none of the 530 settings of the tables; {}write \
             \"hall: {text}\" if a Hall symbol is meant, which is another group",
            near()
        );
        return Err(Fault::new("", message));
    }
    Ok(group)
}

/// Whether a Hall symbol has something that no Hermann–Mauguin symbol has: an inverse lattice, a written axis, a shift of the
/// origin, a translation after a rotation, or a rotation −2.
fn only_hall(symbol: &str) -> bool {
    let marks = |w: &str| w == "-2" || w.contains(['x', 'y', 'z', '\'', '"', '*', '(', ')']);
    let moved = |w: &str| {
        let pairs = w.as_bytes().windows(2);
        pairs.into_iter().any(|p| p[0].is_ascii_digit() && p[1].is_ascii_alphabetic())
    };
    symbol.trim_start().starts_with('-') || symbol.split_whitespace().any(|w| marks(w) || moved(w))
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use super::*;
    use std::collections::{HashMap, HashSet};

    fn operations_of(name: &str) -> Result<HashSet<Operation>, Fault> {
        Group::named(name).map(|g| g.operations.into_iter().collect())
    }

    /// A symbol with spaces between its letters, as they are printed.
    fn spaced(symbol: &str) -> String {
        symbol.chars().map(String::from).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn every_spelling_of_a_setting_is_its_row() {
        for row in rows() {
            let own: HashSet<Operation> = operations(row.hall).expect(row.hall).into_iter().collect();
            let mut names: Vec<String> = [row.short, row.full].map(String::from).into();
            names.push(row.number.to_string());
            names.extend(spellings(&row));
            for name in names {
                for case in [row.setting.to_string(), row.setting.to_lowercase()] {
                    let with = if case.is_empty() { name.clone() } else { format!("{name}:{case}") };
                    let found = operations_of(&with).expect(&with);
                    assert!(found == own, "{with}");
                }
                let alone = Group::named(&name).expect(&name);
                assert_eq!(alone.number, Some(row.number), "{name}");
                assert!(operations_of(&spaced(&name)) == operations_of(&name), "{name}");
            }
            // Four Hall symbols are those of Hermann and Mauguin for other groups or axes, which go first.
            let hall = operations_of(row.hall).expect(row.hall);
            let shared = ["P 2", "P 4 2", "P 3 2", "P 6 2"].contains(&row.hall);
            assert_eq!(hall == own, !shared, "{}", row.hall);
            assert!(operations_of(&format!("hall: {}", row.hall)) == Ok(own), "{}", row.hall);
        }
    }

    #[test]
    fn usual_spellings_are_those_of_the_tables() {
        let pairs = [
            ("Fd3m", "Fd-3m"),
            ("Fm3m", "225"),
            ("P m 3 m", "221"),
            ("Ia3d", "Ia-3d"),
            ("I43m", "I-43m"),
            ("Pa3", "Pa-3"),
            ("Pn3m:1", "224:1"),
            ("Cmca", "Cmce"),
            ("Cmma", "Cmme"),
            ("Aba2", "Aea2"),
            ("Abm2", "Aem2"),
            ("Ccca", "Ccce"),
            ("Ccca:1", "68:1"),
            ("Bmab", "64:a-cb"),
            ("P21/n", "P 1 21/n 1"),
            ("P 21/n", "14:b2"),
            ("P21/a", "14:b3"),
            ("I2/a", "I 1 2/a 1"),
            ("I2/c", "15:-b3"),
            ("B2/b", "15:-c1"),
            ("166:h", "166:H"),
            ("R-3m:r", "166:R"),
        ];
        for (spelling, table) in pairs {
            assert!(operations_of(spelling).expect(spelling) == operations_of(table).expect(table), "{spelling}");
        }
    }

    #[test]
    fn a_spelling_names_one_group() {
        let mut of: HashMap<String, u16> = HashMap::new();
        for row in rows() {
            for name in spellings(&row).chain([row.short.to_string(), row.full.to_string()]) {
                let number = *of.entry(name.to_lowercase()).or_insert(row.number);
                assert_eq!(number, row.number, "{name}");
            }
        }
    }

    #[test]
    fn what_looks_like_hermann_and_mauguin_is_not_read_as_hall() {
        let forms = ["B 1 2 1", "F 1 2 1", "I 1 21 1", "C 1 21 1", "B 1 21 1", "C 4 2 21", "F 4 2"];
        for form in forms {
            let message = Group::named(form).expect_err(form).message;
            assert!(message.contains(&format!("write \"hall: {form}\"")), "{message}");
            assert!(operations_of(&format!("hall: {form}")).is_ok(), "{form}");
        }
        let near = |form: &str| Group::named(form).expect_err(form).message;
        assert!(near("I 1 21 1").contains("did you mean \"I121\""), "{}", near("I 1 21 1"));
        assert!(near("Fd-3n").contains("did you mean \"Fd-3"), "{}", near("Fd-3n"));
        assert!(operations_of("Aeaa") == operations_of("68:2cab"), "origin choice 2");
        // Hall symbols of one's own are read where they can be nothing else.
        for own in ["-B 4a 2", "P 4cw 2 (0 0 1)", "C 2y", "P 2 -2", "F 4x"] {
            assert!(operations_of(own).is_ok(), "{own}");
        }
    }
}
