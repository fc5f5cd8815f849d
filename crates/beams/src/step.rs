//! STEP files: the boundary of a quador lattice in exact form, for CAD systems.
//!
//! ISO 10303-21 text of the application protocol AP214 or AP242, in mm. Each connected component is a `MANIFOLD_SOLID_BREP`, unless the file is an assembly.
//! Cylinders, cones and balls are written as such, other beams as surfaces of revolution of a conic, and fillets as rational
//! biquadratic B-spline surfaces, all of which represent them exactly. Edges are rational quadratic B-splines, with curves
//! in the parameter planes of both their faces: a reader that has to find these itself does so to 1e-5 only.

use std::collections::HashMap;
use std::io;

use geometry::fault::Fault;
use geometry::formats::part21::{Id, Part21, Product, StepReport, Title, list, real, spline_curve};
use geometry::math::{Vec3, add, cross};
use geometry::progress::{Stopped, checkpoint};

use crate::quador::Quadors;
use crate::quador::brep::{Brep, CurveKey, EdgeUse, HubGroup, Surface};
use crate::quador::slice::SlicePlane;

/// Number of hubs up to which a lattice is one shell unless asked otherwise.
const SHELL: usize = 2000;
/// Least volume of a solid of an assembly, in cubes of the typical radius: less is what moved planes leave.
const SLIVER: f64 = 1e-5;

/// Writes the boundary of a quador lattice, or of what is behind all of some planes (on the side away from their normals), as a
/// STEP file (mm). The same lattice gives the same bytes.
///
/// With `assembly` it is one, of which each part is a hub with its half-beams, closed by planar faces where beams are halved:
/// equal ones are written once and placed by translations. Unless said, it is one if there are more than 2,000 hubs and at most half
/// as many distinct ones.
///
/// # Errors
/// Beams that intersect without a common hub or overlap too far, hubs whose seams do not close; planes that touch the boundary and
/// cut nothing there, or that leave nothing; closed cavities; failures of the output.
pub fn write_step(
    quadors: &Quadors,
    planes: &[SlicePlane],
    title: Title,
    assembly: Option<bool>,
    out: &mut dyn io::Write,
) -> Result<StepReport, Stopped> {
    let many = assembly.unwrap_or(quadors.len() > SHELL);
    let groups = if many { quadors.hub_groups(planes) } else { Vec::new() };
    if assembly.unwrap_or(2 * groups.len() <= quadors.len()) && many {
        return write_assembly(quadors, &groups, title, out);
    }
    let brep = quadors.brep(planes).map_err(Stopped::Refused)?;
    let components = brep.components();
    if components.is_empty() {
        return Err(nothing_left());
    }
    let mut volume = 0.0;
    for faces in &components {
        checkpoint();
        let within = volume_within(&brep, faces)?;
        if within <= 0.0 {
            return Err(refused(CAVITY));
        }
        volume += within;
    }
    write(&brep, (&components, volume), title, out).map_err(Stopped::Io)
}

/// What is refused where a shell is turned inside out.
const CAVITY: &str = "the beams enclose a cavity, which a STEP file of them cannot have: make them thinner";

fn refused(message: &str) -> Stopped {
    Stopped::Refused(Fault::new("region", message))
}

fn nothing_left() -> Stopped {
    refused("no beam is in the region")
}

fn volume_within(brep: &Brep, faces: &[u32]) -> Result<f64, Stopped> {
    brep.volume(faces).ok_or_else(|| refused("a face is too thin to be resolved: move the region a little"))
}

fn write(
    brep: &Brep,
    (components, volume): (&[Vec<u32>], f64),
    title: Title,
    out: &mut dyn io::Write,
) -> io::Result<StepReport> {
    let mut file = Part21::new(out, title)?;
    let product = Product::write(&mut file)?;
    let planar = file.parameter_plane()?;
    let mut summary = StepReport { volume, ..StepReport::default() };
    let solids = write_solids(brep, components, &mut file, planar, &mut summary)?;
    product.finish(&mut file, &solids)?;
    file.finish()?;
    Ok(summary)
}

