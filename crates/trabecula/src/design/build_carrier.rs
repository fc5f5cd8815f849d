//! The carrier of a lattice over tetrahedra as finite elements, and what these are as a material, by the solid fraction of the cell.
//!
//! The stiffness of a cell in equal tetrahedra is cubic, along the axes of the body-centred cubic lattice that these are of. Where tetrahedra
//! lie in many directions its mean over all of them may be taken: Hill's, between the bounds of Voigt and Reuss (Hill, Proc. Phys. Soc. A 65
//! (1952) 349).

use super::tiled_cell::TiledCell;
use super::{Built, CarrierMaterial, Tiled, unit_cell};
use crate::cell::tet::{TetCell, named_tet_cell};
use crate::effective::Resolution;
use crate::volume_mesh::{self, CarrierContext, MeshedVolume};
use geometry::fault::Fault;
use geometry::monotone_cubic::monotone;
use geometry::progress::{Progress, Stage, Stopped};
use homogenise::{Material, Voigt};
use std::sync::Arc;

/// Fractions at which a cell is solved for, at most; between them monotone cubics of the logarithms.
const NODES: usize = 6;
/// Fractions from here on are solid.
const SOLID: f64 = 0.999;

/// The carrier, and the zone of each of its domains.
pub(super) fn carrier(built: &Built, order: u8) -> Result<(MeshedVolume, Vec<usize>), Fault> {
    let tiled = only(built)?;
    let zones = tiled.zones.iter().map(|z| (z.name.clone(), z.numbers.clone())).collect();
    let of = CarrierContext { zones, sets: &built.sets, bounds: built.solid.region.bounds(), order };
    let (mesh, zone_of) = volume_mesh::carrier(&tiled.tiling, &of)?;
    let edge = tiled.tiling.map.mean_edge();
    let off = tiled.mesh.fit.as_ref().map_or(0.0, |fit| fit.to_part.max);
    let bent = tiled.tiling.map.off_region().filter(|_| order == 2).map(|off| off * edge);
    let pieces = tiled.mesh.quality.pieces;
    let made = MeshedVolume {
        mesh,
        deviation: bent.unwrap_or(off),
        straight: 0,
        pieces,
        dropped: 0.0,
        loose: 0.0,
        step: [edge; 3],
    };
    Ok((made, zone_of))
}

/// The only lattice.
fn only(built: &Built) -> Result<&Tiled, Fault> {
    match &built.tilings[..] {
        [tiled] if built.blend.is_none() => Ok(tiled),
        _ => {
            let message = "of = \"carrier\" goes with one lattice over tetrahedra (map.tets), whose tetrahedra it is";
            Err(Fault::new("", message))
        }
    }
}

