//! A boundary as a STEP file: bicubic B-spline surfaces and planes.

use std::io;

use geometry::formats::part21::{Id, Part21, Product, Title, list, spline_curve};
use geometry::math::{Vec3, norm, scale, sub};
use geometry::progress::{Progress, Stopped};

use super::bezier::BicubicPatch;
use super::boundary::{Boundary, Carrier, corner, outward};
use super::quad_net::DirectedEdge;
use super::shells::Shells;

/// Decimals of coordinates (mm): a hundredth of the accuracy that the file states.
const DECIMALS: f64 = 1e9;

/// A position in the decimals of the file.
pub fn rounded(p: Vec3) -> Vec3 {
    p.map(|x| (x * DECIMALS).round() / DECIMALS)
}

/// Writes solids of a boundary.
pub fn write(
    of: &Boundary,
    solids: &[Shells],
    title: Title,
    out: &mut dyn io::Write,
    progress: &dyn Progress,
) -> Result<(), Stopped> {
    let mut file = Part21::new(out, title).map_err(Stopped::Io)?;
    let product = Product::write(&mut file).map_err(Stopped::Io)?;
    let planar = file.parameter_plane().map_err(Stopped::Io)?;
    let lines = square(&mut file, planar).map_err(Stopped::Io)?;
    let mut writer = Writer {
        of,
        file,
        lines,
        points: vec![None; of.vertices.len()],
        vertices: vec![None; of.vertices.len()],
        inner: vec![None; of.edges.len()],
        edges: vec![None; of.edges.len()],
        flat: vec![Vec::new(); of.edges.len()],
        surfaces: vec![None; of.faces.len()],
    };
    let mut written = Vec::new();
    let mut done = 0;
    for solid in solids {
        let mut shells = Vec::new();
        for shell in &solid.shells {
            for part in shell.chunks(1000) {
                part.iter().try_for_each(|f| writer.surface(*f)).map_err(Stopped::Io)?;
            }
            let mut faces = Vec::with_capacity(shell.len());
            for f in shell {
                faces.push(writer.face(*f).map_err(Stopped::Io)?);
                done += 1;
                if done % 1000 == 0 && !progress.step(done, of.faces.len() as u64) {
                    return Err(Stopped::Interrupted);
                }
            }
            shells.push(writer.file.entity(&format!("CLOSED_SHELL('',{})", list(&faces))).map_err(Stopped::Io)?);
        }
        written.push(writer.solid(&shells).map_err(Stopped::Io)?);
    }
    let mut file = writer.file;
    product.finish(&mut file, &written).map_err(Stopped::Io)?;
    file.finish().map_err(Stopped::Io)
}

/// The sides of the unit square as lines, for each side in order forwards and backwards.
fn square(file: &mut Part21, planar: Id) -> io::Result<[[Id; 2]; 4]> {
    let ends = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut made = Vec::with_capacity(8);
    for k in 0..4 {
        for [from, to] in [[k, (k + 1) % 4], [(k + 1) % 4, k]] {
            let at = file.point(&ends[from])?;
            let along = [0, 1].map(|a| ends[to][a] - ends[from][a]);
            let direction = file.entity(&format!("DIRECTION('',({}.,{}.))", along[0], along[1]))?;
            let vector = file.entity(&format!("VECTOR('',{direction},1.)"))?;
            let line = file.entity(&format!("LINE('',{at},{vector})"))?;
            made.push(file.entity(&format!("DEFINITIONAL_REPRESENTATION('',({line}),{planar})"))?);
        }
    }
    Ok(core::array::from_fn(|k| [made[2 * k], made[2 * k + 1]]))
}

/// Writes faces; edges, vertices and points once each.
struct Writer<'a> {
    of: &'a Boundary,
    file: Part21<'a>,
    /// The sides of the parameter square.
    lines: [[Id; 2]; 4],
    points: Vec<Option<Id>>,
    vertices: Vec<Option<Id>>,
    /// The inner control points of edges.
    inner: Vec<Option<[Id; 2]>>,
    edges: Vec<Option<Id>>,
    /// The curves of edges in the parameter planes of patches.
    flat: Vec<Vec<Id>>,
    surfaces: Vec<Option<Id>>,
}

