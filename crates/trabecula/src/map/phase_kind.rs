//! The solved map, as it is declared.

use super::stress_kind::{StressKind, each};
use super::{
    Aligned, Axis, BuildMap, CoreFill, CoreOptions, Map, NO_WAVELENGTH, Orientation, Phase, PhaseRequest,
    SolverOptions, Stretch, TwoAxes, given_twice, shared,
};
use crate::environment::Environment;
use crate::field::Field;
use crate::grade::{FieldKind, Grade, GradeSpec, Product, Quantity, key_of, lines, pairs};
use crate::kind::{DesignError, Fault, Key, Kind};
use crate::region::{Region, RegionKind};
use geometry::fault::number;
use geometry::math::{IDENTITY, Mat3};

/// Three phases of given orientation R and wavelengths λᵢ, by least squares: ∇Φᵢ = R eᵢ / λᵢ, without tearing. At most one of
/// rotate (or rotate_x, rotate_y, rotate_z), direction, frame, stress; without, cells are not turned.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Phase", noun = "a phase map")]
pub struct PhaseKind {
    /// Cell edge, one number or three, along the cell's axes or, { principal = [a, b, c] }, the principal directions of the stress;
    /// each may vary. Left out where the level has a fraction and a thickness or a pore, from which it
    /// follows wherever they vary; three numbers are ratios then.
    #[kind(unit = "mm", above = 0.0, hints("cell_size", "unit_cell", "unit_cell_size", "cell_edge", "period", "size"))]
    wavelength: Option<GradeOrThree>,
    /// How cells are turned.
    #[kind(flatten)]
    orientation: OrientationKind,
    /// Weight of the cell's shape here, compared with other positions (0 or more): where no map can follow everything, the error
    /// goes where this is small.
    #[kind(keyword)]
    weight: Option<GradeSpec>,
    /// Weight of an error of angle against the same error of spacing: where no map can follow both, above 1 cells are nearer to
    /// their directions, below 1 to their sizes.
    #[kind(default = 1.0, min = 0.001, max = 1000.0)]
    angle_weight: f64,
    /// Length over which a direction, a frame or a stress is smoothed before cells follow it, without regard to the signs and the
    /// order of their axes. Parts of a stress count by how much they differ between directions. None unless given.
    #[kind(unit = "mm", above = 0.0)]
    smooth: Option<f64>,
    /// "surface": an axis of the cell, whichever is nearest, along the normal of the region's surface, and farther in what is asked for
    /// there; without an orientation, what continues the surface's.
    align: Option<Align>,
    /// How deep that reaches below the surface; two wavelengths unless given.
    #[kind(unit = "mm", above = 0.0)]
    align_depth: Option<f64>,
    /// The least and the greatest length of a cell, along any direction, over the one asked for: [0.67, 1.5], say. The map is the
    /// one nearest to the target that keeps to it; a warning where none is found. Any unless given.
    stretch: Option<[f64; 2]>,
    /// Regions: on the parts of the surface in each of them the phase along the normal is a whole number, so that the lattice ends there
    /// with whole cells, as many as fit best, and parts that meet there fit.
    #[kind(default)]
    fix: Vec<RegionKind>,
    /// What covers singular lines, round which the stress's or the frame's axes do not come back to themselves: "solid" or "void". Outside
    /// these cores cells are whole. A cell has to be the same after the turn of the axes; singular lines stay bare unless given.
    core: Option<CoreFill>,
    /// The radius of the cores; half the wavelength at the lines unless given.
    #[kind(unit = "mm", above = 0.0)]
    core_radius: Option<f64>,
    /// Moves the lattice.
    #[kind(unit = "mm", default = [0.0; 3])]
    offset: [f64; 3],
    /// Spacing of the grid that the phases are solved on; a quarter of the least wavelength unless given.
    #[kind(unit = "mm", above = 0.0)]
    step: Option<f64>,
    /// What counts when the phases are solved.
    #[kind(default)]
    domain: Domain,
    /// Whether the map may fold, where cells turn inside out.
    #[kind(default = false)]
    folds: bool,
}

/// How the cells of a phase map are turned.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "an orientation", alternatives)]
pub enum OrientationKind {
    /// By one angle or several.
    Axes(AxisAngles),
    /// By three angles.
    Rotate(Angles),
    /// By a vector.
    Direction(AlongDirection),
    /// By two vectors.
    Frame(AlongFrame),
    /// By a tensor.
    Stress(AlongStress),
}

