//! The design: its data, and how a solid is built from it.
//!
//! Text (TOML or JSON) becomes a tree, the tree becomes data, and the data is built into a [`Solid`]. Whatever is
//! wrong is one [`DesignError`] with the path, the line and the nearest right word.

mod beam_files;
mod beams_in_region;
mod build;
mod build_beams;
mod build_blend;
mod build_carrier;
mod build_cell;
mod build_core;
mod build_level;
mod build_pattern;
mod build_property;
mod build_skin;
mod build_step;
mod build_tets;
mod build_tiling;
mod built_report;
mod cell_zones;
mod coarse_steps;
mod compensated_grid;
mod data;
mod default_spacing;
mod design_schema;
mod finish_tiling;
mod joins;
mod net_coverage;
mod sample;
mod sets_kind;
mod skin_kind;
mod study_kind;
mod surface_net;
#[cfg(test)]
mod tests;
mod tiled_cell;
mod unit_cell;
mod varied;
mod volume_error;
mod warn;

use std::borrow::Cow;
use std::cell::RefCell;
use std::io;
use std::sync::{Arc, OnceLock};

use serde_json::Value as Json;

use crate::beam_mesh;
use crate::beam_surface::BeamSurface;
use crate::cell::Cell;
use crate::effective::UnitCell;
use crate::environment;
use crate::extract::GridSurface;
use crate::implicit::Implicit;
use crate::kind::{Kind, NodeCursor};
use crate::lattice::Lattice;
use crate::region::Region;
use crate::report::{DesignReport, NetReport, PropertyReport, StepReport, TetMeshReport, TransitionReport};
use crate::shell_mesh;
use crate::solid::Solid;
use crate::surface_maker::SurfaceMaker;
use crate::tiling::{Tiling, TilingSurface};
use crate::truss::Beams;
use crate::volume_mesh;
use geometry::fault::Fault;
use geometry::fe_mesh::HexMesh;
use geometry::formats::part21::Title;
use geometry::progress::{Progress, Stopped};
use geometry::repair::Repaired;

pub use crate::environment::{Loader, NoFiles, Scan, ZoneNames, ZonedElements};
pub use crate::kind::{DesignError, LineNumbers, Node, OneOrThree, OneOrTwo, Unit, Value, Warning};
pub use crate::region::{CadMesh, FaceLabel, Tessellation};
pub use build_blend::Blended;
pub use build_tets::BuiltTets;
pub use cell_zones::CellZone;
use compensated_grid::CompensatedGrid;
pub use data::*;
pub use default_spacing::Coarser;
pub use design_schema::schema;
pub use joins::Joins;
pub use sets_kind::*;
pub use skin_kind::*;
pub use study_kind::*;

/// A lattice part, as data.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a design", before = data::version)]
pub struct Design {
    /// Version of this format; write schema = 1.
    #[kind(min = 1.0, max = 1.0)]
    pub schema: u32,
    /// Unit of length; a mesh file may have its own.
    #[kind(default, always)]
    pub units: Units,
    /// Where the part may be, such as [region.box] with size = [20, 20, 20].
    #[kind(hints("part", "domain", "body", "design_space"))]
    pub region: RegionKind,
    /// What fills the region: lattices under names of your own. Several need a blend.
    #[kind(default, hints("tpms", "infill", "fill"))]
    pub lattice: Lattices,
    /// Graphs of beams, under names of your own: instead of a lattice, or blended with others.
    #[kind(default, hints("strut", "struts", "truss"))]
    pub beams: BeamsSpecs,
    /// Which lattice is where, if there are several.
    pub blend: Option<BlendSpec>,
    /// What closes the region's surface.
    #[kind(hints("shell", "wall", "hull"))]
    pub skin: Option<SkinSpec>,
    /// Regions kept fully solid within the region, such as bolt bosses, under names of your own.
    #[kind(default)]
    pub keep: KeepZones,
    /// Regions whose surface is a set of volume meshes, to hold or to load, under names of your own.
    #[kind(default, hints("sets", "nset", "group"))]
    pub set: SetSpecs,
    /// What varies where many designs are made of this one; of no effect on this one.
    #[kind(hints("study", "parameters", "vary"))]
    pub sweep: Option<StudySweep>,
    /// Line of each key in the file it was read from.
    #[kind(skip)]
    pub lines: LineNumbers,
}

/// The unit of length of a design.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "unit of length of a design", before = in_mm)]
pub enum Units {
    /// Millimetre.
    #[default]
    Mm,
}

