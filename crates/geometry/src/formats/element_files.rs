//! Files of finite element meshes: Abaqus and CalculiX, Gmsh, Nastran, VTK.

use std::io::{self, Write};

use rayon::prelude::*;

use crate::fe_mesh::{FeField, FeMesh, Load};

mod abaqus;
mod beam_elements;
mod gmsh22;
mod gmsh41;
mod gmsh_entities;
mod medit;
mod nastran;
mod openfoam;
mod shells;
mod voxel_elements;
mod vtk_cells;

pub use beam_elements::{BEAM_FORMATS, BeamFormat};
pub use openfoam::{POLY_FILES, PolyFile};
pub use shells::{SHELL_FORMATS, ShellFormat};
pub use voxel_elements::{HEX_FORMATS, HexFormat};

/// What is written besides the mesh.
#[derive(Clone, Debug, Default)]
pub struct FeText {
    /// The first line: what it is.
    pub title: String,
    /// Young's modulus (MPa) and Poisson's ratio: of all domains; of a mesh with solid fractions, of each.
    pub elastic: Vec<[f64; 2]>,
    /// In place of these C11, C12 and C44 (MPa) of each domain, along the axes of its elements; empty where materials are isotropic.
    pub cubic: Vec<[f64; 3]>,
    /// Names of sets whose nodes are held in all directions.
    pub held: Vec<String>,
    /// Names of sets and the loads on their faces.
    pub loads: Vec<(String, Load)>,
    /// Whether an `.inp` is for Abaqus where CalculiX takes the same words otherwise: sections of beams.
    pub abaqus: bool,
    /// Further numbers of nodes and elements, in formats that have them.
    pub fields: Vec<FeField>,
}

impl FeText {
    /// Young's modulus and Poisson's ratio of a domain.
    fn elastic(&self, domain: usize) -> [f64; 2] {
        self.elastic.get(domain).or(self.elastic.last()).copied().unwrap_or([1.0, 0.3])
    }
}

/// A format of finite element meshes.
pub struct FeFormat {
    /// Suffix of file names.
    pub suffix: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Writes a mesh.
    pub write: fn(&FeMesh, &FeText, &mut dyn Write) -> io::Result<()>,
}

/// The formats of finite element meshes.
pub const FE_FORMATS: [FeFormat; 6] = [
    FeFormat { suffix: "inp", title: "Abaqus, CalculiX", write: abaqus::write },
    FeFormat { suffix: "msh", title: "Gmsh 4.1", write: gmsh41::write },
    FeFormat { suffix: "msh2", title: "Gmsh 2.2", write: gmsh22::write },
    FeFormat { suffix: "vtu", title: "VTK, ParaView", write: vtk_cells::write },
    FeFormat { suffix: "bdf", title: "Nastran", write: nastran::write },
    FeFormat { suffix: "mesh", title: "Medit, Mmg, FreeFem", write: medit::write },
];

/// Items formatted by one thread at a time, and by all before they are written.
const CHUNK: usize = 1 << 13;
const BATCH: usize = 1 << 18;

/// Writes a text for each of `count` items, formatted by all threads and in order.
fn lines(out: &mut dyn Write, count: usize, line: impl Fn(usize, &mut String) + Sync) -> io::Result<()> {
    for first in (0..count).step_by(BATCH) {
        let end = (first + BATCH).min(count);
        let starts: Vec<usize> = (first..end).step_by(CHUNK).collect();
        let texts: Vec<String> = starts
            .into_par_iter()
            .map(|start| {
                let mut text = String::with_capacity(64 * CHUNK);
                (start..(start + CHUNK).min(end)).for_each(|i| line(i, &mut text));
                text
            })
            .collect();
        texts.iter().try_for_each(|t| out.write_all(t.as_bytes()))?;
    }
    Ok(())
}

/// Appends a whole number.
fn push(text: &mut String, mut n: usize) {
    let mut digits = [0u8; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (n % 10) as u8;
        n /= 10;
        if n == 0 {
            break;
        }
    }
    text.extend(digits[at..].iter().map(|d| *d as char));
}

/// Writes numbers, at most `row` on a line, with `between` them.
fn rows(out: &mut dyn Write, numbers: &[u32], row: usize, between: &str) -> io::Result<()> {
    let count = numbers.len().div_ceil(row);
    lines(out, count, |i, text| {
        for (k, n) in numbers[i * row..((i + 1) * row).min(numbers.len())].iter().enumerate() {
            if k > 0 {
                text.push_str(between);
            }
            push(text, *n as usize + 1);
        }
        text.push('\n');
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fe_mesh::FeSet;

    fn two() -> FeMesh {
        let set =
            FeSet { name: "X0".into(), nodes: vec![0, 2, 3], elements: vec![0], faces: vec![(0, 1)], bulk: false };
        FeMesh {
            nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1], [1.0; 3]],
            tets: vec![[0, 1, 2, 3], [1, 4, 2, 3]],
            domain: vec![0, 1],
            domains: vec!["WALL".into(), "LOWER".into()],
            sets: vec![set],
            ..FeMesh::default()
        }
    }

    #[test]
    fn every_format_is_written_with_sets_and_domains() {
        for format in FE_FORMATS {
            let mut bytes = Vec::new();
            (format.write)(
                &two(),
                &FeText { title: "two".into(), elastic: vec![[1.0, 0.3]], ..FeText::default() },
                &mut bytes,
            )
            .unwrap();
            let text = String::from_utf8_lossy(&bytes);
            for word in ["X0", "WALL", "LOWER"] {
                assert!(text.contains(word), "{}: {word}", format.suffix);
            }
        }
    }

    #[test]
    fn lists_have_sixteen_numbers_a_line() {
        let mut out = Vec::new();
        rows(&mut out, &(0..40).collect::<Vec<u32>>(), 16, ", ").unwrap();
        let text = String::from_utf8(out).unwrap();
        let counts: Vec<usize> = text.lines().map(|l| l.split(", ").count()).collect();
        assert_eq!(counts, [16, 16, 8]);
        assert!(text.starts_with("1, 2, ") && text.ends_with("39, 40\n"));
    }
}
