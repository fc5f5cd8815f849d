//! VTK image data (XML), for viewers and simulation.

use std::io;

use crate::extract::Voxels;

/// Writes voxels as cell data `solid` (UInt8) of a VTK ImageData file: one appended raw block with a UInt64 length,
/// origin and spacing in mm.
pub fn write<W: io::Write>(voxels: &Voxels, out: &mut W) -> io::Result<()> {
    let [x, y, z] = voxels.shape;
    let [ox, oy, oz] = voxels.origin;
    let h = voxels.step;
    let extent = format!("0 {x} 0 {y} 0 {z}");
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<ImageData WholeExtent="{extent}" Origin="{ox} {oy} {oz}" Spacing="{h} {h} {h}">
<Piece Extent="{extent}">
<PointData></PointData>
<CellData Scalars="solid">
<DataArray type="UInt8" Name="solid" format="appended" RangeMin="0" RangeMax="1" offset="0"></DataArray>
</CellData>
</Piece>
</ImageData>
<AppendedData encoding="raw">
_"#
    )?;
    out.write_all(&(voxels.solid.len() as u64).to_le_bytes())?;
    out.write_all(&voxels.solid)?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_follows_the_underscore() {
        let voxels = Voxels { origin: [-1.0, 0.5, 2.0], step: 0.25, shape: [2, 1, 3], solid: vec![1, 0, 0, 1, 1, 1] };
        let mut bytes = Vec::new();
        write(&voxels, &mut bytes).expect("a Vec takes everything");
        let at = bytes.iter().position(|&b| b == b'_').expect("an underscore starts the data") + 1;
        let head = String::from_utf8_lossy(&bytes[..at]);
        assert!(head.contains(r#"WholeExtent="0 2 0 1 0 3" Origin="-1 0.5 2" Spacing="0.25 0.25 0.25""#));
        assert_eq!(bytes[at..at + 8], 6u64.to_le_bytes());
        assert_eq!(bytes[at + 8..at + 14], voxels.solid);
        assert_eq!(&bytes[at + 14..], b"\n</AppendedData>\n</VTKFile>\n");
    }
}