impl Default for OrientationKind {
    fn default() -> Self {
        OrientationKind::Axes(AxisAngles { rotate_x: None, rotate_y: None, rotate_z: None })
    }
}

/// Turned about each axis.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct AxisAngles {
    /// The angle about x alone, in addition to or in place of `rotate_y` and `rotate_z`.
    #[kind(unit = "degrees", keyword)]
    rotate_x: Option<GradeSpec>,
    /// The angle about y alone.
    #[kind(unit = "degrees")]
    rotate_y: Option<GradeSpec>,
    /// The angle about z alone.
    #[kind(unit = "degrees")]
    rotate_z: Option<GradeSpec>,
}

/// Turned by three angles.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct Angles {
    /// Angles about x, y, z: z is turned first, then y, then x. Each may vary.
    #[kind(unit = "degrees")]
    rotate: [GradeSpec; 3],
}

/// Turned to a direction.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct AlongDirection {
    /// Direction of the cell's z axis; its sign and length do not matter.
    #[kind(keyword)]
    direction: VectorKind,
}

/// Turned to two directions.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct AlongFrame {
    /// The directions of the cell's x and z axes: { x = [x, y, z], z = [x, y, z] }. Signs that flip from one position to the next, and
    /// axes of a result that change places, do not matter.
    #[kind(keyword)]
    frame: FrameKind,
}

/// Turned to the principal directions of a tensor.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct AlongStress {
    /// A stress tensor whose principal directions the cell's axes take: its components 11, 22, 33, 23, 13, 12, the field of a result, a
    /// table, or several load cases, { cases = [...] }.
    #[kind(keyword)]
    stress: StressKind,
}

/// A number that may vary, or three of them, along the cell's axes or those of a stress.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum GradeOrThree {
    /// The same along all three axes.
    One(GradeSpec),
    /// Along the cell's x, y, z.
    Three(Box<[GradeSpec; 3]>),
    /// Along the principal directions of the stress.
    Principal(PrincipalLengths),
}

/// Cell edges along the principal directions of the stress, whatever axes of the cell lie along them.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "cell edges along principal directions")]
pub struct PrincipalLengths {
    /// Along the direction of the greatest principal stress (tension is positive; of several load cases by the mean, the root mean
    /// square), of the middle and of the least. Where two values are within 10 % lengths go over into one another, and
    /// are the same along both where the values are equal.
    #[kind(unit = "mm", above = 0.0)]
    principal: Box<[GradeSpec; 3]>,
}

/// A vector that may vary.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged, noun = "three numbers [x, y, z], each of which may vary, or the field of a result")]
pub enum VectorKind {
    /// By its components along x, y, z.
    Components(Box<[GradeSpec; 3]>),
    /// An array of three numbers of a result.
    Field(VectorField),
}

/// An array of three numbers for each point or cell of a result.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a vector")]
pub struct VectorField {
    /// An array of three components of a result.
    field: FieldKind,
}

/// Two of the cell's axes; the third is at right angles to both.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Frame", noun = "a frame")]
pub struct FrameKind {
    /// Direction of the cell's x axis; its component along z is left out.
    x: VectorKind,
    /// Direction of the cell's z axis.
    z: VectorKind,
}

/// What cells are aligned with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(noun = "alignment")]
pub enum Align {
    /// The region's surface.
    Surface,
}

/// What counts when phases are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "domain")]
pub enum Domain {
    /// The region; its surroundings within its bounds as little as possible.
    #[default]
    Region,
    /// All of the region's bounds alike.
    Box,
}