impl Writer<'_> {
    fn solid(&mut self, shells: &[Id]) -> io::Result<Id> {
        let [outer, voids @ ..] = shells else { return Err(io::ErrorKind::InvalidInput.into()) };
        if voids.is_empty() {
            return self.file.entity(&format!("MANIFOLD_SOLID_BREP('',{outer})"));
        }
        let mut oriented = Vec::with_capacity(voids.len());
        for void in voids {
            oriented.push(self.file.entity(&format!("ORIENTED_CLOSED_SHELL('',*,{void},.T.)"))?);
        }
        self.file.entity(&format!("BREP_WITH_VOIDS('',{outer},{})", list(&oriented)))
    }

    fn point(&mut self, vertex: u32) -> io::Result<Id> {
        if let Some(known) = self.points[vertex as usize] {
            return Ok(known);
        }
        let id = self.file.point(&rounded(self.of.vertices[vertex as usize]))?;
        self.points[vertex as usize] = Some(id);
        Ok(id)
    }

    fn vertex(&mut self, vertex: u32) -> io::Result<Id> {
        if let Some(known) = self.vertices[vertex as usize] {
            return Ok(known);
        }
        let point = self.point(vertex)?;
        let id = self.file.entity(&format!("VERTEX_POINT('',{point})"))?;
        self.vertices[vertex as usize] = Some(id);
        Ok(id)
    }

    /// The control points of a side, in its direction.
    fn controls(&mut self, (edge, forward): DirectedEdge) -> io::Result<[Id; 4]> {
        let [from, to] = self.of.edges[edge as usize].ends;
        let [first, last] = [self.point(from)?, self.point(to)?];
        let [a, b] = match self.inner[edge as usize] {
            Some(known) => known,
            None => {
                let curve = self.of.curve((edge, true));
                let made = [self.file.point(&rounded(curve[1]))?, self.file.point(&rounded(curve[2]))?];
                self.inner[edge as usize] = Some(made);
                made
            }
        };
        Ok(if forward { [first, a, b, last] } else { [last, b, a, first] })
    }

    /// The surface of a face, and its sides in the parameter plane.
    fn surface(&mut self, f: u32) -> io::Result<()> {
        let of = self.of;
        let face = &of.faces[f as usize];
        let id = match &face.carrier {
            Carrier::Patch(patch) => {
                let sides: [DirectedEdge; 4] = core::array::from_fn(|k| face.loops[0][k]);
                let id = self.patch(patch, sides)?;
                for (k, (edge, forward)) in sides.into_iter().enumerate() {
                    let curve =
                        self.file.entity(&format!("PCURVE('',{id},{})", self.lines[k][usize::from(!forward)]))?;
                    self.flat[edge as usize].push(curve);
                }
                id
            }
            Carrier::Plane(plane) => {
                let n = outward(*plane);
                let side = outward((plane / 2 + 1) % 3 * 2 + 1);
                let [z, x] = [self.file.direction(n)?, self.file.direction(side)?];
                let at = self.file.point(&corner(&of.bounds, if plane % 2 == 1 { 7 } else { 0 }))?;
                let placement = self.file.entity(&format!("AXIS2_PLACEMENT_3D('',{at},{z},{x})"))?;
                self.file.entity(&format!("PLANE('',{placement})"))?
            }
        };
        self.surfaces[f as usize] = Some(id);
        Ok(())
    }

    fn patch(&mut self, patch: &BicubicPatch, sides: [DirectedEdge; 4]) -> io::Result<Id> {
        let [bottom, right, mut top, mut left] =
            [self.controls(sides[0])?, self.controls(sides[1])?, self.controls(sides[2])?, self.controls(sides[3])?];
        top.reverse();
        left.reverse();
        let mut rows = Vec::with_capacity(4);
        for i in 0..4 {
            let mut row = match i {
                0 => left,
                3 => right,
                _ => [bottom[i]; 4],
            };
            row[3] = top[i];
            for j in [1, 2].into_iter().filter(|_| i == 1 || i == 2) {
                row[j] = self.file.point(&rounded(patch[i][j]))?;
            }
            rows.push(list(row));
        }
        self.file.entity(&format!(
            "B_SPLINE_SURFACE_WITH_KNOTS('',3,3,{},.UNSPECIFIED.,.F.,.F.,.F.,(4,4),(4,4),(0.,1.),(0.,1.),.UNSPECIFIED.)",
            list(&rows)
        ))
    }

    fn edge(&mut self, edge: u32) -> io::Result<Id> {
        if let Some(known) = self.edges[edge as usize] {
            return Ok(known);
        }
        let of = &self.of.edges[edge as usize];
        let [from, to] = of.ends;
        let curve = match of.curve {
            Some(_) => {
                let points = self.controls((edge, true))?;
                let space = self.file.entity(&spline_curve(&points, None))?;
                let flat = list(&self.flat[edge as usize]);
                self.file.entity(&format!("SURFACE_CURVE('',{space},{flat},.CURVE_3D.)"))?
            }
            None => {
                let [a, b] = [from, to].map(|v| rounded(self.of.vertices[v as usize]));
                let at = self.point(from)?;
                let along = sub(b, a);
                let direction = self.file.direction(scale(along, 1.0 / norm(along).max(f64::MIN_POSITIVE)))?;
                let vector = self.file.entity(&format!("VECTOR('',{direction},1.)"))?;
                self.file.entity(&format!("LINE('',{at},{vector})"))?
            }
        };
        let [from, to] = [self.vertex(from)?, self.vertex(to)?];
        let id = self.file.entity(&format!("EDGE_CURVE('',{from},{to},{curve},.T.)"))?;
        self.edges[edge as usize] = Some(id);
        Ok(id)
    }

    fn face(&mut self, f: u32) -> io::Result<Id> {
        let of = self.of;
        let mut bounds = Vec::new();
        for (k, walked) in of.faces[f as usize].loops.iter().enumerate() {
            let mut oriented = Vec::with_capacity(walked.len());
            for (edge, forward) in walked {
                let id = self.edge(*edge)?;
                let sense = if *forward { 'T' } else { 'F' };
                oriented.push(self.file.entity(&format!("ORIENTED_EDGE('',*,*,{id},.{sense}.)"))?);
            }
            let edges = self.file.entity(&format!("EDGE_LOOP('',{})", list(&oriented)))?;
            let kind = if k == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            bounds.push(self.file.entity(&format!("{kind}('',{edges},.T.)"))?);
        }
        let surface = self.surfaces[f as usize].ok_or(io::ErrorKind::InvalidInput)?;
        self.file.entity(&format!("ADVANCED_FACE('',{},{surface},.T.)", list(&bounds)))
    }
}
