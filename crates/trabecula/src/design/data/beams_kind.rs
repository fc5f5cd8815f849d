//! Beams, as data.

use std::collections::BTreeMap;

use super::{GradeSpec, MapKind};
use crate::kind::{Defs, DesignError, Fault, Key, Kind, Node, NodeCursor, Table, Unit};
use ::beams::quador::Fillet;

/// Graphs of beams, by name.
#[derive(Clone, Debug, Default, PartialEq, Kind)]
#[kind(before = named_first)]
pub struct BeamsSpecs(pub BTreeMap<String, BeamsSpec>);

/// Explains that a name comes before the keys of beams.
fn named_first(at: &NodeCursor) -> Result<(), DesignError> {
    let keys = BeamsSpec::keys();
    // Beams may be called as one of their keys is: then they say what they are made of.
    let named = |at: &NodeCursor| {
        let graphs = ["cell", "nodes", "struts", "path", "pattern"];
        at.entries("beams").is_ok_and(|all| all.iter().any(|e| graphs.contains(&e.0)))
    };
    let entries = at.entries("beams by name, such as [beams.core]")?;
    match entries.iter().find(|e| keys.iter().any(|k| k.name == e.0) && !named(&e.1)) {
        Some((key, at)) => Err(at.error(format!("a name comes first, such as [beams.core] with {key}"))),
        None => Ok(()),
    }
}

/// A graph of beams, filling the region.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Beams", noun = "beams", check = BeamsSpec::consistent)]
pub struct BeamsSpec {
    /// The graph.
    #[kind(flatten)]
    pub graph: GraphSpec,
    /// Radius of a beam at mid length, taken there. It may be left out where all hubs have radii.
    #[kind(unit = "mm", above = 0.0)]
    pub radius: Option<GradeSpec>,
    /// Solid fraction of the cell, or of the region for nodes and struts; the radius of all beams is solved for.
    #[kind(above = 0.0, below = 1.0)]
    pub fraction: Option<f64>,
    /// Radius of the balls in which beams meet, taken at their centres; the largest radius of the beams that meet there unless
    /// given.
    #[kind(unit = "mm", above = 0.0)]
    pub hub: Option<GradeSpec>,
    /// Which of the quadrics of revolution tangent to both balls a beam is; the one with the radius at mid length unless
    /// given.
    pub profile: Option<ProfileSpec>,
    /// Rounding of beams into one another.
    #[kind(default)]
    pub fillet: FilletSpec,
}

impl BeamsSpec {
    fn consistent(&self, _: &Key) -> Result<(), Fault> {
        if self.fraction.is_some() {
            return self.solvable();
        }
        if let (GraphSpec::Cell(_), None, None) = (&self.graph, &self.radius, &self.hub) {
            return Err(Fault::new("", "\"radius\" is missing: of a beam at mid length, mm (or give fraction)"));
        }
        let GraphSpec::Pattern(_) = &self.graph else { return Ok(()) };
        for (key, given) in [("radius", &self.radius), ("hub", &self.hub)] {
            if let Some(GradeSpec::Kind(_)) = given {
                return Err(Fault::new(
                    key,
                    "in a pattern it is one number, at the first repeat; it scales with the repeats",
                ));
            }
        }
        Ok(())
    }
}

impl BeamsSpec {
    /// Refuses what leaves no radius to be solved for from a fraction.
    fn solvable(&self) -> Result<(), Fault> {
        if self.radius.is_some() {
            return Err(Fault::new("fraction", "the radius follows from it; give radius or fraction, not both"));
        }
        if self.hub.is_some() {
            return Err(Fault::new(
                "hub",
                "with fraction hubs have the radius of their beams; leave hub out, or give radius",
            ));
        }
        if let Some(ProfileSpec::Waist(_)) = self.profile {
            return Err(Fault::new("profile", "with fraction it is cone, cylinder or lambda; or give radius"));
        }
        match self.graph {
            GraphSpec::Pattern(_) => Err(Fault::new("fraction", "a pattern has none; give radius instead")),
            _ => Ok(()),
        }
    }
}