impl BuildMap for PhaseKind {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let length = key_of::<PhaseKind>("wavelength");
        let length = |of: &GradeSpec, path: String| of.build(&Quantity::new(path, environment, length));
        let at = format!("{path}.wavelength");
        let wavelength = match &self.wavelength {
            None => return Err(DesignError::new(path, NO_WAVELENGTH)),
            Some(GradeOrThree::One(g)) => {
                let one = length(g, at)?;
                [one.clone(), one.clone(), one]
            }
            Some(GradeOrThree::Three(of)) => each(of, &at, &length)?,
            Some(GradeOrThree::Principal(PrincipalLengths { principal })) => {
                if !matches!(self.orientation, OrientationKind::Stress(_)) {
                    let message =
                        "cell edges along principal directions need a stress; give one number or three, or a stress";
                    return Err(DesignError::new(at, message));
                }
                let at = format!("{at}.principal");
                each(principal, &at, &|of, path| {
                    of.build(&Quantity::new(path, environment, key_of::<PrincipalLengths>("principal")))
                })?
            }
        };
        self.with(wavelength, path, environment)
    }

    fn unit(&self, length: &str, path: &str, _: &Environment) -> Result<Mat3, DesignError> {
        let ratios = self.ratios(length, path)?;
        let mut unit = IDENTITY;
        (0..3).for_each(|a| unit[a][a] = 1.0 / ratios[a]);
        Ok(unit)
    }

    fn sized(&self, edge: &Grade, length: &str, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let ratios = self.ratios(length, path)?;
        self.with(ratios.map(|r| Product::of(edge.clone(), Grade::Constant(r))), path, environment)
    }
}

impl PhaseKind {
    /// The ratios of the cells' edges, where their size is left out.
    fn ratios(&self, length: &str, path: &str) -> Result<[f64; 3], DesignError> {
        match &self.wavelength {
            None => Ok([1.0; 3]),
            Some(GradeOrThree::Three(of)) => match of.each_ref() {
                [GradeSpec::Constant(a), GradeSpec::Constant(b), GradeSpec::Constant(c)] => Ok([*a, *b, *c]),
                _ => Err(given_twice(length, path)),
            },
            Some(GradeOrThree::One(_) | GradeOrThree::Principal(_)) => Err(given_twice(length, path)),
        }
    }

    /// The alignment with the surface.
    fn aligned(&self, wavelength: &[Grade; 3]) -> Result<Option<Aligned>, Fault> {
        match (self.align, self.align_depth) {
            (None, None) => Ok(None),
            (None, Some(depth)) => {
                let message =
                    "align_depth is how deep align reaches; give align = \"surface\" as well, or leave it out";
                Err(Fault::new("align_depth", message).found(number(depth)))
            }
            (Some(_), _) if self.domain == Domain::Box => {
                let message = "cells are aligned with the surface of the region, and domain = \"box\" leaves it out of account; leave domain out";
                Err(Fault::new("align", message))
            }
            (Some(_), _) if matches!(self.wavelength, Some(GradeOrThree::Three(_))) => {
                let message = "any axis of a cell may lie along the normal: three wavelengths have no axes of their own; give one, or leave align out";
                Err(Fault::new("align", message))
            }
            (Some(_), depth) => {
                let longest = wavelength.iter().filter_map(Grade::constant).fold(0.0, f64::max);
                let depth = match (depth, longest > 0.0) {
                    (Some(depth), _) => depth,
                    (None, true) => 2.0 * longest,
                    (None, false) => {
                        let message =
                            "the wavelength varies: give align_depth, how deep align = \"surface\" reaches (mm)";
                        return Err(Fault::new("align", message));
                    }
                };
                Aligned::new(depth).map(Some)
            }
        }
    }

    /// How singular lines are covered.
    fn covering(&self) -> Result<Option<CoreOptions>, Fault> {
        match (self.core, self.core_radius) {
            (None, Some(radius)) => {
                let message =
                    "core_radius is how far core reaches; give core = \"solid\" or \"void\" as well, or leave it out";
                Err(Fault::new("core_radius", message).found(number(radius)))
            }
            (fill, radius) => Ok(fill.map(|fill| CoreOptions { fill, radius })),
        }
    }

    /// The regions of the faces that are fixed.
    fn fixed(&self, path: &str, environment: &Environment) -> Result<Vec<Region>, DesignError> {
        if !self.fix.is_empty() && self.domain == Domain::Box {
            let message =
                "faces are those of the region, and domain = \"box\" leaves it out of account; leave domain out";
            return Err(DesignError::new(format!("{path}.fix"), message));
        }
        let built = |(i, of): (usize, &RegionKind)| environment.region(of, &format!("{path}.fix[{i}]"));
        self.fix.iter().enumerate().map(built).collect()
    }

