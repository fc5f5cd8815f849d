//! At which resolution a mesh is made: what `trabecula mesh` takes, so that both give the same bytes; and the coarser one of a
//! picture that is made while a number changes.

use trabecula::design::Built;

/// Bytes that a surface may take of the 4 GB that a page can have: half of them, since it is drawn and written too.
const MEMORY: f64 = 1.5e9;
/// Grid steps on the smallest wavelength of a picture, at least and at most. Fewer show another lattice, and save no time: both sides
/// of a wall are then in one grid cell, which is the dearer one.
const PICTURE: [f64; 2] = [12.0, 48.0];

/// A resolution, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// The spacing of a grid.
    Grid(f64),
    /// The chord error of beams alone.
    Chord(f64),
}

/// The resolution of a mesh: what is asked for, else that of the command.
pub fn of_mesh(built: &Built, edge: Option<f64>, per_cell: Option<f64>) -> Result<Resolution, String> {
    if let (None, None, Some(chord)) = (edge, per_cell, built.default_chord()) {
        return Ok(Resolution::Chord(chord));
    }
    let wavelength = built.solid.wavelength;
    let asked = edge.or(per_cell.map(|n| wavelength / n));
    if asked.is_some_and(|v| !(v.is_finite() && v > 0.0)) {
        return Err("the grid spacing must be a number greater than 0".into());
    }
    let spacing = asked.unwrap_or_else(|| usual(built));
    if spacing > wavelength / 2.0 {
        return Err(format!(
            "grid spacing {spacing} mm is more than half the smallest wavelength, {wavelength} mm: the lattice is not resolved"
        ));
    }
    let counted = spacing.max(wavelength / 16.0);
    let need = built.surface().estimate(counted).map_err(|f| f.to_string())?;
    let times = (counted / spacing).powi(2);
    if need.memory * times > MEMORY {
        return Err(format!(
            "about {:.2} million triangles do not fit into the memory of a page; use a larger spacing, or the command: \
             trabecula mesh design.toml -o part.stl",
            need.triangles * times / 1e6
        ));
    }
    Ok(Resolution::Grid(spacing))
}

/// The grid spacing of a mesh for which none is asked, mm.
pub fn usual(built: &Built) -> f64 {
    built.coarser_spacing().map_or_else(|| built.report().spacing, |c| c.spacing)
}

/// The resolution of a picture of about this number of grid cells.
pub fn of_picture(built: &Built, cells: f64) -> Resolution {
    if let Some(chord) = built.default_chord() {
        return Resolution::Chord(8.0 * chord);
    }
    let wavelength = built.solid.wavelength;
    let volume: f64 = extents(built).iter().product();
    let wanted = (volume / cells.max(1.0)).cbrt();
    Resolution::Grid(wanted.clamp(wavelength / PICTURE[1], wavelength / PICTURE[0]))
}

/// The grid cells of a picture.
pub fn cells(built: &Built, spacing: f64) -> f64 {
    extents(built).iter().map(|e| e / spacing + 1.0).product()
}

fn extents(built: &Built) -> [f64; 3] {
    let b = built.solid.region.bounds();
    [0, 1, 2].map(|a| b.max[a] - b.min[a])
}
