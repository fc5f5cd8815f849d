//! Text of ISO 10303-21, the clear text encoding of STEP: numbered entities in the order in which they are written; and the
//! entities that every part has.

use core::fmt::{self, Display, Write as _};
use std::collections::HashMap;
use std::io;

use schemars::JsonSchema;
use serde::Serialize;

use crate::math::Vec3;

/// The application protocol of a file. Solids are the same in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Protocol {
    /// AP214, automotive design, of 2000.
    #[default]
    Ap214,
    /// AP242, managed model based 3D engineering, of 2014.
    Ap242,
}

impl Protocol {
    /// Their names.
    pub const NAMES: [&str; 2] = ["ap214", "ap242"];

    /// The protocol of a name.
    pub fn of(name: &str) -> Option<Protocol> {
        match name {
            "ap214" => Some(Protocol::Ap214),
            "ap242" => Some(Protocol::Ap242),
            _ => None,
        }
    }

    fn schema(self) -> &'static str {
        match self {
            Protocol::Ap214 => "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }",
            Protocol::Ap242 => "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }",
        }
    }

    /// The application, and the name and the year of the protocol.
    fn application(self) -> [&'static str; 2] {
        match self {
            Protocol::Ap214 => ["core data for automotive mechanical design processes", "'automotive_design',2000"],
            Protocol::Ap242 => {
                ["managed model based 3d engineering", "'ap242_managed_model_based_3d_engineering',2014"]
            }
        }
    }
}

/// What a file is headed by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Title<'a> {
    /// The name of its product.
    pub name: &'a str,
    /// Its application protocol.
    pub protocol: Protocol,
}

/// What a STEP file contains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct StepReport {
    /// Number of solids: connected components, or placed parts of an assembly.
    pub solids: usize,
    /// Number of distinct parts of an assembly, each a hub with its half-beams; null for a file that is none.
    pub parts: Option<usize>,
    /// Number of faces; of an assembly, of its distinct parts.
    pub faces: usize,
    /// Number of edges; of an assembly, of its distinct parts.
    pub edges: usize,
    /// Number of vertices; of an assembly, of its distinct parts.
    pub vertices: usize,
    /// Enclosed volume, mm³: of beams to 1e-10, of patches that of the patches.
    pub volume: f64,
    /// Greatest distance of patches from the surface that they stand for, mm, at 49 points of each; 0 for beams, which are exact.
    pub deviation: f64,
    /// Greatest angle between the normals of adjacent patches along their common edge, degrees; null for beams.
    pub angle: Option<f64>,
}

/// The number of an entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Id(u64);

impl Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// A file that is being written.
pub struct Part21<'a> {
    out: &'a mut dyn io::Write,
    title: Title<'a>,
    last: u64,
    /// Entities that others share, by their text.
    shared: HashMap<String, Id>,
}

impl<'a> Part21<'a> {
    /// Starts a file. The time stamp is left empty, so that the same data give the same bytes.
    pub fn new(out: &'a mut dyn io::Write, title: Title<'a>) -> io::Result<Part21<'a>> {
        write!(
            out,
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME({},'',(''),(''),'Trabecula {}','Trabecula','');\n\
             FILE_SCHEMA(('{}'));\nENDSEC;\nDATA;\n",
            string(title.name),
            env!("CARGO_PKG_VERSION"),
            title.protocol.schema()
        )?;
        Ok(Part21 { out, title, last: 0, shared: HashMap::new() })
    }

    /// Writes an entity.
    pub fn entity(&mut self, text: &str) -> io::Result<Id> {
        self.last += 1;
        writeln!(self.out, "#{}={text};", self.last)?;
        Ok(Id(self.last))
    }

    /// An entity of this text: the one that was written before, if any was.
    pub fn shared(&mut self, text: &str) -> io::Result<Id> {
        if let Some(known) = self.shared.get(text) {
            return Ok(*known);
        }
        let id = self.entity(text)?;
        self.shared.insert(text.to_string(), id);
        Ok(id)
    }

    /// Writes a point of two or three coordinates.
    pub fn point(&mut self, at: &[f64]) -> io::Result<Id> {
        self.entity(&point(at))
    }

    /// A unit vector, shared.
    pub fn direction(&mut self, along: Vec3) -> io::Result<Id> {
        self.shared(&format!("DIRECTION('',{})", list(along.map(real))))
    }

    /// The context of curves in the parameter planes of surfaces.
    pub fn parameter_plane(&mut self) -> io::Result<Id> {
        self.entity(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('',''))",
        )
    }

    /// Ends the file.
    pub fn finish(self) -> io::Result<()> {
        self.out.write_all(b"ENDSEC;\nEND-ISO-10303-21;\n")?;
        self.out.flush()
    }
}

