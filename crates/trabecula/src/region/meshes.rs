//! The Boolean combination of meshes among combined regions.
//!
//! Two meshes that meet are two surfaces, each with edges of its own, and a third set where they cross. As one mesh, cut
//! along each other exactly, they are one surface with all of these edges, and with one distance.

use std::sync::{Arc, OnceLock};

use super::{MeshRegion, Region};

/// Regions that are combined.
pub(super) struct List {
    pub of: Vec<Region>,
    /// Computed at first use.
    meshes: OnceLock<Option<Meshes>>,
}

/// Those of a list that are meshes, as one.
pub(super) struct Meshes {
    /// Which they are.
    pub which: Vec<usize>,
    pub one: Arc<MeshRegion>,
}

impl List {
    pub fn new(of: Vec<Region>) -> List {
        List { of, meshes: OnceLock::new() }
    }

    /// The meshes of the list as one, if there are several. `any`: whether the solid is what is in any, rather than all;
    /// `negated` tells the regions that enter by their complement. One that is all of such is what they make together.
    pub fn meshes(&self, any: bool, negated: impl Fn(usize) -> bool) -> Option<&Meshes> {
        let find = || {
            let meshes = self.of.iter().enumerate();
            let meshes: Vec<_> = meshes.filter_map(|(i, r)| Some((i, r.as_mesh()?))).collect();
            if meshes.len() < 2 {
                return None;
            }
            let side = |less: bool| -> Vec<&MeshRegion> {
                let some = meshes.iter().filter(|(i, _)| negated(*i) == less);
                some.map(|(_, r)| *r).collect()
            };
            let (plain, less) = (side(false), side(true));
            let one = if plain.is_empty() {
                MeshRegion::combined(&less, true, &[])
            } else {
                MeshRegion::combined(&plain, any, &less)
            };
            Some(Meshes { which: meshes.iter().map(|(i, _)| *i).collect(), one: Arc::new(one?) })
        };
        self.meshes.get_or_init(find).as_ref()
    }
}