/// C11, C12 and C44 of each domain, and Young's modulus and Poisson's ratio of their mean over all directions, at the mean fraction of its
/// tetrahedra; moduli over Young's modulus of the solid.
pub(super) fn materials(
    built: &Built,
    (nu, n): (f64, usize),
    progress: &dyn Progress,
) -> Result<Vec<CarrierMaterial>, Stopped> {
    let tiled = only(built).map_err(Stopped::Refused)?;
    let (made, zone_of) = carrier(built, 1).map_err(Stopped::Refused)?;
    let solid = Material::isotropic(1.0, nu).map_err(Stopped::Refused)?;
    let (mut sums, mut counts) = (vec![0.0; zone_of.len()], vec![0.0; zone_of.len()]);
    for (d, fraction) in made.mesh.domain.iter().zip(&made.mesh.fraction) {
        sums[*d as usize] += fraction;
        counts[*d as usize] += 1.0;
    }
    let means: Vec<f64> = sums.iter().zip(&counts).map(|(s, c)| s / c).collect();
    if let Some(d) = means.iter().position(|mean| *mean <= 0.0) {
        let message = format!("nothing is solid in the tetrahedra of {}, which carry no load", made.mesh.domains[d]);
        return Err(Stopped::Refused(Fault::new(format!("lattice.{}.level", tiled.name), message)));
    }
    let mut out = vec![constants(&solid.stiffness); means.len()];
    let zones = zone_of.last().map_or(0, |z| z + 1);
    for zone in 0..zones {
        let own: Vec<usize> = (0..means.len()).filter(|d| zone_of[*d] == zone && means[*d] < SOLID).collect();
        if own.is_empty() {
            continue;
        }
        let cell = cell_of(tiled, zone)?;
        let nodes = nodes(&own.iter().map(|d| means[*d]).collect::<Vec<f64>>());
        let mut found: [Vec<[f64; 2]>; 3] = Default::default();
        for (i, fraction) in nodes.iter().enumerate() {
            let done = |k: usize| (zone as f64 + k as f64 / nodes.len() as f64) / zones as f64;
            let stage = Stage { whole: progress, from: done(i), to: done(i + 1) };
            let tetrahedra = TiledCell::new(&cell, tiled.tiling.part, *fraction, 1.0, tiled.tiling.map.overlap());
            let path = format!("lattice.{}", tiled.name);
            let unit = unit_cell::of_tiling(path, tetrahedra.map_err(Stopped::Refused)?);
            let stiffness = unit.stiffness(&solid, Resolution { n, plain: false }, &stage)?;
            let eigenvalues = eigenvalues(constants(&stiffness.C));
            found.iter_mut().zip(eigenvalues).for_each(|(f, v)| f.push([fraction.ln(), v.ln()]));
        }
        for d in own {
            let [three_k, two_c, c44] = [0, 1, 2].map(|k| monotone(&found[k], means[d].ln()).exp());
            out[d] = [(three_k + 2.0 * two_c) / 3.0, (three_k - two_c) / 3.0, c44];
        }
    }
    Ok(out.into_iter().map(|of| (of, isotropic(of))).collect())
}

/// The cell of a zone.
fn cell_of(tiled: &Tiled, zone: usize) -> Result<Arc<TetCell>, Stopped> {
    let Some(named) = tiled.zones.get(zone) else { return Ok(tiled.tiling.cells[0].cell.clone()) };
    let known = named_tet_cell(&named.cell).ok_or_else(|| Fault::new("cell.tet.zones", "no such cell"));
    known.and_then(|it| it.cell()).map(Arc::new).map_err(Stopped::Refused)
}

/// The fractions at which a cell is solved for: these, ascending, or some over their range.
fn nodes(fractions: &[f64]) -> Vec<f64> {
    let (first, last) = (fractions[0].ln(), fractions[fractions.len() - 1].ln());
    if fractions.len() <= NODES {
        return fractions.to_vec();
    }
    (0..NODES).map(|i| (first + (last - first) * i as f64 / (NODES - 1) as f64).exp()).collect()
}

/// C11, C12 and C44 of a cubic stiffness.
fn constants(c: &Voigt) -> [f64; 3] {
    let mean = |pairs: [[usize; 2]; 3]| pairs.iter().map(|[i, j]| c[*i][*j]).sum::<f64>() / 3.0;
    [mean([[0, 0], [1, 1], [2, 2]]), mean([[0, 1], [1, 2], [0, 2]]), mean([[3, 3], [4, 4], [5, 5]])]
}

/// What the three kinds of strain of a cubic stiffness are multiplied by: dilatation, 3K = C11 + 2 C12; stretches along the axes, 2C′ = C11 − C12,
/// twice the tetragonal shear modulus; shears between these, C44. All are positive, as C12 may not be.
fn eigenvalues([c11, c12, c44]: [f64; 3]) -> [f64; 3] {
    [c11 + 2.0 * c12, c11 - c12, c44]
}

/// Young's modulus and Poisson's ratio of Hill's mean over all directions of a cubic stiffness.
fn isotropic(of: [f64; 3]) -> [f64; 2] {
    let [three_k, two_c, c44] = eigenvalues(of);
    let bulk = three_k / 3.0;
    let shear = 0.5 * ((two_c + 3.0 * c44) / 5.0 + 5.0 * two_c * c44 / (4.0 * c44 + 3.0 * two_c));
    [9.0 * bulk * shear / (3.0 * bulk + shear), (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))]
}
