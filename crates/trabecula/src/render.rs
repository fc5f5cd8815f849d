//! Pictures of meshes, drawn on the processor.
use crate::extract::Surface;

/// How to draw.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Direction from which the camera looks: azimuth about +Z and elevation, degrees.
    pub azimuth: f64,
    /// Elevation above the XY plane, degrees.
    pub elevation: f64,
}

/// Draws the surface; returns RGB rows from the top.
pub fn render(surface: &Surface, view: &View) -> Vec<u8> {
    let _ = (surface, view);
    todo!()
}

/// Encodes RGB rows as PNG.
pub fn png(rgb: &[u8], size: [usize; 2]) -> Vec<u8> {
    let _ = (rgb, size);
    todo!()
}