    /// The map of these wavelengths (mm).
    fn with(&self, wavelength: [Grade; 3], path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let below = |key: &str| format!("{path}.{key}");
        let weight_key = key_of::<PhaseKind>("weight");
        let any = |of: &GradeSpec, path: String| of.build(&Quantity::new(path, environment, weight_key));
        if let (Some(length), OrientationKind::Axes(_) | OrientationKind::Rotate(_)) = (self.smooth, &self.orientation)
        {
            let message = match (self.align, self.orientation == OrientationKind::default()) {
                (Some(_), true) => {
                    "smooth is for a direction, a frame or a stress; what align = \"surface\" alone gives is averaged over half of \
                     align_depth: give a larger align_depth, and leave smooth out"
                }
                _ => {
                    "smooth is for a direction, a frame or a stress; angles are followed as they are given: leave it out"
                }
            };
            return Err(DesignError::new(below("smooth"), message).found(number(length)));
        }
        let align = self.aligned(&wavelength).map_err(|f| DesignError::fault(path, f))?;
        let weight = self.weight.as_ref().map(|g| any(g, below("weight")));
        let wanted = PhaseRequest {
            wavelength,
            by_principal: matches!(self.wavelength, Some(GradeOrThree::Principal(_))),
            orientation: self.orientation.build(path, environment)?,
            weight: weight.transpose()?,
            angle_weight: self.angle_weight,
            smooth: self.smooth,
            align,
            stretch: self.stretch.map(Stretch::new).transpose().map_err(|f| DesignError::fault(path, f))?,
            fix: self.fixed(path, environment)?,
            offset: self.offset,
            core: self.covering().map_err(|f| DesignError::fault(path, f))?,
        };
        let region: &dyn Field = &**environment.region;
        let settings = SolverOptions {
            step: self.step,
            region: (self.domain == Domain::Region).then_some(region),
            folds: self.folds,
        };
        let made = Phase::solve(&environment.region.bounds(), &wanted, &settings);
        shared(made.map_err(|f| self.orientation.fault(f)), path)
    }
}

impl OrientationKind {
    /// A fault of the orientation at the key that was given.
    fn fault(&self, f: Fault) -> Fault {
        match self {
            OrientationKind::Axes(AxisAngles { rotate_x, rotate_y, rotate_z }) if f.at == "rotate" => {
                let given = [("rotate_x", rotate_x), ("rotate_y", rotate_y), ("rotate_z", rotate_z)];
                let varies = |of: &Option<GradeSpec>| matches!(of, Some(GradeSpec::Kind(_)));
                let at = given.into_iter().find(|(_, of)| varies(of)).map_or("rotate", |(key, _)| key);
                Fault { at: at.into(), ..f }
            }
            _ => f,
        }
    }

    fn build(&self, path: &str, environment: &Environment) -> Result<Orientation, DesignError> {
        let below = |key: &str| format!("{path}.{key}");
        let any = |of: &GradeSpec, path: String| of.build(&Quantity::new(path, environment, Key::NONE));
        let angle = |of: &Option<GradeSpec>, key: &str| match of {
            Some(of) => any(of, below(key)),
            None => Ok(Grade::Constant(0.0)),
        };
        let vector = |of: &VectorKind, key: &str| match of {
            VectorKind::Components(of) => each(of, &below(key), &any).map(Axis::Vector),
            VectorKind::Field(of) => lines(&of.field, &below(&format!("{key}.field")), environment).map(Axis::Line),
        };
        Ok(match self {
            OrientationKind::Axes(AxisAngles { rotate_x, rotate_y, rotate_z }) => Orientation::Angles([
                angle(rotate_x, "rotate_x")?,
                angle(rotate_y, "rotate_y")?,
                angle(rotate_z, "rotate_z")?,
            ]),
            OrientationKind::Rotate(of) => Orientation::Angles(each(&of.rotate, &below("rotate"), &any)?),
            OrientationKind::Direction(of) => Orientation::Direction(vector(&of.direction, "direction")?),
            OrientationKind::Frame(AlongFrame { frame }) => {
                let both = TwoAxes::new(vector(&frame.x, "frame.x")?, vector(&frame.z, "frame.z")?);
                let unordered = match (&frame.x, &frame.z) {
                    (VectorKind::Field(x), VectorKind::Field(z)) => {
                        pairs([&x.field, &z.field], &below("frame.x.field"), environment, TwoAxes::coefficients)?
                    }
                    _ => None,
                };
                Orientation::Frame(match unordered {
                    Some(unordered) => both.unordered(unordered),
                    None => both,
                })
            }
            OrientationKind::Stress(of) => Orientation::Stress(of.stress.build(&below("stress"), environment)?),
        })
    }
}
