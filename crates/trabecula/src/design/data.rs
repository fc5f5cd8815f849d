//! The data of a design, as it stands in a file. A kind is the name of a table, or a bare word without settings.

use std::collections::BTreeMap;

use crate::cell::tet::tet_catalogue;
use crate::cell::{catalogue, named};
pub use crate::grade::{ControlPoints, FieldKind, GradeKind, GradeSpec};
pub use crate::kind::Unit;
use crate::kind::{Defs, DesignError, Fault, Key, Kind, Node, NodeCursor, OneOrThree, Table};
pub use crate::map::{
    AffineKind, CellJoin, LayersSpec, MadeTetsKind, MapKind, MesherKind, Method, NetSpec, SurfaceEnds, TetFileKind,
    TetsKind,
};
pub use crate::region::{HalfSpaceKind, MeshFile, RegionKind};
use geometry::math::Vec3;
use geometry::symmetry::Group;

/// A word out of a catalogue: its type, noun, the catalogue's words, why a word of another catalogue is refused, and words that
/// others use, each with the one to use here.
macro_rules! name_of {
    ($(#[$doc:meta])* $type:ident, $noun:literal, $names:expr, $refused:expr, [$($hint:expr),* $(,)?]) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub struct $type(pub String);

        impl Kind for $type {
            fn expected() -> String {
                format!("one of {}", $names.collect::<Vec<&str>>().join(", "))
            }

            fn fits(node: &Node) -> u8 {
                String::fits(node)
            }

            fn read(at: &NodeCursor) -> Result<Self, DesignError> {
                let names: Vec<&'static str> = $names.collect();
                let refused: fn(&str) -> Option<String> = $refused;
                if let crate::kind::Value::Text(word) = &at.node.value
                    && !names.contains(&word.as_str())
                    && let Some(why) = refused(word)
                {
                    return Err(at.error(why));
                }
                at.word_of($noun, &names, &[$($hint),*]).map(|word| $type(word.into()))
            }

            fn write(&self) -> Node {
                self.0.write()
            }

            fn check(&self, _: &Key) -> Result<(), Fault> {
                Ok(())
            }

            fn schema(_: &Key, _: &mut Defs) -> Node {
                let names: Vec<Node> = $names.map(Node::from).collect();
                Node::table([("type", "string".into()), ("enum", names.into())])
            }
        }
    };
}

mod beams_kind;
mod blend_kind;

pub use beams_kind::*;
pub use blend_kind::*;

/// A lattice: a cell seen through a map, cut by a part at a level.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Lattice", noun = "a lattice", before = deeper)]
pub struct LatticeSpec {
    /// The function on the torus, such as "gyroid".
    #[kind(hints("tpms", "surface", "unit_cell", "type"))]
    pub cell: CellSpec,
    /// Which side of the level is solid: sheet (|f| ≤ t), lower (f ≤ t) or upper (f ≥ t).
    pub part: PartSpec,
    /// Position (mm) to phase (turns), such as map.affine with wavelength = 4.
    #[kind(hints("mapping", "transform", "coordinates"))]
    pub map: MapKind,
    /// How much is solid: exactly one of iso, fraction, porosity, thickness, pore, stiffness, permeability.
    pub level: LevelSpec,
}

/// Explains that a key, or what others call it, stands one level deeper, where beginners do not look for it.
fn deeper(at: &NodeCursor) -> Result<(), DesignError> {
    let own = LatticeSpec::keys();
    let tables = [("level", LevelSpec::keys()), ("map.affine", AffineKind::keys())];
    for (word, entry) in at.entries("a lattice").unwrap_or_default() {
        let of_own = |k: &Key| k.name == word || entry.node.as_text().is_some() && k.hints.contains(&word);
        if own.iter().any(of_own) {
            continue;
        }
        for (table, keys) in &tables {
            let Some(key) = keys.iter().find(|k| k.name == word || k.hints.contains(&word)).map(|k| k.name) else {
                continue;
            };
            let called = if key == word { String::new() } else { format!(" is called {key} here and") };
            return Err(entry.error(format!("{word}{called} goes under [{}.{table}]", at.path)));
        }
    }
    Ok(())
}

/// A cell: the name of a ready one, or one of your own.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum CellSpec {
    /// A named surface.
    Name(CellName),
    /// Your own function.
    Kind(CellKind),
}