/// Where the beams of a graph come from.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a graph", alternatives)]
pub enum GraphSpec {
    /// A unit cell on a map.
    Cell(CellGraph),
    /// Nodes and struts.
    Nodes(NodeGraph),
    /// A file of another program.
    File(FileGraph),
    /// A program of repeats.
    Pattern(PatternGraph),
}

impl GraphSpec {
    /// Trimming, of a graph that is written out.
    pub fn trimming(&self) -> Trimming {
        match self {
            GraphSpec::Cell(c) => c.trimming,
            GraphSpec::Nodes(n) => n.trimming,
            GraphSpec::File(f) => f.trimming,
            GraphSpec::Pattern(_) => Trimming::default(),
        }
    }
}

/// A unit cell on a map.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct CellGraph {
    /// A ready unit cell, such as "octet".
    pub cell: BeamCellName,
    /// Position of the cells: nodes are mapped, beams stay straight.
    pub map: MapKind,
    /// Trimming to the region.
    #[kind(flatten)]
    pub trimming: Trimming,
}

/// Nodes and struts.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct NodeGraph {
    /// The nodes: rows of x, y, z (mm), or the path of a table (csv) of id, x, y, z.
    pub nodes: NodesSpec,
    /// The nodes that each beam joins: pairs of ids, or the path of a table (csv) of these.
    pub struts: StrutsSpec,
    /// Trimming to the region.
    #[kind(flatten)]
    pub trimming: Trimming,
}

/// A file of another program.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct FileGraph {
    /// Path of a file of beams (3mf, ltcx, csv, json, obj, vtu, vtk, inp, bdf, nas, txt), relative to the design file. Its radii hold
    /// unless radius, hub or fraction are given.
    pub path: String,
    /// Unit of the file's lengths (mm unless given); 3MF and LTCX files name their own.
    pub unit: Option<Unit>,
    /// Factor on all lengths, after the unit.
    #[kind(above = 0.0, default = 1.0)]
    pub scale: f64,
    /// Trimming to the region.
    #[kind(flatten)]
    pub trimming: Trimming,
}

/// A program of repeats.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct PatternGraph {
    /// A program of repeats, which the region cuts.
    pub pattern: PatternSpec,
}

/// What is done to beams at the region's surface and to nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Kind)]
pub struct Trimming {
    /// What becomes of beams that leave the region.
    #[kind(default)]
    pub trim: TrimSpec,
    /// What becomes of beams with a free end inside the region.
    #[kind(default)]
    pub dangling: DanglingSpec,
    /// Distance within which nodes are merged; a millionth of the mean beam's length unless given.
    #[kind(unit = "mm", min = 0.0)]
    pub merge: Option<f64>,
}

/// Nodes in a file or in the design.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged, noun = "the path of a table, or rows of x, y, z in mm")]
pub enum NodesSpec {
    /// Path of a table (csv) of id, x, y, z (mm) and perhaps a hub's radius (mm), relative to the design file.
    Path(String),
    /// Rows of x, y, z (mm) and perhaps a hub's radius (mm); their ids are 0, 1, 2 …
    Rows(NodeRows),
}