fn in_mm(at: &NodeCursor) -> Result<(), DesignError> {
    match &at.node.value {
        Value::Text(word) if word != "mm" => {
            Err(at.error(format!("lengths in a design are mm, found \"{word}\"; a mesh file may have its own unit")))
        }
        _ => Ok(()),
    }
}

/// A lattice over a tetrahedral mesh.
pub struct Tiled {
    /// Its name.
    pub name: String,
    /// The lattice, as its surface is made tetrahedron by tetrahedron.
    pub tiling: Arc<Tiling>,
    /// The lattice by position, at the level at which it has the same fraction.
    placed: Arc<Tiling>,
    /// The zones, where they have cells of their own.
    pub zones: Vec<CellZone>,
    /// What is known of the mesh.
    pub mesh: TetMeshReport,
    /// Whether nothing else is in the part: no skin, no kept zone.
    pub alone: bool,
    /// Whether its surface is made without a grid.
    pub explicit: bool,
    /// Why it is made on a grid, where it is.
    pub on_grid: Option<String>,
    /// The solid fraction that the surface of the part is to have on a grid, where that is known, and how far it may be off.
    aim: Option<[f64; 2]>,
    /// How it ends at the part's surface.
    pub ends: SurfaceEnds,
    /// The least and the greatest radius of the net's rods, or of rounded ends, mm.
    pub radii: Option<[f64; 2]>,
    /// What the net covers.
    pub coverage: Option<NetReport>,
    /// The solid fraction of the finished part, where the level was solved for it.
    pub finished: Option<f64>,
    /// The lattice as it ends.
    field: Arc<dyn Implicit>,
    /// Which zones join, where zones have cells of their own and it can be predicted.
    pub joins: Option<Joins>,
}

impl Tiled {
    /// The field of a design that is this lattice alone, to be meshed with other surfaces.
    fn alone_field(&self) -> Arc<dyn Implicit> {
        match self.ends {
            SurfaceEnds::Rounded => self.field.clone(),
            _ => Arc::new(self.placed.with_limited_gradient()),
        }
    }
}

/// A built design.
pub struct Built {
    /// The solid.
    pub solid: Solid,
    /// Names of what is solid whatever the lattice says: `SKIN`, `KEEP_` and the name of a keep zone, `NET`.
    pub bodies: Vec<String>,
    /// The regions whose surface is a set of volume meshes, by name.
    pub sets: Vec<(String, Region)>,
    /// The lattices in it, by name.
    pub lattices: Vec<(String, Arc<Lattice>)>,
    /// The properties that levels were solved for, by the names of their lattices.
    pub properties: Vec<(String, PropertyReport)>,
    /// The lattices over tetrahedral meshes, by name.
    pub tilings: Vec<Tiled>,
    /// The beams in it, by name.
    pub beams: Vec<(String, Beams)>,
    /// The blend of them, if there are several.
    pub blend: Option<Blended>,
    /// The least thickness of the skin (mm), if there is one.
    pub skin: Option<f64>,
    /// What may not be meant.
    pub warnings: Vec<Warning>,
    /// What was repaired in each mesh of the region, by the path of its table; clean meshes too.
    pub repairs: Vec<(String, Repaired)>,
    /// Computed at first use.
    figures: OnceLock<DesignReport>,
    /// By how much levels are moved on grids.
    moves: compensated_grid::Moves,
}

impl Design {
    /// Reads a design from TOML.
    ///
    /// ```
    /// # use trabecula::design::Design;
    /// let e = Design::from_toml("schema = 1\n[regoin.box]\nsize = [8, 8, 8]").unwrap_err();
    /// assert_eq!((e.line, e.path.as_str(), e.nearest.as_deref()), (Some(2), "regoin", Some("region")));
    /// ```
    pub fn from_toml(text: &str) -> Result<Design, DesignError> {
        Design::from_node(&Node::from_toml(text)?)
    }

    /// Reads a design from JSON.
    pub fn from_json(text: &str) -> Result<Design, DesignError> {
        Design::from_node(&Node::from_json(text)?)
    }

    /// Reads a design from a tree.
    pub fn from_node(node: &Node) -> Result<Design, DesignError> {
        let lines = node.lines();
        let design = Design { lines, ..Design::read(&NodeCursor::root(node))? };
        design.check_names().map_err(|e| design.located(e))?;
        if let Some(sweep) = &design.sweep {
            Design::check_sweep(sweep, node).map_err(|e| design.located(e))?;
        }
        Ok(design)
    }