name_of! {
    /// The name of a ready periodic surface.
    CellName, "cell", catalogue().iter().map(|n| n.name), elsewhere, []
}

/// Names of surfaces in the literature and in other programs, each with what it is called here.
const SYNONYMS: [(&str, &str); 19] = [
    ("schwarz_p", "primitive"),
    ("schwarz_primitive", "primitive"),
    ("p", "primitive"),
    ("schwarz_d", "diamond"),
    ("schwarz_diamond", "diamond"),
    ("d", "diamond"),
    ("f", "diamond"),
    ("schwarz", "primitive (P) or diamond (D)"),
    ("schoen_gyroid", "gyroid"),
    ("schoen_g", "gyroid"),
    ("g", "gyroid"),
    ("schoen_iwp", "iwp"),
    ("i_wp", "iwp"),
    ("schoen_frd", "frd"),
    ("f_rd", "frd"),
    ("fischer_koch", "fischer_koch_s"),
    ("fks", "fischer_koch_s"),
    ("splitp", "split_p"),
    ("neovius_c(p)", "neovius"),
];

/// Why a word is no surface, if it is another kind of cell or has another name here.
fn elsewhere(word: &str) -> Option<String> {
    let plain = word.to_lowercase().replace(['-', ' '], "_");
    if let Some((_, name)) = SYNONYMS.iter().find(|s| s.0 == plain) {
        return Some(format!("{word} is called {name} here"));
    }
    if ["strut", "struts", "truss", "beam", "beams"].contains(&plain.as_str()) {
        return Some(format!("{word}: beams are written as [beams.NAME], with a cell such as \"octet\""));
    }
    let cell = ::beams::graph::named(word);
    cell.map(|_| format!("{word} is a cell of beams, not a surface; write [beams.NAME] with cell = \"{word}\""))
}

/// A cell with settings.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Cell", noun = "cell")]
#[allow(missing_docs)] // The comment of each type says what it is.
pub enum CellKind {
    Series(SeriesSpec),
    File(FileCellSpec),
    Tet(TetCellSpec),
}

/// A Fourier series: the sum of its terms.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Series", noun = "a series")]
pub struct SeriesSpec {
    /// The terms, such as { hkl = [1, 0, 0] }.
    pub terms: Vec<TermSpec>,
    /// A space group: then each term stands for the sum of its wave over the group, divided by that sum's largest Fourier
    /// coefficient. By number (227), Hermann–Mauguin symbol ("Fd-3m"), either with a setting ("227:1"; origin choice 2 unless
    /// given), or Hall symbol.
    pub group: Option<GroupSpec>,
}

/// amplitude · cos 2π(h·u + phase), u in turns; or the sine. With a group: the same part of amplitude · e^{2πi phase} times
/// the sum of e^{2πi h·u} over the group.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Term", noun = "a term")]
pub struct TermSpec {
    /// Three whole numbers [h, k, l].
    #[kind(min = -1e6, max = 1e6)]
    pub hkl: [i32; 3],
    /// Amplitude.
    #[kind(default = 1.0)]
    pub amplitude: f64,
    /// Phase.
    #[kind(unit = "turns", default = 0.0)]
    pub phase: f64,
    /// The real part of e^{2πi(h·u + phase)} (a cosine) or its imaginary part (a sine).
    #[kind(default)]
    pub component: WaveComponent,
}

