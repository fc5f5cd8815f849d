//! Regions: data to signed distance.

use super::Loader;
use super::data::*;
use super::error::DesignError;
use crate::region::Region;

pub(super) fn region(
    spec: &RegionSpec,
    path: &str,
    loader: &dyn Loader,
) -> Result<Region, DesignError> {
    let _ = (spec, path, loader);
    todo!()
}