/// A product of a file: a part, or an assembly of parts.
pub struct Product {
    shared: Shared,
    /// The context of its shape: parts and assembly are each in a space of their own (ISO 10303-43).
    context: Id,
    definition: Id,
    shape: Id,
}

/// What the products of a file share: contexts, lengths in mm, the origin.
#[derive(Clone, Copy)]
struct Shared {
    mechanical: Id,
    design: Id,
    placement: Id,
    /// Uncertainty of lengths, and units of length, angle and solid angle.
    uncertainty: Id,
    units: [Id; 3],
}

/// The shape of a product.
#[derive(Clone, Copy)]
pub struct ProductShape {
    definition: Id,
    representation: Id,
}

impl Product {
    /// Writes what stands before the solids: the product of the file, to be finished with the solids.
    pub fn write(file: &mut Part21) -> io::Result<Product> {
        let name = file.title.name;
        let [of, protocol] = file.title.protocol.application();
        let application = file.entity(&format!("APPLICATION_CONTEXT('{of}')"))?;
        file.entity(&format!("APPLICATION_PROTOCOL_DEFINITION('international standard',{protocol},{application})"))?;
        let mechanical = file.entity(&format!("PRODUCT_CONTEXT('',{application},'mechanical')"))?;
        let design = file.entity(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')"))?;
        let length = file.entity("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")?;
        let angle = file.entity("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")?;
        let solid_angle = file.entity("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")?;
        let uncertainty = file.entity(&format!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),{length},'distance_accuracy_value','')"
        ))?;
        let placement = placement(file, [0.0; 3])?;
        let units = [length, angle, solid_angle];
        Shared { mechanical, design, placement, uncertainty, units }.product(file, name)
    }

    /// Writes what stands before the solids of another product of the file.
    pub fn another(&self, file: &mut Part21, name: &str) -> io::Result<Product> {
        self.shared.product(file, name)
    }

    /// Writes what follows the solids.
    pub fn finish(&self, file: &mut Part21, solids: &[Id]) -> io::Result<ProductShape> {
        let items = list([self.shared.placement].iter().chain(solids));
        self.shape(file, "ADVANCED_BREP_SHAPE_REPRESENTATION", &items)
    }

    /// Makes it an assembly of others, each with its positions, mm.
    pub fn assemble(&self, file: &mut Part21, parts: &[(ProductShape, Vec<Vec3>)]) -> io::Result<ProductShape> {
        let mut placements = Vec::new();
        for at in parts.iter().flat_map(|(_, positions)| positions) {
            placements.push(placement(file, *at)?);
        }
        let origin = self.shared.placement;
        let whole = self.shape(file, "SHAPE_REPRESENTATION", &list([origin].iter().chain(&placements)))?;
        let each = parts.iter().flat_map(|(part, positions)| positions.iter().map(move |_| part));
        for (number, (part, at)) in (1..).zip(each.zip(&placements)) {
            let of = [self.definition, part.definition];
            let use_of = file
                .entity(&format!("NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}','{number}','',{},{},$)", of[0], of[1]))?;
            let shape = file.entity(&format!("PRODUCT_DEFINITION_SHAPE('','',{use_of})"))?;
            let moved = file.entity(&format!("ITEM_DEFINED_TRANSFORMATION('','',{origin},{at})"))?;
            let relation = file.entity(&format!(
                "(REPRESENTATION_RELATIONSHIP('','',{},{})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved})\
                 SHAPE_REPRESENTATION_RELATIONSHIP())",
                part.representation, whole.representation
            ))?;
            file.entity(&format!("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{shape})"))?;
        }
        Ok(whole)
    }

    fn shape(&self, file: &mut Part21, kind: &str, items: &str) -> io::Result<ProductShape> {
        let representation = file.entity(&format!("{kind}('',{items},{})", self.context))?;
        file.entity(&format!("SHAPE_DEFINITION_REPRESENTATION({},{representation})", self.shape))?;
        Ok(ProductShape { definition: self.definition, representation })
    }
}