    /// The design with other values at paths, such as `lattice.core.level.fraction`, and without a sweep.
    ///
    /// # Errors
    /// Paths that lead nowhere, and whatever is wrong with the design that results.
    pub fn varied(&self, values: &[(String, Node)]) -> Result<Design, DesignError> {
        let mut node = Design { sweep: None, ..self.clone() }.write();
        for (path, value) in values {
            node.put(path, value.clone()).map_err(|f| DesignError::fault(path, f))?;
        }
        Design::from_node(&node)
    }

    /// Refuses a sweep over what is no key of the design, or with values that it cannot have.
    fn check_sweep(sweep: &StudySweep, node: &Node) -> Result<(), DesignError> {
        sweep.valid().map_err(|f| DesignError::fault("sweep", f))?;
        let mut base = node.clone();
        if let Value::Table(entries) = &mut base.value {
            entries.retain(|e| e.0 != "sweep");
        }
        for (path, values) in sweep.samples() {
            for value in values {
                let mut varied = base.clone();
                let at = format!("sweep.{path}");
                varied.put(path, value).map_err(|f| DesignError::fault(&at, f))?;
                Design::read(&NodeCursor::root(&varied)).map_err(|e| {
                    let message = if e.path == path { e.message } else { format!("{}: {}", e.path, e.message) };
                    DesignError { found: e.found, nearest: e.nearest, ..DesignError::new(&at, message) }
                })?;
            }
        }
        Ok(())
    }

    /// The error with its line, if its path is in the file.
    fn located(&self, mut e: DesignError) -> DesignError {
        e.line = e.line.or_else(|| self.lines.line(&e.path));
        e
    }

    /// Refuses names that are missing, given twice, or of no lattice.
    fn check_names(&self) -> Result<(), DesignError> {
        let missing = "say what fills the region, such as [lattice.core] with cell = \"gyroid\", or [beams.core] with cell = \"octet\"";
        if self.lattice.is_empty() && self.beams.0.is_empty() {
            return Err(DesignError::new("lattice", missing));
        }
        if let Some(name) = self.beams.0.keys().find(|name| self.lattice.contains_key(*name)) {
            let message = format!("\"{name}\" names a lattice already; give the beams another name");
            return Err(DesignError::new("beams", message));
        }
        let tables = self.lattice.keys().map(|n| ("lattice", n)).chain(self.beams.0.keys().map(|n| ("beams", n)));
        let mut tables: Vec<(&str, &String)> = tables.collect();
        tables.sort_by_key(|(table, name)| self.lines.line(&format!("{table}.{name}")));
        let names: Vec<&str> = tables.iter().map(|t| t.1.as_str()).collect();
        let Some(blend) = &self.blend else {
            let [(_, a), (table, b), ..] = &tables[..] else { return Ok(()) };
            let message = format!(
                "several lattices ({a}, {b}) need a blend to say where each is, such as [blend] with between = [\"{a}\", \"{b}\"] \
                 and a weight"
            );
            return Err(DesignError::new(format!("{table}.{b}"), message));
        };
        match blend.named().into_iter().find(|(_, name)| !names.contains(name)) {
            Some((path, name)) => Err(DesignError::unknown(&path, "lattice", name, &names)),
            None => Ok(()),
        }
    }

    /// The design as TOML.
    pub fn to_toml(&self) -> Result<String, DesignError> {
        toml::to_string(&self.write()).map_err(|e| DesignError::new("", format!("cannot be written as TOML: {e}")))
    }

    /// The design as JSON.
    pub fn to_json(&self) -> Json {
        serde_json::to_value(self.write()).unwrap_or(Json::Null)
    }

    /// Builds the solid. Numbers are checked here: finite, in range, possible in the region.
    pub fn build(&self, loader: &dyn Loader) -> Result<Built, DesignError> {
        build::design(self, loader).map_err(|e| self.located(e))
    }
}

/// A file of a region alone.
#[derive(Kind)]
#[kind(noun = "a region file", before = data::version)]
struct RegionFile {
    /// Version of this format.
    #[kind(rename = "schema")]
    _schema: Option<u32>,
    /// Unit of length.
    #[kind(rename = "units", default)]
    _units: Units,
    /// Where the part may be, such as [region.box] with size = [20, 20, 20].
    #[kind(hints("part", "domain", "body", "design_space"))]
    region: RegionKind,
}