/// Writes solids and counts what they have.
fn write_solids(
    brep: &Brep,
    components: &[Vec<u32>],
    file: &mut Part21,
    planar: Id,
    summary: &mut StepReport,
) -> io::Result<Vec<Id>> {
    let (corners, edges) = (vec![None; brep.corners.len()], vec![None; brep.edge_count()]);
    let mut writer = Writer { brep, file, planar, corners, curves: HashMap::new(), edges };
    let mut solids = Vec::with_capacity(components.len());
    for faces in components {
        solids.push(writer.solid(faces)?);
        summary.faces += faces.len();
    }
    summary.solids += solids.len();
    summary.edges += writer.edges.iter().flatten().count();
    summary.vertices += writer.corners.iter().flatten().count();
    Ok(solids)
}

fn write_assembly(
    quadors: &Quadors,
    groups: &[HubGroup],
    title: Title,
    out: &mut dyn io::Write,
) -> Result<StepReport, Stopped> {
    quadors.require_brep().map_err(Stopped::Refused)?;
    let mut file = Part21::new(out, title).map_err(Stopped::Io)?;
    let whole = Product::write(&mut file).map_err(Stopped::Io)?;
    let planar = file.parameter_plane().map_err(Stopped::Io)?;
    let mut parts = Vec::with_capacity(groups.len());
    let mut summary = StepReport::default();
    let mut solids = 0;
    for group in groups {
        checkpoint();
        let brep = quadors.group_brep(group).map_err(Stopped::Refused)?;
        let mut components = brep.components();
        let mut volume = 0.0;
        let mut kept = Vec::with_capacity(components.len());
        for faces in &components {
            let within = volume_within(&brep, faces)?;
            // What moved planes leave is no solid.
            let is_solid = !group.is_cut() || within > SLIVER * quadors.typical_radius().powi(3);
            if is_solid && within <= 0.0 {
                return Err(refused(CAVITY));
            }
            volume += if is_solid { within } else { 0.0 };
            kept.push(is_solid);
        }
        let mut left = kept.into_iter();
        components.retain(|_| left.next() == Some(true));
        if components.is_empty() {
            continue;
        }
        summary.volume += volume * group.hubs.len() as f64;
        solids += components.len() * group.hubs.len();
        let mut write = || {
            let product = whole.another(&mut file, &format!("{} hub {}", title.name, parts.len() + 1))?;
            let solids = write_solids(&brep, &components, &mut file, planar, &mut summary)?;
            product.finish(&mut file, &solids)
        };
        let shape = write().map_err(Stopped::Io)?;
        parts.push((shape, group.hubs.iter().map(|h| quadors.center(*h as usize)).collect()));
    }
    if parts.is_empty() {
        return Err(nothing_left());
    }
    whole.assemble(&mut file, &parts).map_err(Stopped::Io)?;
    file.finish().map_err(Stopped::Io)?;
    Ok(StepReport { solids, parts: Some(parts.len()), ..summary })
}

/// A corner: its point and its vertex.
#[derive(Clone, Copy)]
struct WrittenCorner {
    point: Id,
    vertex: Id,
}

/// Writes faces; edges, corners and curves once each.
struct Writer<'a, 'f> {
    brep: &'a Brep<'a>,
    file: &'a mut Part21<'f>,
    /// The context of curves in parameter planes.
    planar: Id,
    /// The corners, by number.
    corners: Vec<Option<WrittenCorner>>,
    /// The curves in parameter planes, which equal hubs share.
    curves: HashMap<CurveKey, Id>,
    /// The edges, by number.
    edges: Vec<Option<Id>>,
}