impl Shared {
    fn product(self, file: &mut Part21, name: &str) -> io::Result<Product> {
        let name = string(name);
        let product = file.entity(&format!("PRODUCT({name},{name},'',({}))", self.mechanical))?;
        file.entity(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"))?;
        let formation = file.entity(&format!("PRODUCT_DEFINITION_FORMATION('','',{product})"))?;
        let definition = file.entity(&format!("PRODUCT_DEFINITION('design','',{formation},{})", self.design))?;
        let shape = file.entity(&format!("PRODUCT_DEFINITION_SHAPE('','',{definition})"))?;
        let [length, angle, solid_angle] = self.units;
        let context = file.entity(&format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))REPRESENTATION_CONTEXT('',''))",
            self.uncertainty
        ))?;
        Ok(Product { shared: self, context, definition, shape })
    }
}

/// A frame along the axes with its origin at a point.
fn placement(file: &mut Part21, at: Vec3) -> io::Result<Id> {
    let origin = file.point(&at)?;
    let [z, x] = [file.direction([0.0, 0.0, 1.0])?, file.direction([1.0, 0.0, 0.0])?];
    file.entity(&format!("AXIS2_PLACEMENT_3D('',{origin},{z},{x})"))
}

fn point(at: &[f64]) -> String {
    format!("CARTESIAN_POINT('',{})", list(at.iter().map(|v| real(*v))))
}

/// Items in parentheses.
pub fn list<T: Display>(items: impl IntoIterator<Item = T>) -> String {
    let mut out = String::from("(");
    for (k, item) in items.into_iter().enumerate() {
        if k > 0 {
            out.push(',');
        }
        // Formatting into a string cannot fail.
        let _ = write!(out, "{item}");
    }
    out.push(')');
    out
}

/// A finite number in the fewest digits that read back as the same number.
pub fn real(v: f64) -> String {
    let text = format!("{v:?}");
    match text.split_once('e') {
        None => text.strip_suffix('0').filter(|t| t.ends_with('.')).unwrap_or(&text).to_string(),
        Some((digits, power)) => format!("{digits}{}E{power}", if digits.contains('.') { "" } else { "." }),
    }
}

/// A string in quotes: apostrophes and backslashes doubled, other characters than printable ASCII as UTF-16.
pub fn string(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        match c {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            // Two bytes a character, or four: surrogates are none.
            _ => out.push_str(&match u32::from(c) {
                code @ ..0x10000 => format!("\\X2\\{code:04X}\\X0\\"),
                code => format!("\\X4\\{code:08X}\\X0\\"),
            }),
        }
    }
    out.push('\'');
    out
}

/// A Bézier curve, rational if it has weights.
pub fn spline_curve(points: &[Id], weights: Option<&[f64]>) -> String {
    let (degree, order) = (points.len() - 1, points.len());
    let curve = format!("{degree},{},.UNSPECIFIED.,.F.,.F.", list(points));
    let knots = format!("({order},{order}),(0.,1.),.UNSPECIFIED.");
    match weights {
        None => format!("B_SPLINE_CURVE_WITH_KNOTS('',{curve},{knots})"),
        Some(weights) => format!(
            "(BOUNDED_CURVE()B_SPLINE_CURVE({curve})B_SPLINE_CURVE_WITH_KNOTS({knots})CURVE()\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE({})REPRESENTATION_ITEM(''))",
            list(weights.iter().map(|w| real(*w)))
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_read_back() {
        let cases =
            [(0.0, "0."), (1.0, "1."), (-2.5, "-2.5"), (1e-7, "1.E-7"), (1.25e300, "1.25E300"), (100.0, "100.")];
        for (v, text) in cases {
            assert_eq!(real(v), text);
        }
        for v in [0.1 + 0.2, core::f64::consts::PI * 1e-9, f64::MIN_POSITIVE, -1e22] {
            assert_eq!(real(v).parse::<f64>(), Ok(v));
        }
    }

    #[test]
    fn strings_are_printable_ascii() {
        assert_eq!(string("a 'b' \\"), "'a ''b'' \\\\'");
        assert_eq!(string("Ø"), "'\\X2\\00D8\\X0\\'");
        assert_eq!(string("𝜆"), "'\\X4\\0001D706\\X0\\'");
    }
}
