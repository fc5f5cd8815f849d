//! Regions of a design.

use super::Loader;
use crate::kind::DesignError;
use crate::region::{Context, HalfSpace, HalfSpaceKind, Notes, Region, RegionKind};

/// The region at `path`; what is to be said of it is added to `notes`.
pub(super) fn region(
    kind: &RegionKind,
    path: &str,
    loader: &dyn Loader,
    notes: &mut Notes,
) -> Result<Region, DesignError> {
    let load = |file: &str| loader.load(file);
    kind.build(&mut Context::new(path, &load, notes)).map_err(|f| DesignError::fault(path, f))
}

pub(super) fn halfspace(kind: &HalfSpaceKind, path: &str) -> Result<HalfSpace, DesignError> {
    kind.made().map_err(|f| DesignError::fault(path, f))
}
