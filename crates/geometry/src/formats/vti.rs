//! VTK image data (VTI) of voxels.
//!
//! Source: Kitware, VTK File Formats, XML formats.

use std::io::{self, Write};
use std::ops::Range;

use super::invalid;
use crate::math::Vec3;
use crate::voxels::Voxels;

/// Writes voxels as image data with the cell array `solid` (`UInt8`), raw and appended.
///
/// **Errors**: what `out` reports; `InvalidInput` if the voxels do not fill their shape.
pub fn write_vti<W: Write>(voxels: &Voxels, out: &mut W) -> io::Result<()> {
    let [x, y, z] = voxels.shape;
    let count = voxels.solid.len();
    if x.checked_mul(y).and_then(|n| n.checked_mul(z)) != Some(count) {
        return Err(invalid(format!("a grid of {x} × {y} × {z} does not have {count} voxels")));
    }
    let [head, tail] = vti_frame(voxels.origin, voxels.step, voxels.shape, 0..z);
    out.write_all(&head)?;
    out.write_all(&voxels.solid)?;
    out.write_all(&tail)
}

/// What precedes and what follows the voxels of some layers in such a file: origin (of all layers) and step in mm, numbers of voxels
/// along x, y, z.
pub fn vti_frame([ox, oy, oz]: Vec3, step: f64, [x, y, _]: [usize; 3], layers: Range<usize>) -> [Vec<u8>; 2] {
    let Range { start, end } = layers;
    let mut head = format!(
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<ImageData WholeExtent="0 {x} 0 {y} {start} {end}" Origin="{ox} {oy} {oz}" Spacing="{step} {step} {step}">
<Piece Extent="0 {x} 0 {y} {start} {end}">
<CellData Scalars="solid">
<DataArray type="UInt8" Name="solid" format="appended" offset="0"/>
</CellData>
</Piece>
</ImageData>
<AppendedData encoding="raw">
_"#
    )
    .into_bytes();
    head.extend(([x, y, end - start].iter().map(|n| *n as u64).product::<u64>()).to_le_bytes());
    [head, b"\n</AppendedData>\n</VTKFile>\n".to_vec()]
}

/// The file (PVTI) by which programs open several such files of layers as one: their names and layers.
pub fn pvti([ox, oy, oz]: Vec3, step: f64, [x, y, z]: [usize; 3], files: &[(String, Range<usize>)]) -> String {
    let mut text = format!(
        r#"<?xml version="1.0"?>
<VTKFile type="PImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PImageData WholeExtent="0 {x} 0 {y} 0 {z}" GhostLevel="0" Origin="{ox} {oy} {oz}" Spacing="{step} {step} {step}">
<PCellData Scalars="solid">
<PDataArray type="UInt8" Name="solid"/>
</PCellData>
"#
    );
    for (name, Range { start, end }) in files {
        text.push_str(&format!("<Piece Extent=\"0 {x} 0 {y} {start} {end}\" Source=\"{name}\"/>\n"));
    }
    text + "</PImageData>\n</VTKFile>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_follow_their_length() {
        let voxels = Voxels { origin: [-1.0, 0.5, 0.0], step: 0.25, shape: [2, 1, 2], solid: vec![1, 2, 3, 4] };
        let mut bytes = Vec::new();
        write_vti(&voxels, &mut bytes).unwrap();
        let at = bytes.windows(13).position(|w| w == b"\n_\x04\0\0\0\0\0\0\0\x01\x02\x03").unwrap();
        assert_eq!(bytes[at + 13], 4);
        let head = String::from_utf8_lossy(&bytes[..at]).to_string();
        assert!(head.contains(r#"WholeExtent="0 2 0 1 0 2" Origin="-1 0.5 0" Spacing="0.25 0.25 0.25""#));
        assert!(write_vti(&Voxels { solid: vec![0; 3], ..voxels }, &mut bytes).is_err());
    }
}