impl Writer<'_, '_> {
    /// A connected component, from the numbers of its faces.
    fn solid(&mut self, faces: &[u32]) -> io::Result<Id> {
        // The surfaces first, since edges refer to those of both their faces.
        let mut surfaces = Vec::with_capacity(faces.len());
        for &face in faces {
            checkpoint();
            surfaces.push(self.surface(face)?);
        }
        let mut curves: HashMap<u32, Vec<Id>> = HashMap::new();
        let mut all_loops = Vec::with_capacity(faces.len());
        for (&face, surface) in faces.iter().zip(&surfaces) {
            let loops = self.brep.loops(&self.brep.faces[face as usize]);
            for &(edge, _) in loops.iter().flatten() {
                let curve = self.parameter_curve(face, *surface, edge)?;
                curves.entry(edge).or_default().push(curve);
            }
            all_loops.push(loops);
        }
        let mut written = Vec::with_capacity(faces.len());
        for (loops, surface) in all_loops.iter().zip(&surfaces) {
            let mut bounds = Vec::with_capacity(loops.len());
            for (k, uses) in loops.iter().enumerate() {
                let mut oriented = Vec::with_capacity(uses.len());
                for of in uses {
                    oriented.push(self.oriented_edge(*of, &curves)?);
                }
                let edges = self.file.entity(&format!("EDGE_LOOP('',{})", list(&oriented)))?;
                let kind = if k == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
                bounds.push(self.file.entity(&format!("{kind}('',{edges},.T.)"))?);
            }
            written.push(self.file.entity(&format!("ADVANCED_FACE('',{},{surface},.T.)", list(&bounds)))?);
        }
        let shell = self.file.entity(&format!("CLOSED_SHELL('',{})", list(&written)))?;
        self.file.entity(&format!("MANIFOLD_SOLID_BREP('',{shell})"))
    }

    fn placement(&mut self, at: Vec3, axis: Vec3, side: Vec3) -> io::Result<Id> {
        let [z, x] = [self.file.direction(axis)?, self.file.direction(side)?];
        let point = self.file.point(&at)?;
        self.file.entity(&format!("AXIS2_PLACEMENT_3D('',{point},{z},{x})"))
    }

    fn surface(&mut self, face: u32) -> io::Result<Id> {
        let face = &self.brep.faces[face as usize];
        let center = self.brep.center(face.frame.hub);
        match face.surface {
            Surface::Cylinder { axis, side, radius } => {
                let at = self.placement(center, axis, side)?;
                self.file.entity(&format!("CYLINDRICAL_SURFACE('',{at},{})", real(radius)))
            }
            Surface::Cone { axis, side, radius, half_angle } => {
                let at = self.placement(center, axis, side)?;
                self.file.entity(&format!("CONICAL_SURFACE('',{at},{},{})", real(radius), real(half_angle)))
            }
            Surface::Sphere { axis, side, radius } => {
                let at = self.placement(center, axis, side)?;
                self.file.entity(&format!("SPHERICAL_SURFACE('',{at},{})", real(radius)))
            }
            Surface::Revolution { axis, meridian, .. } => {
                let [at, along] = [self.file.point(&center)?, self.file.direction(axis)?];
                let axis = self.file.entity(&format!("AXIS1_PLACEMENT('',{at},{along})"))?;
                let mut points = Vec::with_capacity(3);
                for p in meridian.points {
                    points.push(self.file.point(&add(center, p))?);
                }
                let curve = self.file.entity(&spline_curve(&points, Some(&[1.0, meridian.weight, 1.0])))?;
                self.file.entity(&format!("SURFACE_OF_REVOLUTION('',{curve},{axis})"))
            }
            Surface::Plane { origin, axes: [u, v] } => {
                let at = self.placement(add(center, origin), cross(u, v), u)?;
                self.file.entity(&format!("PLANE('',{at})"))
            }
            Surface::Rational { chart, range } => {
                let (net, weights) = chart.net(range);
                let sign = weights[1][1].signum();
                let mut rows = Vec::with_capacity(3);
                for row in net {
                    let mut points = Vec::with_capacity(3);
                    for p in row {
                        points.push(self.file.point(&add(center, p))?);
                    }
                    rows.push(list(&points));
                }
                let scaled = weights.map(|row| {
                    let numbers = row.map(|w| real(sign * w));
                    list(&numbers)
                });
                self.file.entity(&format!(
                    "(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,2,{},.UNSPECIFIED.,.F.,.F.,.F.)\
                     B_SPLINE_SURFACE_WITH_KNOTS((3,3),(3,3),(0.,1.),(0.,1.),.UNSPECIFIED.)GEOMETRIC_REPRESENTATION_ITEM()\
                     RATIONAL_B_SPLINE_SURFACE({})REPRESENTATION_ITEM('')SURFACE())",
                    list(&rows),
                    list(&scaled)
                ))
            }
        }
    }

