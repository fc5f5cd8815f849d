//! The periodic cell of a design.

use serde_json::json;
use std::cell::RefCell;

use super::data::*;
use super::tiled_cell::TiledCell;
use super::{Built, Design, Loader};
use crate::blend::Blend;
use crate::csg_tree::{CsgSolid, CsgTree};
use crate::effective::{SheetSide, UnitCell};
use crate::environment::Environment;
use crate::implicit::{Implicit, Surface};
use crate::kind::DesignError;
use crate::lattice::{Lattice, Level};
use crate::map::{Affine, MapKind};
use crate::region::{Cuboid, Region};
use crate::truss::Beams;
use geometry::math::{Aabb, Mat3, Vec3, add, apply, inverse, scale, transpose};
use std::sync::Arc;

/// Part of a cell by which the box that its beams are laid in is larger on each side.
const MARGIN: f64 = 0.1;

/// The cell of a design that has been built.
pub(super) fn of(built: &Built, design: &Design, loader: &dyn Loader) -> Result<UnitCell, DesignError> {
    if let Some(blended) = &built.blend {
        return of_blend(&blended.blend, built);
    }
    match (&built.lattices[..], &built.tilings[..], &built.beams[..]) {
        ([(name, lattice)], [], []) => of_lattice(name, lattice),
        ([], [tiled], []) => Ok(of_tiling(format!("lattice.{}", tiled.name), TiledCell::of(tiled)?)),
        ([], [], [(name, _)]) => of_beams(name, design, loader),
        _ => Err(DesignError::new("lattice", "give one lattice, or one graph of beams")),
    }
}

/// The corner at phase zero and the edges, as columns, of an affine map's cell with these periods along each.
fn frame(map: &Affine, repeats: [i32; 3]) -> (Vec3, Mat3) {
    let mut edges = inverse(&map.matrix);
    let corner = scale(apply(&edges, map.shift), -1.0);
    for row in &mut edges {
        for (v, n) in row.iter_mut().zip(repeats) {
            *v /= f64::from(n);
        }
    }
    (corner, edges)
}

/// Of lattices whose cells are alike in size and orientation and that have the same shares everywhere.
fn of_blend(blend: &Arc<Blend>, built: &Built) -> Result<UnitCell, DesignError> {
    let maps: Option<Vec<&Affine>> = built.lattices.iter().map(|(_, l)| l.uniform().and(l.map.affine())).collect();
    let maps = maps.filter(|_| blend.is_uniform() && built.tilings.is_empty() && built.beams.is_empty());
    let maps = maps.filter(|maps| maps.iter().all(|map| map.matrix == maps[0].matrix));
    let Some([first, ..]) = maps.as_deref() else {
        let message = "the cells of this blend differ from place to place; those of lattices of one level each, of the same wavelength and \
                       orientation, under constant weights are alike. Take the figures of a design with one of its lattices, at several \
                       fractions if they vary";
        return Err(DesignError::new("blend", message));
    };
    let (corner, edges) = frame(first, [1; 3]);
    Ok(pulled("blend".into(), blend.clone(), corner, edges))
}

pub(super) fn of_lattice(name: &str, lattice: &Arc<Lattice>) -> Result<UnitCell, DesignError> {
    let path = format!("lattice.{name}");
    let Some(map) = lattice.map.affine() else {
        let message = "cells differ from place to place under this map, and none is periodic; take map.affine with the wavelengths of \
                       the place in question";
        return Err(DesignError::new(format!("{path}.map"), message));
    };
    let Some(level) = lattice.uniform() else {
        let message = "the amount varies from place to place, and no cell is periodic; take one number, and several designs (or \
                       `trabecula law`) for the range";
        return Err(DesignError::new(format!("{path}.level"), message));
    };
    let (corner, edges) = frame(map, lattice.cell.repeats());
    let wall = match lattice.distance() {
        Some(_) => Some(2.0 * level),
        None => lattice.cell.thickness(lattice.part, level, &map.matrix),
    };
    let mut cell = pulled(path, lattice.clone(), corner, edges);
    cell.fraction = match &lattice.level {
        Level::Fraction(asked) => asked.constant(),
        _ => Some(lattice.fraction(level)),
    };
    cell.connected = Some(lattice.connected_fraction());
    cell.wall = wall;
    if lattice.distance().is_none() {
        let (lattice, to_phase) = (lattice.clone(), map.matrix);
        let widest = move |side: Option<SheetSide>| {
            let passages = lattice.cell.passages(lattice.part, level);
            let pores = lattice.cell.pores(lattice.part, level, &to_phase);
            let sides = [Some(SheetSide::Lower), Some(SheetSide::Upper)];
            let through = passages.into_iter().zip(pores).zip(sides);
            let through = through.filter(|((passes, _), of)| *passes && (side.is_none() || side == *of));
            through.map(|((_, pore), _)| pore).fold(0.0, f64::max)
        };
        cell.pore = Some(Box::new(widest));
    }
    Ok(cell)
}