/// The region of a design, or of a tree with the key `region` alone. The region of a lattice over tetrahedra is what these fill.
pub fn region(node: &Node, loader: &dyn Loader) -> Result<Region, DesignError> {
    let lines = node.lines();
    let entries = NodeCursor::root(node).entries("a design or a region")?;
    let found = if entries.iter().any(|(key, _)| ["lattice", "beams"].contains(key)) {
        build::region_of(&Design::from_node(node)?, loader)
    } else {
        let alone = RegionFile::read(&NodeCursor::root(node))?;
        environment::region(&alone.region, "region", loader, None, &RefCell::default())
    };
    found.map_err(|mut e| {
        e.line = e.line.or_else(|| lines.line(&e.path));
        e
    })
}

/// The cell that a tree describes, as under the key `cell` of a lattice.
pub fn cell(node: &Node) -> Result<Arc<Cell>, DesignError> {
    let spec = CellSpec::read(&NodeCursor::alone(node, "cell"))?;
    spec.valid().map_err(|f| DesignError::fault("cell", f))?;
    Ok(build_cell::cell(&spec, "cell", &NoFiles)?.1)
}

/// C11, C12 and C44 of a domain of the carrier; Young's modulus and Poisson's ratio of their mean over all directions.
pub type CarrierMaterial = ([f64; 3], [f64; 2]);

impl Built {
    /// The figures of the design, without meshing it.
    pub fn report(&self) -> DesignReport {
        // Nobody waits for another's: it is made in parallel.
        let figures = self.figures.get().cloned().unwrap_or_else(|| built_report::report(self));
        self.figures.set(figures.clone()).ok();
        figures
    }