/// Which part of e^{2πi(h·u + phase)} a term is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Component", noun = "component")]
pub enum WaveComponent {
    /// The real part: a cosine.
    #[default]
    Re,
    /// The imaginary part: a sine.
    Im,
}

/// A space group's number or symbol.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupSpec(pub String);

impl Kind for GroupSpec {
    fn expected() -> String {
        "a space group such as 227, \"227:2\" or \"Fd-3m\"".into()
    }

    fn fits(node: &Node) -> u8 {
        String::fits(node).max(f64::fits(node))
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        if !at.is_number() {
            return Ok(GroupSpec(at.text(&Self::expected())?.to_string()));
        }
        match at.number()? {
            n if n.fract() == 0.0 && n.abs() < 1e6 => Ok(GroupSpec(format!("{n}"))),
            n => Err(at.error(format!("expected a space group, found {n}; they are numbered from 1 to 230"))),
        }
    }

    fn write(&self) -> Node {
        self.0.write()
    }

    fn check(&self, _: &Key) -> Result<(), Fault> {
        Ok(())
    }

    fn schema(_: &Key, _: &mut Defs) -> Node {
        Node::table([("type", vec![Node::from("string"), Node::from("integer")].into())])
    }
}

/// Numbers, pictures or a mesh in a file: the largest waves of their Fourier transform. Numbers stand at the nodes of one period,
/// without the repeated end; a mesh is the solid in one period.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "FileCell", noun = "a cell from a file")]
pub struct FileCellSpec {
    /// Path of the file, relative to the design file: npy, grey pictures (png, tif, DICOM) or a closed mesh (stl, 3mf, ply, obj, off).
    /// Pictures lie one above the other: one file, "scan/*.png" with a * for any text, or their folder, "scan/". Of a mesh the
    /// function is the signed distance, positive inside, in edges of the cell.
    pub path: String,
    /// Number of waves that are kept.
    #[kind(default = 200, min = 1.0, max = 2000.0)]
    pub terms: u32,
    /// Numbers above it are solid, and the signed distance of these is the cell's function, as for a mesh; without it the numbers
    /// are.
    pub threshold: Option<f64>,
    /// Distance between numbers, one or three, with a threshold: distances are measured with it.
    #[kind(unit = "mm", above = 0.0)]
    pub step: Option<OneOrThree>,
    /// Edges of a mesh's period, one or three, about the middle of its bounds; the bounds unless given. Faces on them where the
    /// solid goes on into the next cell are no boundary.
    #[kind(unit = "mm", above = 0.0)]
    pub period: Option<OneOrThree>,
}

/// A tetrahedral cell, for a map over a tetrahedral mesh: a ready one by its name, or what a regular tetrahedron cuts out of
/// the series of a group.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "TetCell", noun = "a tetrahedral cell", alternatives)]
pub enum TetCellSpec {
    /// A ready cell.
    Ready(ReadyTetCell),
    /// A ready cell for each zone of the mesh.
    Zones(ZonedTetCells),
    /// A series of your own.
    Series(TetSeriesSpec),
}

/// A ready cell.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct ReadyTetCell {
    /// A ready cell.
    pub name: TetCellName,
}

/// A ready cell for each zone of the mesh.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct ZonedTetCells {
    /// A ready cell for each zone of the mesh, by its number or its name in the file, such as `{ 1 = "diamond", shell = "iwp" }`;
    /// in the tetrahedra between zones they pass into each other.
    #[kind(least = 1, keyword)]
    pub zones: BTreeMap<String, TetCellName>,
}

/// What a regular tetrahedron cuts out of the series of a group.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct TetSeriesSpec {
    /// A space group with a point of full tetrahedral symmetry: 215, 216, 217, 221, 224, 225, 227 or 229, named as for a series.
    pub group: GroupSpec,
    /// The terms, each summed over the group.
    pub terms: Vec<TermSpec>,
    /// Edge of the tetrahedron, in edges of the cubic cell.
    pub edge: f64,
    /// The tetrahedron's barycentre: a point of full tetrahedral symmetry; the group's first unless given.
    #[kind(unit = "turns")]
    pub site: Option<[f64; 3]>,
    /// The dual tetrahedron, turned upside down.
    #[kind(default = false)]
    pub dual: bool,
}

