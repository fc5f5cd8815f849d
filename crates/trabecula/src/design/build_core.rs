//! Cores of singular lines: cells that close round them, and what covers them.

use std::sync::Arc;

use super::data::*;
use crate::cell::Cell;
use crate::csg_tree::CsgSolid;
use crate::implicit::Implicit;
use crate::kind::DesignError;
use crate::lattice::Lattice;
use crate::map::{CoreFill, Map};
use crate::region::Hollowed;
use geometry::math::Mat3;

/// Moves the phases of a map with covered lines so that the axis of the cell's own rotation is where the lines are.
///
/// # Errors
/// A cell that is not the same after the turn of the axes.
pub(super) fn centred(map: Map, cell: &Cell, path: &str) -> Result<Map, DesignError> {
    let mut map = map;
    let turns: Vec<Mat3> = map.solved().map(|m| m.turns()).unwrap_or_default();
    let Some(at) = cell.series().same_after(&turns) else {
        let quarter = turns.iter().any(|t| (0..3).any(|a| t[a][a] == 0.0));
        let (turn, such) = match quarter {
            true => (90, "primitive, iwp, neovius or frd"),
            false => (180, "gyroid, diamond, primitive, iwp, neovius or frd"),
        };
        let message = format!(
            "axes come back turned by {turn} degrees round a singular line, and this cell is not the same after such a turn about its own axis: \
             there would be a seam from the core on. Use a cell that is, such as {such}, or leave core out"
        );
        return Err(DesignError::new(path, message));
    };
    if let (true, Some(own)) = (at != [0.0; 3], Arc::get_mut(&mut map)) {
        own.move_phases(at);
    }
    Ok(map)
}

/// The solid cores of lattices, with the names of their lattices.
pub(super) fn solid(lattices: &[(String, Arc<Lattice>)]) -> (Vec<String>, Vec<CsgSolid>) {
    let cores = lattices.iter().filter_map(|(name, l)| Some((name, l.map.solved()?.cores()?)));
    cores
        .filter(|(_, c)| c.fill == CoreFill::Solid)
        .map(|(name, c)| (format!("CORE_{name}"), c.tube.clone().solid()))
        .unzip()
}

/// A field without the void cores of lattices.
pub(super) fn hollowed(field: Arc<dyn Implicit>, lattices: &[(String, Arc<Lattice>)]) -> Arc<dyn Implicit> {
    let cores = lattices.iter().filter_map(|(_, l)| l.map.solved()?.cores());
    cores
        .filter(|c| c.fill == CoreFill::Void)
        .fold(field, |of, c| Arc::new(Hollowed { of, tube: Arc::new(c.tube.clone()) }))
}

/// Refuses covered lines in the map of beams.
pub(super) fn not_of_beams(map: &Map, spec: &MapKind, path: &str) -> Result<(), DesignError> {
    match map.solved().and_then(|m| m.cores()) {
        None => Ok(()),
        Some(_) => {
            let message = "core covers singular lines of lattices; beams have no cells that close round them: leave core out, and keep the \
                           lines out of the part";
            Err(DesignError::new(format!("{path}.{}.core", spec.key()), message))
        }
    }
}