    /// The curve of an edge in the parameter plane of a surface, with the same parameter.
    fn parameter_curve(&mut self, face: u32, surface: Id, edge: u32) -> io::Result<Id> {
        let face = &self.brep.faces[face as usize];
        let key = self.brep.curve_key(face, edge);
        let representation = match self.curves.get(&key) {
            Some(known) => *known,
            None => {
                let curve = self.brep.parameter_curve(face, edge);
                let mut points = Vec::with_capacity(curve.points.len());
                for at in &curve.points {
                    points.push(self.file.point(at)?);
                }
                let flat = self.file.entity(&spline_curve(&points, curve.weights.as_deref()))?;
                let made = self.file.entity(&format!("DEFINITIONAL_REPRESENTATION('',({flat}),{})", self.planar))?;
                self.curves.insert(key, made);
                made
            }
        };
        self.file.entity(&format!("PCURVE('',{surface},{representation})"))
    }

    fn corner(&mut self, corner: u32) -> io::Result<WrittenCorner> {
        if let Some(known) = self.corners[corner as usize] {
            return Ok(known);
        }
        let point = self.file.point(&self.brep.position(corner))?;
        let vertex = self.file.entity(&format!("VERTEX_POINT('',{point})"))?;
        let made = WrittenCorner { point, vertex };
        self.corners[corner as usize] = Some(made);
        Ok(made)
    }

