//! The predefined tetrahedral cells: networks and sheets over all eight space groups that have a site of tetrahedral
//! symmetry.
//!
//! Selected from a sweep over groups, waves, sites, edges and duals: connected over a wide range of fractions, with
//! well-defined ports on the faces. All figures are computed from the series.

use std::f64::consts::TAU;

use serde_json::{Map, Value as Json, json};

use super::super::{Part, Series, Term};
use super::TetCell;
use geometry::fault::Fault;
use geometry::math::scale;
use geometry::symmetry::{ComplexPart, Group};

use ComplexPart::{Im, Re};

/// A predefined tetrahedral cell.
#[derive(Clone, Copy, Debug)]
pub struct NamedTetCell {
    /// Name in designs.
    pub name: &'static str,
    /// Description of its appearance.
    pub title: &'static str,
    /// Space group, with the origin choice.
    pub group: &'static str,
    /// Waves: (h, k, l), part of the sum over the group, amplitude.
    pub terms: &'static [([i32; 3], ComplexPart, f64)],
    /// The barycentre, turns, the same along all axes.
    pub site: f64,
    /// Edge of the tetrahedron over √2, in cells.
    pub edge_over_root: f64,
    /// Equation 11 instead of 10.
    pub dual: bool,
    /// The part for which it is intended.
    pub part: Part,
    /// A solid fraction at which that part is connected.
    pub fraction: f64,
}

static CATALOGUE: [NamedTetCell; 20] = [
    NamedTetCell {
        name: "primitive",
        title: "ball with a port on each face, of the P surface",
        group: "221",
        terms: &[([1, 0, 0], Re, 1.0)],
        site: 0.5,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Lower,
        fraction: 0.48,
    },
    NamedTetCell {
        name: "primitive_sheet",
        title: "the P surface's walls: a window to each face",
        group: "221",
        terms: &[([1, 0, 0], Re, 1.0)],
        site: 0.5,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Sheet,
        fraction: 0.44,
    },
    NamedTetCell {
        name: "neovius_sheet",
        title: "the Neovius surface's walls",
        group: "221",
        terms: &[([1, 0, 0], Re, 3.0), ([1, 1, 1], Re, 4.0)],
        site: 0.5,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Sheet,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "diamond",
        title: "node with four arms, of the D surface",
        group: "227:2",
        terms: &[([1, 1, 1], Re, 1.0)],
        site: 0.125,
        edge_over_root: 0.75,
        dual: false,
        part: Part::Lower,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "diamond_sheet",
        title: "the D surface's walls: a tube to each face",
        group: "227:2",
        terms: &[([1, 1, 1], Re, 1.0)],
        site: 0.125,
        edge_over_root: 0.75,
        dual: false,
        part: Part::Sheet,
        fraction: 0.22,
    },
    NamedTetCell {
        name: "diamond_triple",
        title: "four arms to the corners, each cut by three faces, of the D surface",
        group: "227:2",
        terms: &[([1, 1, 1], Re, 1.0)],
        site: 0.125,
        edge_over_root: 1.0,
        dual: true,
        part: Part::Lower,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "diamond_cage",
        title: "four thick arms into the corners, of the D surface",
        group: "227:2",
        terms: &[([1, 1, 1], Re, 1.0)],
        site: 0.125,
        edge_over_root: 0.75,
        dual: true,
        part: Part::Lower,
        fraction: 0.44,
    },
    NamedTetCell {
        name: "iwp",
        title: "arms into the corners and thinner ones to the faces, of the I-WP surface",
        group: "229",
        terms: &[([1, 1, 0], Re, -1.0), ([2, 0, 0], Re, 1.0)],
        site: 0.0,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Lower,
        fraction: 0.33,
    },
    NamedTetCell {
        name: "i43m",
        title: "node with four arms",
        group: "217",
        terms: &[([1, 1, 0], Re, -1.0), ([2, 1, 1], Im, 0.5)],
        site: 0.0,
        edge_over_root: 0.5,
        dual: true,
        part: Part::Lower,
        fraction: 0.29,
    },
    NamedTetCell {
        name: "i43m_sheet",
        title: "walls with many windows",
        group: "217",
        terms: &[([2, 1, 1], Im, 1.0)],
        site: 0.0,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Sheet,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "p43m",
        title: "node with four arms",
        group: "215",
        terms: &[([1, 0, 0], Re, 1.0), ([1, 1, 1], Im, 1.0)],
        site: 0.5,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Lower,
        fraction: 0.22,
    },
    NamedTetCell {
        name: "p43m_sheet",
        title: "walls that leave the corners",
        group: "215",
        terms: &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Im, 1.0)],
        site: 0.0,
        edge_over_root: 1.0,
        dual: true,
        part: Part::Sheet,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "f43m",
        title: "node with four arms",
        group: "216",
        terms: &[([1, 1, 1], Re, 1.0), ([1, 1, 1], Im, 0.5)],
        site: 0.25,
        edge_over_root: 0.75,
        dual: true,
        part: Part::Lower,
        fraction: 0.2,
    },
    NamedTetCell {
        name: "f43m_sheet",
        title: "walls: a tube to each face",
        group: "216",
        terms: &[([1, 1, 1], Re, 1.0), ([1, 1, 1], Im, -0.5)],
        site: 0.25,
        edge_over_root: 0.75,
        dual: false,
        part: Part::Sheet,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "pn3m",
        title: "four thin arms into the corners",
        group: "224:2",
        terms: &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Re, 1.0)],
        site: 0.25,
        edge_over_root: 1.0,
        dual: false,
        part: Part::Lower,
        fraction: 0.3,
    },
    NamedTetCell {
        name: "pn3m_dual",
        title: "ball with a port on each face",
        group: "224:2",
        terms: &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Re, 1.0)],
        site: 0.25,
        edge_over_root: 0.5,
        dual: true,
        part: Part::Lower,
        fraction: 0.34,
    },
    NamedTetCell {
        name: "pn3m_sheet",
        title: "walls with a window to each face",
        group: "224:2",
        terms: &[([1, 1, 0], Re, 1.0)],
        site: 0.25,
        edge_over_root: 0.75,
        dual: false,
        part: Part::Sheet,
        fraction: 0.25,
    },
    NamedTetCell {
        name: "frd",
        title: "node with four arms, of the F-RD surface",
        group: "225",
        terms: &[([1, 1, 1], Re, 4.0), ([2, 2, 0], Re, -1.0)],
        site: 0.25,
        edge_over_root: 0.5,
        dual: true,
        part: Part::Lower,
        fraction: 0.22,
    },
    NamedTetCell {
        name: "fm3m",
        title: "frame along the edges, open in the middle of the cell",
        group: "225",
        terms: &[([1, 1, 1], Re, -4.0), ([2, 2, 0], Re, 1.0)],
        site: 0.25,
        edge_over_root: 0.5,
        dual: false,
        part: Part::Lower,
        fraction: 0.17,
    },
    NamedTetCell {
        name: "fm3m_sheet",
        title: "three planes through the middle",
        group: "225",
        terms: &[([1, 1, 1], Re, 1.0)],
        site: 0.25,
        edge_over_root: 0.5,
        dual: false,
        part: Part::Sheet,
        fraction: 0.3,
    },
];