/// Of tetrahedra, with the path of their lattice.
pub(super) fn of_tiling(path: String, tiled: TiledCell) -> UnitCell {
    let mut cell = pulled(path, tiled.field, [0.0; 3], tiled.edges);
    (cell.fraction, cell.wall) = (Some(tiled.fraction), tiled.wall);
    cell
}

fn of_beams(name: &str, design: &Design, loader: &dyn Loader) -> Result<UnitCell, DesignError> {
    let path = format!("beams.{name}");
    let no = |key: &str, message: &str| Err(DesignError::new(format!("{path}{key}"), message));
    let Some(spec) = design.beams.0.get(name) else { return no("", "no such beams") };
    let GraphSpec::Cell(of) = &spec.graph else {
        return no(
            "",
            "these beams are given one by one or by a program of repeats, without a periodic cell; give them by cell = \"octet\" (or \
             another, see `trabecula cells --beams`) and map.affine",
        );
    };
    for (key, grade) in [(".radius", &spec.radius), (".hub", &spec.hub)] {
        if let Some(GradeSpec::Kind(_)) = grade {
            return no(key, "it varies from place to place, and no cell is periodic; give one number");
        }
    }
    if !matches!(of.map, MapKind::Affine(_) | MapKind::Spartan(_)) {
        return no(".map", "cells differ from place to place under this map, and none is periodic; take map.affine");
    }
    let anywhere: Region = Arc::new(Cuboid::new([0.0; 3], [1.0; 3]).map_err(|f| DesignError::fault(&path, f))?);
    let (at, notes) = (format!("{path}.map"), RefCell::default());
    let environment = Environment { path: at, region: &anywhere, points: &[], filled: &[], loader, notes: &notes };
    let map = of.map.build(&environment)?;
    let Some(map) = map.affine() else { return no(".map", "this map is not affine") };
    let (corner, edges) = frame(map, [1; 3]);
    // The same beams in a box about the cell, whatever the part.
    let far = (0..8).map(|i| [0, 1, 2].map(|a| if i >> a & 1 == 1 { 1.0 + MARGIN } else { -MARGIN }));
    let bounds = far.fold(Aabb::EMPTY, |b, u| b.with(add(corner, apply(&edges, u))));
    let mut alone = design.to_json();
    if let Some(top) = alone.as_object_mut() {
        top.retain(|key, _| ["schema", "units", "beams"].contains(&key.as_str()));
        top.insert("region".into(), json!({"box": {"min": bounds.min, "max": bounds.max}}));
    }
    let built = Design::from_json(&alone.to_string())?.build(loader)?;
    let Some((_, Beams::Truss(truss))) = built.beams.first() else { return no("", "no beams") };
    let quadors = truss.quadors.clone();
    let thin = (0..quadors.beams()).map(|b| quadors.pencil(b).waist()).fold(f64::INFINITY, f64::min);
    let mut cell = pulled(path, quadors, corner, edges);
    cell.wall = (thin < f64::INFINITY).then_some(2.0 * thin);
    Ok(cell)
}