/// Nodes: rows of x, y, z (mm) and perhaps a hub's radius (mm); their ids are 0, 1, 2 …
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Rows")]
pub struct NodeRows(#[kind(least = 1)] pub Vec<RowSpec>);

/// A node: x, y, z (mm) and perhaps a radius (mm).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(untagged, noun = "x, y, z and perhaps a radius, mm", check = RowSpec::positive)]
pub enum RowSpec {
    /// x, y, z.
    Place([f64; 3]),
    /// x, y, z, radius.
    Ball([f64; 4]),
}

impl RowSpec {
    fn positive(&self, _: &Key) -> Result<(), Fault> {
        match self {
            RowSpec::Ball([.., r]) => Key { name: "radius", unit: "mm", above: 0.0, ..Key::NONE }.admit(*r),
            RowSpec::Place(_) => Ok(()),
        }
    }
}

/// Struts in a file or in the design.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged, noun = "the path of a table, or pairs of ids of nodes")]
pub enum StrutsSpec {
    /// Path of a table (csv) of pairs of node ids, relative to the design file.
    Path(String),
    /// Pairs of node ids, whole numbers from 0.
    Rows(Pairs),
}

/// Struts: pairs of node ids, whole numbers from 0.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct Pairs(#[kind(least = 1)] pub Vec<[NodeId; 2]>);

/// The id of a node: those that there are, and so the ids allowed, are known where the nodes are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeId(pub i32);

impl Kind for NodeId {
    fn expected() -> String {
        i32::expected()
    }

    fn fits(node: &Node) -> u8 {
        i32::fits(node)
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        i32::read(at).map(NodeId)
    }

    fn write(&self) -> Node {
        self.0.write()
    }

    fn check(&self, _: &Key) -> Result<(), Fault> {
        Ok(())
    }

    fn schema(key: &Key, defs: &mut Defs) -> Node {
        u32::schema(key, defs)
    }
}

/// A graph that is repeated by up to three steps: what is at [i, j, k] is the first step done i times, then the second j
/// times, then the third k times. It is not written out, however often it is repeated.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Pattern", noun = "a pattern", check = PatternSpec::stepped)]
pub struct PatternSpec {
    /// Rows of x, y, z (mm) and perhaps a hub's radius (mm), at [0, 0, 0]; their ids are 0, 1, 2 …
    pub nodes: NodeRows,
    /// Rows of two ids and, for each step, the number of repeats from the first node to the second (0 unless given).
    #[kind(least = 1)]
    pub struts: Vec<PatternStrut>,
    /// One to three steps, such as { count = 12, rotate = [0, 0, 30] }.
    #[kind(least = 1)]
    pub repeat: Vec<RepeatSpec>,
}

impl PatternSpec {
    fn stepped(&self, _: &Key) -> Result<(), Fault> {
        match self.repeat.len() {
            1..=3 => Ok(()),
            n => Err(Fault::new("repeat", format!("expected one to three steps, found {n}"))),
        }
    }
}

/// A strut of a pattern: two ids and up to three repeats between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatternStrut(pub [i32; 5]);

impl Kind for PatternStrut {
    fn expected() -> String {
        "two ids and up to three repeats, such as [0, 0, 1, 0, 0]".into()
    }

    fn fits(node: &Node) -> u8 {
        Vec::<i32>::fits(node)
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        let items = at.list(&Self::expected())?;
        if !(2..=5).contains(&items.len()) {
            let found = geometry::fault::counted(items.len(), "value");
            return Err(at.error(format!("expected {}, found {found}", Self::expected())));
        }
        let mut row = [0; 5];
        for (i, (r, item)) in row.iter_mut().zip(&items).enumerate() {
            *r = i32::read(item)?;
            if i < 2 && *r < 0 {
                return Err(item.error(format!("ids of nodes are whole numbers from 0, found {r}")));
            }
        }
        Ok(PatternStrut(row))
    }

    fn write(&self) -> Node {
        self.0.write()
    }

    fn check(&self, _: &Key) -> Result<(), Fault> {
        let most = Key { name: "id or repeat", min: -1e6, max: 1e6, ..Key::NONE };
        self.0.check(&most)
    }

    fn schema(_: &Key, defs: &mut Defs) -> Node {
        let count = |n| crate::kind::Value::Whole(n).into();
        let list = Vec::<i32>::schema(&Key::NONE, defs);
        list.with("minItems", count(2)).with("maxItems", count(5))
    }
}

/// A step of a pattern: scaled and turned about a point, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Repeat", noun = "a step")]
pub struct RepeatSpec {
    /// Number of repeats, the original counted.
    #[kind(min = 1.0, max = 1e6)]
    pub count: u32,
    /// Displacement of each from the last.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub by: [f64; 3],
    /// Angles about x, y, z: z is turned first, then y, then x.
    #[kind(unit = "degrees", default = [0.0; 3])]
    pub rotate: [f64; 3],
    /// Size of each in sizes of the last.
    #[kind(min = 0.1, max = 10.0, default = 1.0)]
    pub scale: f64,
    /// The point about which it is turned and scaled.
    #[kind(unit = "mm", default = [0.0; 3])]
    pub about: [f64; 3],
}

/// Which quadric a beam is.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Profile", noun = "profile")]
pub enum ProfileSpec {
    /// The cone: what covers both balls most tightly.
    Cone,
    /// The cylinder; hubs must be equal.
    Cylinder,
    /// The hyperboloid whose least radius is this.
    #[kind(unit = "mm", above = 0.0)]
    Waist(f64),
    /// By the parameter of the pencil of quadrics: 1 for a cylinder or paraboloid, less for a barrel, more for a waist.
    #[kind(above = 0.0)]
    Lambda(f64),
}

/// Rounding of beams into one another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Kind)]
#[kind(name = "Fillet", noun = "fillet", before = unnamed)]
pub enum FilletSpec {
    /// No fillets: beams meet in creases.
    #[default]
    None,
    /// The largest that each hub allows.
    Auto,
    /// With this radius in the tightest crotch; where it does not fit, with the largest that does, and a warning.
    #[kind(unit = "mm", above = 0.0)]
    Radius(f64),
    /// By τ: nearly 1 is a small fillet.
    #[kind(min = 0.0, below = 1.0)]
    Tau(f64),
    /// By α: a larger one is a larger fillet; τ = (1 − 4α²)/(1 + 4α²).
    #[kind(above = 0.0, max = 0.5)]
    Alpha(f64),
    /// By β = 1/(4α): a larger one is a smaller fillet.
    #[kind(min = 0.5)]
    Beta(f64),
}

impl From<FilletSpec> for Fillet {
    fn from(spec: FilletSpec) -> Fillet {
        match spec {
            FilletSpec::None => Fillet::None,
            FilletSpec::Auto => Fillet::Auto,
            FilletSpec::Radius(r) => Fillet::Radius(r),
            FilletSpec::Tau(t) => Fillet::Tau(t),
            FilletSpec::Alpha(a) => Fillet::Alpha(a),
            FilletSpec::Beta(b) => Fillet::Beta(b),
        }
    }
}

/// Explains what a number alone lacks.
fn unnamed(at: &NodeCursor) -> Result<(), DesignError> {
    match at.is_number() {
        true => {
            Err(at
                .error("a number alone does not name its quantity; for a radius in mm write fillet = { radius = 0.5 }"))
        }
        false => Ok(()),
    }
}

/// What becomes of beams that leave the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Trim", noun = "trim")]
pub enum TrimSpec {
    /// They are cut by the region's surface.
    #[default]
    Cut,
    /// They are left out.
    Drop,
    /// They end on the surface.
    Snap,
}

/// What becomes of beams with a free end inside the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "Dangling", noun = "word")]
pub enum DanglingSpec {
    /// They stay, with a warning.
    #[default]
    Keep,
    /// They are left out, one after the other.
    Drop,
}

name_of! {
    /// The name of a ready unit cell of beams.
    BeamCellName, "cell of beams", beams::graph::catalogue().iter().map(|u| u.name), surface,
    [
        ("simple_cubic", "sc"),
        ("cubic", "sc"),
        ("grid", "sc"),
        ("body_centred_cubic", "bcc"),
        ("body_centered_cubic", "bcc"),
        ("face_centred_cubic", "fcc"),
        ("face_centered_cubic", "fcc"),
        ("octet_truss", "octet"),
        ("octahedron", "octahedra"),
        ("cuboctahedron", "octahedra"),
        ("truncated_octahedron", "kelvin"),
        ("tetrakaidecahedron", "kelvin"),
        ("fluorite", "rhombic_dodecahedron"),
        ("dodecahedron", "rhombic_dodecahedron"),
        ("auxetic", "re_entrant"),
        ("honeycomb", "hexagonal_prism"),
    ]
}

/// Why a word is no cell of beams, if it is another kind of cell.
fn surface(word: &str) -> Option<String> {
    crate::cell::named(word).map(|_| format!("{word} is a surface, not a cell of beams; write it as a lattice"))
}
