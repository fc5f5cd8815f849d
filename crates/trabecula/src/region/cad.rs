//! Parts of CAD systems: triangles, and the faces that they divide.

use super::Region;
use geometry::fault::{Fault, nearest};
use geometry::math::Vec3;
use geometry::mesh::Mesh;

/// Suffixes of files of CAD systems.
pub const CAD: [&str; 4] = ["step", "stp", "iges", "igs"];

/// How the faces of a part become triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Tessellation {
    /// Chord error, mm; the reader's own share of the part's size if none is given.
    pub chord: Option<f64>,
    /// Greatest angle between the normals of a face within a triangle, degrees; the reader's own if none is given.
    pub angle: Option<f64>,
    /// The solid that is read, by its name; all of them if none is given.
    pub solid: Option<String>,
}

/// Name and colour of a face; empty where it has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaceLabel {
    /// Name.
    pub name: String,
    /// Colour, such as "#ff0000".
    pub color: String,
}

/// A part of a CAD system as triangles, mm.
#[derive(Clone, Debug)]
pub struct CadMesh {
    /// The file.
    pub file: String,
    /// The triangles.
    pub mesh: Mesh,
    /// The face of each triangle.
    pub face: Vec<u32>,
    /// The faces.
    pub labels: Vec<FaceLabel>,
    /// Chord error, mm.
    pub chord: f64,
    /// Greatest angle between normals within a triangle, degrees.
    pub angle: f64,
    /// Volume within the exact faces, mm³; none where it is unknown.
    pub volume: Option<f64>,
}

impl CadMesh {
    /// Whether a face goes by a name: its own, its colour, or its number from 1.
    fn goes_by(&self, face: usize, name: &str) -> bool {
        let label = &self.labels[face];
        label.name == name || (!label.color.is_empty() && label.color.eq_ignore_ascii_case(name))
    }

    /// Adds the corners of the triangles of the faces of a name; false if there are none.
    fn find(&self, name: &str, out: &mut Vec<[Vec3; 3]>) -> bool {
        let count = self.labels.len();
        let mut wanted: Vec<bool> = (0..count).map(|i| self.goes_by(i, name)).collect();
        if !wanted.contains(&true) {
            match name.parse::<usize>() {
                Ok(number) if (1..=count).contains(&number) => wanted[number - 1] = true,
                _ => return false,
            }
        }
        let before = out.len();
        let of = self.face.iter().enumerate().filter(|(_, f)| wanted.get(**f as usize) == Some(&true));
        out.extend(of.map(|(i, _)| self.mesh.corners(i)));
        out.len() > before
    }
}

/// The corners of the triangles of the faces of a part that go by any of some names.
///
/// # Errors
/// A part from no file of a CAD system; a name of no face.
pub(super) fn faces(part: Option<&Region>, names: &[String]) -> Result<Vec<[Vec3; 3]>, Fault> {
    let mut files = Vec::new();
    if let Some(part) = part {
        part.cad(&mut files);
    }
    if files.is_empty() {
        let message = "faces are those of a STEP file, and the region is made of none: give region.mesh a STEP file, or \
                       name the place by another region";
        return Err(Fault::new("", message));
    }
    let mut out = Vec::new();
    for (i, name) in names.iter().enumerate() {
        // Not the first alone that has it.
        let found = files.iter().filter(|f| f.find(name, &mut out)).count();
        if found == 0 {
            let count: usize = files.iter().map(|f| f.labels.len()).sum();
            let mut known: Vec<&str> = files.iter().flat_map(|f| &f.labels).map(|l| l.name.as_str()).collect();
            known.sort_unstable();
            known.dedup();
            known.retain(|n| !n.is_empty());
            let near = nearest(name, known.iter().copied()).map_or(".".into(), |n| format!("; did you mean \"{n}\"?"));
            let names = if known.is_empty() { "none".into() } else { known.join(", ") };
            let message = format!(
                "no face is named \"{name}\"{near} Names: {names}. A face also goes by its number, 1 to {count}, or its \
                 colour; `trabecula faces` lists them"
            );
            return Err(Fault::new(format!("[{i}]"), message).found(name));
        }
    }
    Ok(out)
}
