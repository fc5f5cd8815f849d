//! The ready tetrahedral cells: networks and sheets over all eight groups that have a site of tetrahedral symmetry.
//!
//! Found by a sweep over groups, waves, sites, edges and duals; kept are those that are one piece over a wide range of
//! fractions and meet the faces in clean ports. All figures are computed from the series.

use std::f64::consts::TAU;

use super::super::{Part, Series, Term};
use super::Stencil;
use crate::fault::Fault;
use crate::math::scale;
use crate::symmetry::{Group, Side};

use Side::{Im, Re};

/// A ready tetrahedral cell.
#[derive(Clone, Copy, Debug)]
pub struct Ready {
    /// Name in designs.
    pub name: &'static str,
    /// What it looks like.
    pub title: &'static str,
    /// Space group, with the origin choice.
    pub group: &'static str,
    /// Waves: (h, k, l), part of the sum over the group, amplitude.
    pub terms: &'static [([i32; 3], Side, f64)],
    /// The barycentre, turns, the same along all axes.
    pub site: f64,
    /// Edge of the tetrahedron over √2, in cells.
    pub edge_over_root: f64,
    /// Equation 11 instead of 10.
    pub dual: bool,
    /// The part that it is made for.
    pub part: Part,
    /// A solid fraction at which that part is one piece.
    pub fraction: f64,
}

const fn cell(
    name: &'static str,
    title: &'static str,
    group: &'static str,
    terms: &'static [([i32; 3], Side, f64)],
    place: (f64, f64, bool),
    solid: (Part, f64),
) -> Ready {
    Ready {
        name,
        title,
        group,
        terms,
        site: place.0,
        edge_over_root: place.1,
        dual: place.2,
        part: solid.0,
        fraction: solid.1,
    }
}

static READY: &[Ready] = &[
    cell("primitive", "network of the P surface", "221", &[([1, 0, 0], Re, 1.0)], (0.5, 1.0, false), (Part::Lower, 0.483)),
    cell("diamond", "network of the D surface", "227:2", &[([1, 1, 1], Re, 1.0)], (0.125, 0.75, false), (Part::Lower, 0.262)),
    cell("diamond_dual", "D", "227:2", &[([1, 1, 1], Re, 1.0)], (0.125, 0.75, true), (Part::Lower, 0.436)),
    cell("iwp", "I-WP", "229", &[([1, 1, 0], Re, -1.0), ([2, 0, 0], Re, 1.0)], (0.0, 1.0, false), (Part::Lower, 0.326)),
    cell("t6", "", "217", &[([1, 1, 0], Re, -1.0), ([2, 1, 1], Im, 0.5)], (0.0, 0.5, true), (Part::Lower, 0.29)),
    cell("t7", "", "215", &[([1, 0, 0], Re, 1.0), ([1, 1, 1], Im, 1.0)], (0.5, 1.0, false), (Part::Lower, 0.224)),
    cell("t8", "", "216", &[([1, 1, 1], Re, 1.0), ([1, 1, 1], Im, 0.5)], (0.25, 0.75, true), (Part::Lower, 0.201)),
    cell("t9", "", "224:2", &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Re, 1.0)], (0.25, 1.0, false), (Part::Lower, 0.3035)),
    cell("t10", "", "224:2", &[([1, 1, 0], Re, 1.0), ([1, 1, 1], Re, 1.0)], (0.25, 0.5, true), (Part::Lower, 0.344)),
    cell("t11", "", "225", &[([1, 1, 1], Re, -4.0), ([2, 2, 0], Re, 1.0)], (0.25, 0.5, false), (Part::Lower, 0.17)),
    cell("t13", "", "225", &[([1, 1, 1], Re, 1.0)], (0.25, 0.5, false), (Part::Sheet, 0.52)),
];

/// All ready cells.
pub fn ready_cells() -> &'static [Ready] {
    READY
}

/// The ready cell of this name.
pub fn ready(name: &str) -> Option<&'static Ready> {
    READY.iter().find(|r| r.name == name)
}

/// The sum of waves over a group, each divided by its largest Fourier coefficient before its amplitude is applied.
///
/// # Errors
/// As [`Group::orbit`] and [`Series::new`].
pub(crate) fn series(group: &Group, terms: &[([i32; 3], Side, f64)]) -> Result<Series, Fault> {
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

impl Ready {
    /// The edge of the tetrahedron, in edges of the cubic cell.
    pub fn edge(&self) -> f64 {
        self.edge_over_root * 2f64.sqrt()
    }

    /// The cell.
    ///
    /// # Errors
    /// None for those that are listed.
    pub fn stencil(&self) -> Result<Stencil, Fault> {
        let group = Group::named(self.group)?;
        let site = scale([1.0; 3], self.site);
        Stencil::new(series(&group, self.terms)?, site, self.edge(), self.dual)
    }
}
