//! The Boolean combination of meshes among combined regions.
//!
//! Two meshes that meet are two surfaces, each with edges of its own, and a third set where they cross. As one mesh, cut
//! along each other exactly, they are one surface with all of these edges, and with one distance.

use std::sync::Arc;

use super::{MeshRegion, Region};
use geometry::fault::Fault;
use geometry::similarity::Similarity;

/// Regions that are combined.
pub(super) struct List {
    /// As they were given.
    pub of: Vec<Region>,
    /// With all meshes as one, and whether each enters by its complement; the first does not.
    pub operands: Vec<(Region, bool)>,
}

impl List {
    /// Of regions, of which the solid is what is in any, rather than all, if `any`, and of which the `negated` ones enter by their
    /// complement.
    pub fn new(of: Vec<Region>, any: bool, negated: fn(usize) -> bool) -> List {
        let one = of_meshes(&of, any, negated);
        let operand = |(i, r): (usize, &Region)| match &one {
            Some((first, one)) if *first == i => Some((one.clone(), negated(i))),
            Some(_) if r.as_mesh().is_some() => None,
            _ => Some((r.clone(), negated(i))),
        };
        let operands = of.iter().enumerate().filter_map(operand).collect();
        List { of, operands }
    }

    /// The images: what was made one stays one.
    pub fn moved(&self, by: &Similarity) -> Result<List, Fault> {
        let of = self.of.iter().map(|r| r.clone().moved(by)).collect::<Result<Vec<_>, Fault>>()?;
        let operand = |(r, negated): &(Region, bool)| {
            let given = self.of.iter().position(|o| Arc::ptr_eq(o, r));
            Ok((given.map_or_else(|| r.clone().moved(by), |i| Ok(of[i].clone()))?, *negated))
        };
        let operands = self.operands.iter().map(operand).collect::<Result<_, Fault>>()?;
        Ok(List { of, operands })
    }
}

/// The meshes of a list as one, in the place of the first, if there are several and something is left of them: what those make that are not
/// negated, less those that are; if all are, what is in any of them.
fn of_meshes(of: &[Region], any: bool, negated: fn(usize) -> bool) -> Option<(usize, Region)> {
    let meshes: Vec<(usize, &MeshRegion)> =
        of.iter().enumerate().filter_map(|(i, r)| Some((i, r.as_mesh()?))).collect();
    if meshes.len() < 2 {
        return None;
    }
    let of_sign = |less: bool| -> Vec<&MeshRegion> {
        meshes.iter().filter(|(i, _)| negated(*i) == less).map(|(_, r)| *r).collect()
    };
    let (plain, less) = (of_sign(false), of_sign(true));
    let one = match plain.is_empty() {
        true => MeshRegion::combined(&less, true, &[]),
        false => MeshRegion::combined(&plain, any, &less),
    };
    Some((meshes[0].0, Arc::new(one?)))
}