name_of! {
    /// The name of a ready tetrahedral cell.
    TetCellName, "tetrahedral cell", tet_catalogue().iter().map(|n| n.name), no_sites, []
}

/// Why a periodic cell is no tetrahedral one, if its group is the reason.
fn no_sites(word: &str) -> Option<String> {
    let group = Group::named(named(word)?.number()).ok()?;
    let names = tet_catalogue().iter().map(|n| n.name).collect::<Vec<_>>().join(", ");
    Some(format!("{}; use one of {names}", group.tetrahedral_sites().err()?.message))
}

/// Which side of the level is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(name = "Part", noun = "part")]
pub enum PartSpec {
    /// |f| ≤ t.
    #[kind(hints("wall", "shell", "surface", "double", "sheet_network", "thickened"))]
    Sheet,
    /// f ≤ t.
    #[kind(hints("network", "solid_network", "skeletal", "skeleton", "strut", "below", "negative"))]
    Lower,
    /// f ≥ t.
    #[kind(hints("above", "positive", "over"))]
    Upper,
}

/// How much is solid: one amount, or a fraction and the thickness of its walls or the size of its pores, which together give the
/// wavelength.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Level", noun = "a level")]
pub struct LevelSpec {
    /// The amount.
    #[kind(flatten)]
    pub amount: AmountSpec,
    /// What a fraction or porosity is of.
    #[kind(default)]
    pub of: FractionOf,
    /// How a fraction or porosity becomes a level.
    #[kind(default)]
    pub fit: LevelFit,
    /// The sheet's mid-surface is f = mid: an off-centre sheet, |f − mid| ≤ t or the wall about it.
    #[kind(default = 0.0)]
    pub mid: f64,
}

/// An amount of solid.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "an amount", alternatives)]
pub enum AmountSpec {
    /// A wall's thickness.
    Thickness(ThicknessSpec),
    /// A pore size.
    Pore(PoreSpec),
    /// A solid volume fraction.
    Fraction(FractionSpec),
    /// A porosity.
    Porosity(PorositySpec),
    /// A field value.
    Iso(IsoSpec),
    /// A stiffness.
    Stiffness(StiffnessSpec),
    /// A permeability.
    Permeability(PermeabilitySpec),
}

/// The thickness of a sheet's wall.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct ThicknessSpec {
    /// Thickness of a sheet's wall: solid is what lies within half of it of the mid-surface. With a fraction or porosity: of a
    /// wall or of a network's narrowest neck, and the wavelength is solved for.
    #[kind(unit = "mm", above = 0.0, hints("wall_thickness", "wall", "sheet_thickness"))]
    pub thickness: GradeSpec,
}

/// A solid volume fraction.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct FractionSpec {
    /// Solid volume fraction.
    #[kind(
        above = 0.0,
        below = 1.0,
        hints("relative_density", "density", "volume_fraction", "solid_fraction", "infill", "vf")
    )]
    pub fraction: GradeSpec,
    /// Thickness of a sheet's wall or narrowest neck of a network: the wavelength is solved for.
    #[kind(unit = "mm", above = 0.0)]
    pub thickness: Option<GradeSpec>,
    /// Diameter of the largest ball that passes through the void: the wavelength is solved for.
    #[kind(unit = "mm", above = 0.0)]
    pub pore: Option<GradeSpec>,
}