    /// The surface maker whose resolution is a grid spacing: cutting of tetrahedra for an explicit tiling, marching cubes for
    /// all else.
    pub fn surface(&self) -> Box<dyn SurfaceMaker + '_> {
        match &self.tilings[..] {
            [only] if only.explicit && self.blend.is_none() => Box::new(TilingSurface(&only.tiling)),
            _ if compensated_grid::aimed(self).is_some() => Box::new(CompensatedGrid(self)),
            _ => Box::new(GridSurface(&self.solid)),
        }
    }

    /// By how much the level of a lattice over tetrahedra is moved where its surface is made on a grid in steps of `edge` (mm).
    ///
    /// # Errors
    /// A spacing at which there is no grid; an interruption.
    pub fn grid_move(&self, edge: f64, progress: &dyn Progress) -> Result<f64, Stopped> {
        compensated_grid::move_at(self, edge, progress)
    }

    /// The solid whose surface on a grid is that of `surface`, where the level is moved by this.
    pub fn grid_solid(&self, moved: f64) -> Cow<'_, Solid> {
        compensated_grid::moved(self, moved)
    }

    /// Whether `surface` meshes it on a grid, so that it can be made range by range of the grid's tiles.
    ///
    /// # Errors
    /// A lattice over tetrahedra that is the only one, whose tetrahedra are cut instead.
    pub fn on_grid(&self) -> Result<(), Fault> {
        match &self.tilings[..] {
            [only] if only.explicit && self.blend.is_none() => Err(Fault::new(
                "",
                "a lattice over tetrahedra is meshed tetrahedron by tetrahedron, not on a grid whose tiles can be made apart; leave \
                 --resume and --cluster out",
            )),
            _ => Ok(()),
        }
    }

    /// The surface maker whose resolution is a chord error, for designs of uncut beams alone.
    ///
    /// # Errors
    /// What else the design contains: lattices, a blend, a skin or kept zones, a region that cuts the beams.
    pub fn beam_surface(&self) -> Result<BeamSurface, Fault> {
        Ok(BeamSurface(build_beams::alone(self)?))
    }

    /// Writes a STEP file (mm): of beams alone their exact surface, of lattices in a box bicubic
    /// patches no farther than `tolerance` (mm; a thousandth of the smallest wavelength unless given) from it. `assembly`: whether
    /// beams are written hub by hub, as `beams::write_step` says.
    ///
    /// # Errors
    /// What else the design contains; beams without a boundary in closed form, and as `Patches::new`; a tolerance for beams;
    /// failures of the output; an interruption.
    pub fn write_step(
        &self,
        title: Title,
        tolerance: Option<f64>,
        assembly: Option<bool>,
        out: &mut dyn io::Write,
        progress: &dyn Progress,
    ) -> Result<StepReport, Stopped> {
        build_step::write(self, title, tolerance, assembly, out, progress)
    }

    /// The chord error (mm) at which `beam_surface` makes a surface unless another resolution is asked for: a fiftieth of the radius
    /// of the thinnest beam. `None` for what is made on a grid.
    pub fn default_chord(&self) -> Option<f64> {
        build_beams::default_chord(self)
    }

    /// Whether the beams of a name are all that the design is: no region cuts them, nothing is added. Of a large pattern, by a box
    /// that holds it.
    pub fn whole_beams(&self, name: &str) -> bool {
        let found = self.beams.iter().find(|b| b.0 == name);
        found.is_some_and(|(_, made)| beams_in_region::lone(self) && beams_in_region::held(made, self))
    }

    /// Whether files of its mesh are to have no caps on the region's boundary.
    pub fn is_open(&self) -> bool {
        self.tilings.iter().any(|t| t.ends == SurfaceEnds::Open)
    }

    /// Its volume mesh, with named sets.
    ///
    /// # Errors
    /// As `volume_mesh::volume_mesh`.
    pub fn volume_mesh(
        &self,
        options: &volume_mesh::VolumeMeshOptions,
        progress: &dyn Progress,
    ) -> Result<volume_mesh::MeshedVolume, Stopped> {
        let named = volume_mesh::SolidNames { bodies: &self.bodies, sets: &self.sets };
        volume_mesh::volume_mesh(&self.solid, &named, options, progress)
    }

    /// The carrier of its lattice over tetrahedra, with the design's own sets; `order` is 1 or 2.
    ///
    /// # Errors
    /// A design without one such lattice; an empty set.
    pub fn carrier(&self, order: u8) -> Result<volume_mesh::MeshedVolume, Fault> {
        build_carrier::carrier(self, order).map(|made| made.0)
    }

    /// The material of each domain of the carrier, where the solid has Poisson's ratio `nu` and cells are solved for on `n` voxels along an edge:
    /// C11, C12 and C44 along the axes of its elements, and Young's modulus and Poisson's ratio of their mean over all directions; moduli
    /// over Young's modulus of the solid.
    ///
    /// # Errors
    /// As `carrier`; a cell that carries no load at the fraction of a domain; a solid that is none; an interruption.
    pub fn carrier_materials(
        &self,
        nu: f64,
        n: usize,
        progress: &dyn Progress,
    ) -> Result<Vec<CarrierMaterial>, Stopped> {
        build_carrier::materials(self, (nu, n), progress)
    }

    /// The shells of its mid-surface, with the design's own sets.
    ///
    /// # Errors
    /// As `shell_mesh::shell_mesh`.
    pub fn shell_mesh(
        &self,
        options: &shell_mesh::ShellMeshOptions,
        progress: &dyn Progress,
    ) -> Result<shell_mesh::MeshedShell, Stopped> {
        shell_mesh::shell_mesh(&self.solid, &self.sets, options, progress)
    }

    /// Its beams as finite elements, with the design's own sets.
    ///
    /// # Errors
    /// What else the design has; as `beam_mesh::beam_mesh`.
    pub fn beam_mesh(&self, options: &beam_mesh::BeamMeshOptions) -> Result<beam_mesh::MeshedBeams, Fault> {
        let quadors = beam_files::written(self)?.quadors;
        beam_mesh::beam_mesh(&quadors, &self.solid.region, &self.sets, options)
    }

    /// Its voxels as finite elements: edge of a voxel (mm), and the least solid fraction of one; with sets of the grid's sides and of the
    /// design.
    ///
    /// # Errors
    /// As `voxel_fractions::voxel_elements`.
    pub fn voxel_elements(&self, size: (f64, f64), progress: &dyn Progress) -> Result<HexMesh, Stopped> {
        crate::voxel_fractions::voxel_elements(&self.solid, &self.sets, size, progress)
    }

    /// The periodic cell of which the design's lattice or beams are made. The region, skin and kept zones are no part of it.
    ///
    /// # Errors
    /// A design that has no such cell: several lattices, a map that is not affine, an amount that varies; at the key that is in the way.
    pub fn unit_cell(&self, design: &Design, loader: &dyn Loader) -> Result<UnitCell, DesignError> {
        unit_cell::of(self, design, loader).map_err(|e| design.located(e))
    }

    /// The transitions between the lattices of a blend; empty without one.
    pub fn transitions(&self) -> Vec<TransitionReport> {
        built_report::transitions(self)
    }

    /// The relative error to expect of the volume of lattices and beams in a mesh at grid spacing `edge` (mm); `None` where it is not
    /// known.
    pub fn volume_error(&self, edge: f64) -> Option<f64> {
        volume_error::volume_error(self, edge)
    }

    /// The solid share of the region, by sampling at some ten thousand points, and the region's volume (mm³), exact where
    /// that is known: what an extraction is held against.
    pub fn expected(&self) -> (f64, f64) {
        built_report::expected(self)
    }
}
