//! At which resolution a mesh is made: what `trabecula mesh` takes, so that both give the same bytes; and the coarser one of a
//! picture that is made while a number changes.

use geometry::fault::Fault;
use trabecula::SurfaceMaker;
use trabecula::design::Built;

/// Bytes that a surface may take of the 4 GB that a page can have: half of them, since it is drawn and written too.
const MEMORY: f64 = 1.5e9;
/// Triangles are counted with at most this number of grid steps on the smallest wavelength, and scaled from there.
const COUNTED: f64 = 16.0;
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

/// The resolution of a mesh: what is asked for, else that of the command. An error if the mesh does not fit into a page.
pub fn of_mesh(built: &Built, edge: Option<f64>, per_cell: Option<f64>) -> Result<Resolution, String> {
    let wavelength = built.solid.wavelength;
    let resolution = match (edge.or(per_cell.map(|n| wavelength / n)), built.default_chord()) {
        (Some(edge), _) if !(edge.is_finite() && edge > 0.0) => {
            return Err("the grid spacing must be a number greater than 0".into());
        }
        (Some(edge), _) => Resolution::Grid(edge),
        (None, Some(chord)) => Resolution::Chord(chord),
        (None, None) => Resolution::Grid(usual(built)),
    };
    if let Resolution::Grid(spacing) = resolution
        && spacing > wavelength / 2.0
    {
        return Err(format!(
            "grid spacing {spacing} mm is more than half the smallest wavelength, {wavelength} mm: the lattice is not resolved"
        ));
    }
    let estimate = resource_estimate(built, resolution).map_err(|f| f.to_string())?;
    if estimate.memory > MEMORY {
        return Err(format!(
            "about {:.0} million triangles do not fit into the memory of a page; use a larger spacing, or the command: \
             trabecula mesh design.toml -o part.stl",
            estimate.triangles / 1e6
        ));
    }
    Ok(resolution)
}

/// About what a surface takes.
pub struct ResourceEstimate {
    /// Number of triangles.
    pub triangles: f64,
    /// Memory, bytes.
    memory: f64,
}

/// About what a surface takes; counted on a coarser grid, if need be, and scaled from there.
pub fn resource_estimate(built: &Built, resolution: Resolution) -> Result<ResourceEstimate, Fault> {
    let (found, times) = match resolution {
        Resolution::Grid(spacing) => {
            let counted = spacing.max(built.solid.wavelength / COUNTED);
            (built.surface().estimate(counted)?, (counted / spacing).powi(2))
        }
        Resolution::Chord(chord) => (built.beam_surface()?.estimate(chord)?, 1.0),
    };
    Ok(ResourceEstimate { triangles: found.triangles * times, memory: found.memory * times })
}

/// The grid spacing of a mesh for which none is asked, mm.
pub fn usual(built: &Built) -> f64 {
    built.coarser_spacing().map_or_else(|| built.report().spacing, |c| c.spacing)
}

/// The resolution of a picture of about this number of grid cells, or of beams with at most this number of triangles.
pub fn of_picture(built: &Built, cells: f64, triangles: f64) -> Resolution {
    let patches = built.default_chord().map(|chord| Resolution::Chord(8.0 * chord));
    if let Some(found) = patches.filter(|p| resource_estimate(built, *p).is_ok_and(|n| n.triangles <= triangles)) {
        return found;
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