    fn oriented_edge(&mut self, (edge, forward): EdgeUse, curves: &HashMap<u32, Vec<Id>>) -> io::Result<Id> {
        let id = match self.edges[edge as usize] {
            Some(id) => id,
            None => {
                let of = self.brep.edge(edge);
                let [from, to] = [self.corner(of.ends[0])?, self.corner(of.ends[1])?];
                let middle = self.file.point(&add(self.brep.center(of.hub), of.curve.points[1]))?;
                let weights = [1.0, of.curve.weight, 1.0];
                let space = self.file.entity(&spline_curve(&[from.point, middle, to.point], Some(&weights)))?;
                let flat = list(curves.get(&edge).into_iter().flatten());
                let curve = self.file.entity(&format!("SURFACE_CURVE('',{space},{flat},.CURVE_3D.)"))?;
                let id = self.file.entity(&format!("EDGE_CURVE('',{},{},{curve},.T.)", from.vertex, to.vertex))?;
                self.edges[edge as usize] = Some(id);
                id
            }
        };
        self.file.entity(&format!("ORIENTED_EDGE('',*,*,{id},.{}.)", if forward { 'T' } else { 'F' }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Beam, Graph, HubBall, Profile};
    use crate::quador::Fillet;

    /// Three beams of different quadrics that meet in one hub, and a ball.
    fn lattice() -> Quadors {
        let ends = [[8.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 1.0, 9.0]];
        let mut hubs =
            vec![HubBall { center: [0.0; 3], radius: 1.0 }, HubBall { center: [-20.0, 0.0, 0.0], radius: 2.0 }];
        hubs.extend(ends.iter().zip([1.0, 0.6, 1.0]).map(|(center, radius)| HubBall { center: *center, radius }));
        let profiles = [Profile::Cylinder, Profile::Cone, Profile::Waist(0.5)];
        let beams = profiles.into_iter().zip(2..).map(|(profile, end)| Beam { ends: [0, end], profile }).collect();
        Quadors::new(&Graph { hubs, beams }, Fillet::Auto).expect("a lattice")
    }

    fn text() -> (String, StepReport) {
        let mut out = Vec::new();
        let made = write_step(&lattice(), &[], Title { name: "it's", ..Title::default() }, None, &mut out)
            .expect("written to memory");
        (String::from_utf8(out).expect("ASCII"), made)
    }

    /// The entities, by number, each without its number.
    fn entities(text: &str) -> Vec<&str> {
        let data = text.split_once("DATA;\n").expect("data").1.split_once("ENDSEC;").expect("an end").0;
        let of = |(k, line): (usize, &'_ str)| line.starts_with(&format!("#{}=", k + 1));
        assert!(data.lines().enumerate().all(of), "numbered in order");
        data.lines().map(|l| l.split_once('=').expect("an entity").1).collect()
    }

    fn references(entity: &str) -> impl Iterator<Item = usize> {
        entity.split('#').skip(1).map(|t| {
            let end = t.find(|c: char| !c.is_ascii_digit()).unwrap_or(t.len());
            t[..end].parse().expect("a number")
        })
    }

    #[test]
    fn entities_are_complete() {
        let (text, made) = text();
        let entities = entities(&text);
        let count = |name: &str| entities.iter().filter(|e| e.starts_with(name)).count();
        assert_eq!(made.solids, 2);
        assert_eq!([count("MANIFOLD_SOLID_BREP("), count("CLOSED_SHELL(")], [2, 2]);
        assert_eq!(
            [count("ADVANCED_FACE("), count("EDGE_CURVE("), count("VERTEX_POINT(")],
            [made.faces, made.edges, made.vertices]
        );
        for surface in ["CYLINDRICAL_SURFACE(", "CONICAL_SURFACE(", "SURFACE_OF_REVOLUTION(", "SPHERICAL_SURFACE("] {
            assert!(count(surface) >= 2, "{surface}");
        }
        let mut used = vec![false; entities.len() + 1];
        for (k, entity) in entities.iter().enumerate() {
            assert!(entity.is_ascii() && entity.matches('(').count() == entity.matches(')').count(), "{entity}");
            for to in references(entity) {
                assert!(to >= 1 && to <= k, "entity {} refers back: {entity}", k + 1);
                used[to] = true;
            }
        }
        let unused: Vec<&str> = entities.iter().zip(&used[1..]).filter(|e| !e.1).map(|e| *e.0).collect();
        let roots =
            ["APPLICATION_PROTOCOL_DEFINITION", "PRODUCT_RELATED_PRODUCT_CATEGORY", "SHAPE_DEFINITION_REPRESENTATION"];
        assert!(unused.iter().all(|e| roots.iter().any(|r| e.starts_with(r))), "{unused:?}");
    }

    #[test]
    fn every_edge_is_used_once_in_each_direction() {
        let (text, _) = text();
        let entities = entities(&text);
        let uses: Vec<&str> = entities.iter().filter(|e| e.starts_with("ORIENTED_EDGE(")).copied().collect();
        for (k, _) in entities.iter().enumerate().filter(|e| e.1.starts_with("EDGE_CURVE(")) {
            for sense in [".T.", ".F."] {
                let whole = format!("ORIENTED_EDGE('',*,*,#{},{sense});", k + 1);
                assert_eq!(uses.iter().filter(|u| **u == whole).count(), 1, "{whole}");
            }
        }
    }

    #[test]
    fn the_same_lattice_gives_the_same_bytes_and_the_name_is_quoted() {
        let (text, _) = text();
        assert_eq!(text, self::text().0);
        assert!(text.contains("PRODUCT('it''s','it''s'"));
    }
}