/// A periodic field in coordinates of its cell.
fn pulled(path: String, field: Arc<dyn Implicit>, corner: Vec3, edges: Mat3) -> UnitCell {
    let parts = match field.parts() {
        parts if parts.is_empty() => vec![field],
        parts => parts,
    };
    let sheet = parts.len() == 2;
    let surfaces: Vec<Surface> = parts.into_iter().map(Surface::smooth).collect();
    let tree = CsgTree::Intersection((0..surfaces.len()).map(CsgTree::Leaf).collect());
    UnitCell {
        path,
        solid: CsgSolid { surfaces, tree }.in_frame(corner, edges),
        sheet,
        edges: transpose(&edges),
        fraction: None,
        connected: None,
        wall: None,
        pore: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effective::Resolution;
    use crate::environment::NoFiles;
    use geometry::progress::Silent;

    fn cell(name: &str, part: &str, fraction: f64) -> UnitCell {
        let text = format!(
            "schema = 1\nregion.box.size = [1, 1, 1]\n[lattice.a]\ncell = \"{name}\"\npart = \"{part}\"\n\
             level.fraction = {fraction}\nmap.affine.wavelength = 1\n"
        );
        let design = Design::from_toml(&text).expect("a design");
        design.build(&NoFiles).expect("built").unit_cell(&design, &NoFiles).expect("a cell")
    }

    /// A network that is apart has necks of no width: it is said to be apart, and no number of voxels is advised.
    #[test]
    fn a_network_that_is_apart_is_said_to_be_once() {
        let cell = cell("primitive", "lower", 0.1);
        assert_eq!(cell.wall, Some(0.0));
        let found = cell.conductivity(0.0, Resolution { n: 8, plain: false }, &Silent).expect("solved");
        let said: Vec<&str> = found.warnings.iter().map(|w| w.message.as_str()).collect();
        assert!(said.len() == 1 && said[0].contains("not one piece"), "{said:?}");
    }

    /// A gyroid is the same after a cyclic change of the axes, and two load cases of six are solved: the figures along all axes are one number.
    #[test]
    fn the_symmetry_of_a_cubic_cell_is_used() {
        let cell = cell("gyroid", "sheet", 0.3);
        let material = homogenise::Material::isotropic(1.0, 0.3).expect("valid");
        let c = cell.stiffness(&material, Resolution { n: 16, plain: false }, &Silent).expect("solved").C_n;
        for (a, b) in [([0, 0], [1, 1]), ([0, 0], [2, 2]), ([3, 3], [4, 4]), ([0, 1], [1, 2]), ([0, 1], [2, 0])] {
            assert!((c[a[0]][a[1]] - c[b[0]][b[1]]).abs() <= 1e-15, "{a:?} {b:?}");
        }
    }

    fn tiled(name: &str, part: &str, fraction: f64, overlap: f64) -> UnitCell {
        let text = format!(
            "schema = 1\nregion.box.size = [4, 4, 4]\n[lattice.a]\ncell.tet.name = \"{name}\"\npart = \"{part}\"\n\
             level.fraction = {fraction}\nmap.tets = {{ size = 2, overlap = {overlap} }}\n"
        );
        let design = Design::from_toml(&text).expect("a design");
        design.build(&NoFiles).expect("built").unit_cell(&design, &NoFiles).expect("a cell")
    }

    /// The tiling repeats after each edge, continuously, and has the fraction asked for: of its tetrahedra exactly, of blended ones by the
    /// table of a sample (0.002).
    #[test]
    fn a_tiling_of_tetrahedra_repeats_and_has_its_fraction() {
        for (name, part, fraction, overlap) in
            [("diamond", "lower", 0.25, 0.0), ("primitive", "sheet", 0.4, 0.0), ("diamond", "lower", 0.3, 0.1)]
        {
            let cell = tiled(name, part, fraction, overlap);
            let from: Vec<Vec3> =
                (0..500).map(|i| [0.618, 0.414, 0.732].map(|g: f64| (g * f64::from(i)).fract() * 1.2 - 0.1)).collect();
            let value = |points: &[Vec3]| {
                let mut v = vec![0.0; points.len()];
                crate::field::Field::values(&cell.solid, points, &mut v);
                v
            };
            let near = |u: f64| 0.1 * (2.0 * u - 1.0);
            for axis in 0..3 {
                let low: Vec<Vec3> =
                    from.iter().map(|u| core::array::from_fn(|a| if a == axis { near(u[a]) } else { u[a] })).collect();
                let high: Vec<Vec3> =
                    low.iter().map(|u| core::array::from_fn(|a| u[a] + f64::from(u8::from(a == axis)))).collect();
                let (low, high) = (value(&low), value(&high));
                let most = low.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let off = low.iter().zip(&high).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-9 * most, "{name}: {off:.2e} of {most}");
            }
            let material = homogenise::Material::isotropic(1.0, 0.3).expect("valid");
            let found = cell.stiffness(&material, Resolution { n: 24, plain: false }, &Silent).expect("solved");
            let (close, grid) = (if overlap > 0.0 { 4e-3 } else { 1e-3 }, &found.grids[0]);
            assert!((grid.fraction - fraction).abs() < close, "{name}: {} for {fraction}", grid.fraction);
            // Cubic, so three numbers are all.
            let c = found.C_n;
            for (a, b) in [([0, 0], [1, 1]), ([0, 1], [1, 2]), ([3, 3], [4, 4])] {
                assert!((c[a[0]][a[1]] - c[b[0]][b[1]]).abs() < 1e-6 * c[0][0], "{name}: {c:?}");
            }
            assert!(c[0][3].abs() < 1e-3 * c[0][0] && c[3][4].abs() < 1e-3 * c[0][0], "{name}: {c:?}");
        }
    }
}