/// A porosity.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct PorositySpec {
    /// One minus the solid volume fraction.
    #[kind(above = 0.0, below = 1.0, hints("void_fraction"))]
    pub porosity: GradeSpec,
    /// Thickness of a sheet's wall or narrowest neck of a network: the wavelength is solved for.
    #[kind(unit = "mm", above = 0.0)]
    pub thickness: Option<GradeSpec>,
    /// Diameter of the largest ball that passes through the void: the wavelength is solved for.
    #[kind(unit = "mm", above = 0.0)]
    pub pore: Option<GradeSpec>,
}

/// A pore size.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct PoreSpec {
    /// Diameter of the largest ball that passes through the void from cell to cell; of a sheet through both sides.
    #[kind(unit = "mm", above = 0.0, hints("pore_size", "pore_diameter", "window"))]
    pub pore: GradeSpec,
}

/// A field value.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct IsoSpec {
    /// The field value t; for a sheet the half-level.
    #[kind(hints("isovalue", "iso_value", "isolevel", "threshold", "level_set"))]
    pub iso: GradeSpec,
}

/// A stiffness of the cell.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct StiffnessSpec {
    /// Young's modulus of the periodic cell over that of the solid: the fraction is solved for.
    #[kind(above = 0.0, below = 1.0, hints("modulus", "relative_modulus", "young", "E"))]
    pub stiffness: GradeSpec,
    /// The direction of the modulus, in the axes of the cell.
    #[kind(default = [1.0, 0.0, 0.0])]
    pub along: Vec3,
    /// Poisson's ratio of the solid.
    #[kind(above = -1.0, below = 0.5, default = 0.3)]
    pub nu: f64,
    /// Voxels along the cell on which it is found.
    #[kind(min = 8.0, max = 256.0, default = 48)]
    pub n: u32,
}

/// A permeability of the cell.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct PermeabilitySpec {
    /// Permeability of the pore, of both sides of a sheet together: the fraction is solved for.
    #[kind(unit = "mm²", above = 0.0)]
    pub permeability: GradeSpec,
    /// The direction of the flow, in the axes of the cell.
    #[kind(default = [1.0, 0.0, 0.0])]
    pub along: Vec3,
    /// Nodes along the cell on which it is found.
    #[kind(min = 8.0, max = 256.0, default = 32)]
    pub n: u32,
}

/// What a fraction is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Of", noun = "word")]
pub enum FractionOf {
    /// Of the periodic cell.
    #[default]
    Cell,
    /// Of the finished part, cut cells included (solved for).
    Part,
}

/// How a fraction becomes a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Fit", noun = "fit")]
pub enum LevelFit {
    /// By the cell's own exact distribution.
    #[default]
    Table,
    /// By the SPARTAN polynomial (diamond as published; gyroid fitted in the same form). Part `lower` only.
    Spartan,
}

/// Regions that are kept fully solid, by name.
#[derive(Clone, Debug, Default, PartialEq, Kind)]
#[kind(name = "Keeps", before = named_first)]
pub struct KeepZones(pub BTreeMap<String, RegionKind>);

/// Explains that a name comes before the kind of a region.
fn named_first(at: &NodeCursor) -> Result<(), DesignError> {
    for (name, at) in at.entries("regions by name, such as [keep.boss.cylinder]")? {
        if RegionKind::keys().iter().any(|k| k.name == name) && RegionKind::read(&at).is_err() {
            let message = format!("a name comes first, such as [keep.boss.{name}]: {name} is a kind of region");
            return Err(at.error(message));
        }
    }
    Ok(())
}

/// Named lattices.
pub type Lattices = BTreeMap<String, LatticeSpec>;

/// Explains that the format has another version.
pub(super) fn version(at: &NodeCursor) -> Result<(), DesignError> {
    let entries = at.entries("a design")?;
    match entries.iter().find(|e| e.0 == "schema") {
        Some((_, at)) if at.number()? != 1.0 => {
            Err(at.error(format!("this version reads schema 1, found {}", geometry::fault::number(at.number()?))))
        }
        _ => Ok(()),
    }
}