/// All predefined cells.
pub fn tet_catalogue() -> &'static [NamedTetCell] {
    &CATALOGUE
}

/// The predefined cell of this name.
pub fn named_tet_cell(name: &str) -> Option<&'static NamedTetCell> {
    CATALOGUE.iter().find(|r| r.name == name)
}

/// The sum of waves over a group, each divided by its largest Fourier coefficient before its amplitude is applied.
///
/// # Errors
/// As [`Group::orbit`] and [`Series::new`].
pub(crate) fn series(group: &Group, terms: &[([i32; 3], ComplexPart, f64)]) -> Result<Series, Fault> {
    let mut all = Vec::new();
    for (hkl, side, amplitude) in terms {
        let waves = group.orbit(*hkl, *side)?;
        all.extend(waves.into_iter().map(|(hkl, cosine, sine)| Term {
            hkl,
            amplitude: amplitude * cosine.hypot(sine),
            phase: (-sine).atan2(cosine) / TAU,
        }));
    }
    Series::new(all)
}

impl NamedTetCell {
    /// Its definition and figures, computed from the series.
    ///
    /// # Errors
    /// None for those that are listed.
    pub fn facts(&self) -> Result<Json, Fault> {
        let cell = self.cell()?;
        let terms = self.terms.iter().map(|(hkl, side, amplitude)| {
            let part = match side {
                Re => "re",
                Im => "im",
            };
            json!({ "hkl": hkl, "component": part, "amplitude": amplitude })
        });
        let parts = [("sheet", Part::Sheet), ("lower", Part::Lower), ("upper", Part::Upper)];
        let word = parts.iter().find(|p| p.1 == self.part).map_or("", |p| p.0);
        let whole: Map<String, Json> =
            parts.iter().map(|(word, part)| (word.to_string(), json!(cell.connected_fraction(*part)))).collect();
        let iso = cell.iso(self.part, self.fraction);
        let range = cell.range();
        Ok(json!({
            "name": self.name,
            "title": self.title,
            "group": self.group,
            "terms": terms.collect::<Vec<Json>>(),
            "site": [self.site, self.site, self.site],
            "edge": self.edge(),
            "dual": self.dual,
            "part": word,
            "fraction": self.fraction,
            "iso": iso,
            "ports": cell.count(self.part, iso).ports,
            "face_fraction": cell.face_fraction(self.part, iso),
            "range": [range.lo, range.hi],
            "connected_fraction": whole,
        }))
    }

    /// The edge of the tetrahedron, in edges of the cubic cell.
    pub fn edge(&self) -> f64 {
        self.edge_over_root * 2f64.sqrt()
    }

    /// The cell.
    ///
    /// # Errors
    /// None for those that are listed.
    pub fn cell(&self) -> Result<TetCell, Fault> {
        let group = Group::named(self.group)?;
        let site = scale([1.0; 3], self.site);
        TetCell::new(series(&group, self.terms)?, site, self.edge(), self.dual)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_cells_are_of_all_eight_groups_and_hold() {
        let mut groups = std::collections::BTreeSet::new();
        let mut kinds = [0; 2];
        for r in tet_catalogue() {
            let s = r.cell().expect(r.name);
            let whole = s.connected_fraction(r.part);
            let holds = |i: &[f64; 2]| i[0] + 0.02 < r.fraction && r.fraction < i[1] - 0.02;
            assert!(whole.iter().any(holds), "{}: {whole:?}", r.name);
            let count = s.count(r.part, s.iso(r.part, r.fraction));
            assert!(count.components == 1 && count.ports > 0, "{}: {count:?}", r.name);
            groups.insert(Group::named(r.group).expect(r.name).number);
            kinds[usize::from(r.part == Part::Sheet)] += 1;
            assert_eq!(tet_catalogue().iter().filter(|o| o.name == r.name).count(), 1);
        }
        let eight = [215, 216, 217, 221, 224, 225, 227, 229];
        assert!(groups.into_iter().flatten().eq(eight));
        assert!(kinds[0] >= 7 && kinds[1] >= 7);
    }
}
