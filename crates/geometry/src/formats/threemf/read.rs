//! Reading of 3MF: what the build items place, in millimetres.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::MODEL;
use super::xml::{Event, Scanner, attribute, required};
use super::zip::Archive;
use crate::fault::{Fault, counted};
use crate::formats::join::Joiner;
use crate::formats::text::{parse, shown};
use crate::math::{Mat3, Vec3, add, apply, determinant, scale};
use crate::mesh::Mesh;

/// Components may nest this deep; deeper is a loop.
const DEPTH: usize = 32;

/// x ↦ m x + shift.
#[derive(Clone, Copy)]
struct Placement {
    m: Mat3,
    shift: Vec3,
}

impl Placement {
    const NONE: Placement = Placement { m: crate::math::IDENTITY, shift: [0.0; 3] };

    fn of(&self, x: Vec3) -> Vec3 {
        add(apply(&self.m, x), self.shift)
    }

    /// This one after `inner`.
    fn after(&self, inner: &Placement) -> Placement {
        Placement { m: crate::math::product(&self.m, &inner.m), shift: self.of(inner.shift) }
    }
}

/// A use of an object: which file it is in (empty: the same), its number, and where it goes.
struct Use {
    path: String,
    id: u32,
    placement: Placement,
}

#[derive(Default)]
struct Object {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    components: Vec<Use>,
    support: bool,
}

#[derive(Default)]
struct Model {
    unit: f64,
    objects: HashMap<u32, Object>,
    items: Vec<Use>,
}

/// Reads the objects that the build places (supports left out), joined to one mesh in mm.
pub fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    let archive = Archive::new(bytes)?;
    let root = archive.file("_rels/.rels").ok().and_then(|r| target(&r));
    let root = root.or_else(|| archive.names().find(|n| n.to_ascii_lowercase().ends_with(".model")).map(String::from));
    let root = root.unwrap_or_else(|| MODEL.to_string());
    let main = model(&archive.file(&root)?)?;
    if main.items.is_empty() {
        return Err(Fault::new(
            "",
            format!("{}, but the build places none of them", counted(main.objects.len(), "object")),
        ));
    }
    let mut files = HashMap::new();
    let (unit, items) = (main.unit, main.items.len());
    let mut waiting: Vec<String> = outside(&main).collect();
    files.insert(String::new(), main);
    while let Some(path) = waiting.pop() {
        if let Entry::Vacant(place) = files.entry(path) {
            let part = model(&archive.file(place.key())?)?;
            waiting.extend(outside(&part));
            place.insert(part);
        }
    }
    // Instances multiply what the file holds; a small file that asks for billions is refused.
    let held: usize = files.values().flat_map(|f| f.objects.values()).map(|o| o.triangles.len()).sum();
    let mut placing = Placing { files: &files, unit, joiner: Joiner::default(), left: 10_000_000 + 64 * held, uses: 0 };
    for i in 0..items {
        placing.place("", &files[""].items[i], &Placement::NONE, 0)?;
    }
    Ok(placing.joiner.finish())
}

/// The path of the model from the package's relationships.
fn target(relations: &[u8]) -> Option<String> {
    let mut s = Scanner::new(relations);
    while let Ok(Some(event)) = s.next() {
        if let Event::Start { attributes, .. } = event
            && attribute(attributes, "Type").is_some_and(|t| t.ends_with(b"/3dmodel"))
        {
            return Some(String::from_utf8_lossy(&attribute(attributes, "Target")?).into_owned());
        }
    }
    None
}

/// Other files that a model's components and items name.
fn outside(model: &Model) -> impl Iterator<Item = String> {
    let uses = model.objects.values().flat_map(|o| &o.components).chain(&model.items);
    uses.filter(|u| !u.path.is_empty()).map(|u| u.path.clone())
}

struct Placing<'a> {
    files: &'a HashMap<String, Model>,
    unit: f64,
    joiner: Joiner,
    left: usize,
    uses: usize,
}

impl Placing<'_> {
    fn place(&mut self, path: &str, of: &Use, outer: &Placement, depth: usize) -> Result<(), Fault> {
        let path = if of.path.is_empty() { path } else { &of.path };
        let files = self.files;
        let Some(object) = files.get(path).and_then(|f| f.objects.get(&of.id)) else {
            return Err(Fault::new("", format!("object {} is placed but does not exist", of.id)));
        };
        if depth > DEPTH {
            return Err(Fault::new("", format!("object {} holds itself, or nests deeper than {DEPTH}", of.id)));
        }
        self.uses += 1;
        if object.triangles.len() > self.left || self.uses > 1_000_000 {
            return Err(Fault::new("", "the components multiply to more triangles than the file can mean"));
        }
        self.left -= object.triangles.len();
        if object.support {
            return Ok(());
        }
        let placement = outer.after(&of.placement);
        let vertices: Vec<Vec3> = object.vertices.iter().map(|v| scale(placement.of(*v), self.unit)).collect();
        if vertices.iter().flatten().any(|x| !x.is_finite()) {
            return Err(Fault::new("", format!("object {} is placed at coordinates that are not finite", of.id)));
        }
        let mirrored = determinant(&placement.m) < 0.0;
        for &[a, b, c] in &object.triangles {
            let t = if mirrored { [a, c, b] } else { [a, b, c] };
            self.joiner.triangle(t.map(|v| vertices[v as usize]))?;
        }
        object.components.iter().try_for_each(|c| self.place(path, c, &placement, depth + 1))
    }
}

/// Parses one model file.
fn model(bytes: &[u8]) -> Result<Model, Fault> {
    let mut s = Scanner::new(bytes);
    let mut model = Model::default();
    let mut prefix: &[u8] = b"";
    let mut started = false;
    let mut object: Option<(u32, Object)> = None;
    while let Some(event) = s.next()? {
        let (name, attributes, empty) = match event {
            Event::Start { name, attributes, empty } => (name, attributes, empty),
            Event::End { name } => (name, &[][..], true),
        };
        if !started {
            started = true;
            let Some(p) = name.strip_suffix(b"model") else {
                return Err(s.fault(format!("the root is {}, not a 3MF model", shown(name))));
            };
            prefix = p;
            model.unit = unit(&s, attributes)?;
            continue;
        }
        // Elements of extensions carry another prefix than the core's.
        let Some(local) = name.strip_prefix(prefix) else {
            continue;
        };
        if matches!(event, Event::End { .. }) || (local == b"object" && empty) {
            if local == b"object"
                && let Some((id, o)) = object.take()
            {
                check(&s, id, &o)?;
                model.objects.insert(id, o);
            }
            continue;
        }
        match (local, &mut object) {
            (b"object", None) => {
                let support =
                    attribute(attributes, "type").is_some_and(|t| matches!(&*t, b"support" | b"solidsupport"));
                object = Some((required(&s, attributes, "id")?, Object { support, ..Object::default() }));
            }
            (b"vertex", Some((_, o))) => o.vertices.push(vertex(&s, attributes)?),
            (b"triangle", Some((_, o))) => {
                let index = |n| required(&s, attributes, n);
                o.triangles.push([index("v1")?, index("v2")?, index("v3")?]);
            }
            (b"component", Some((_, o))) => o.components.push(using(&s, attributes)?),
            (b"item", None) => model.items.push(using(&s, attributes)?),
            _ => {}
        }
    }
    if !started {
        return Err(s.fault("no XML: truncated or not 3MF"));
    }
    Ok(model)
}

fn unit(s: &Scanner, attributes: &[u8]) -> Result<f64, Fault> {
    let name = attribute(attributes, "unit").unwrap_or(b"millimeter"[..].into());
    Ok(match &*name {
        b"micron" => 0.001,
        b"millimeter" => 1.0,
        b"centimeter" => 10.0,
        b"inch" => 25.4,
        b"foot" => 304.8,
        b"meter" => 1000.0,
        _ => {
            let known = "micron, millimeter, centimeter, inch, foot, meter";
            return Err(s.fault(format!("the unit {} is none of {known}", shown(&name))));
        }
    })
}

/// A vertex, in single precision as the format's other readers hold it.
fn vertex(s: &Scanner, attributes: &[u8]) -> Result<Vec3, Fault> {
    let mut p = [f64::NAN; 3];
    for (a, name) in ["x", "y", "z"].iter().enumerate() {
        let v: f32 = required(s, attributes, name)?;
        if !v.is_finite() {
            return Err(s.fault(format!("{name} = {v} is not finite")));
        }
        p[a] = f64::from(v);
    }
    Ok(p)
}

fn using(s: &Scanner, attributes: &[u8]) -> Result<Use, Fault> {
    let mut placement = Placement::NONE;
    if let Some(text) = attribute(attributes, "transform") {
        let v: Option<Vec<f64>> = super::super::text::words(&text).map(parse::<f64>).collect();
        let v = v.filter(|v| v.len() == 12 && v.iter().all(|x| x.is_finite()));
        let v = v.ok_or_else(|| s.fault(format!("the transform {} is not twelve numbers", shown(&text))))?;
        // Rows of the file multiply row vectors: its columns are ours.
        for i in 0..3 {
            placement.m[i] = [v[i], v[3 + i], v[6 + i]];
            placement.shift[i] = v[9 + i];
        }
    }
    // The production extension's path, under whatever prefix.
    let path = super::xml::attributes(attributes).find(|(n, _)| n.ends_with(b":path"));
    let path = path.map(|(_, v)| String::from_utf8_lossy(v).into_owned()).unwrap_or_default();
    Ok(Use { path, id: required(s, attributes, "objectid")?, placement })
}

fn check(s: &Scanner, id: u32, o: &Object) -> Result<(), Fault> {
    let count = o.vertices.len();
    match o.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= count)) {
        Some(i) => {
            let t = o.triangles[i];
            Err(s.fault(format!("triangle {i} of object {id} is {t:?}, but there are {count} vertices (from 0)")))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{write, zip};
    use super::*;
    use crate::formats::Metadata;
    use crate::formats::tests::{refuses_damage, tetrahedron};

    fn pack(model: &str) -> Vec<u8> {
        let mut entry = zip::Entry::new(MODEL);
        entry.push(zip::deflate(model.as_bytes()));
        let mut bytes = Vec::new();
        zip::write(&[entry], zip::LIMIT, &mut bytes).unwrap();
        bytes
    }

    const SHAPE: &str = "<mesh><vertices><vertex z=\"0\" x='0' y=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\" /><vertex x=\"0\" y=\"1\" \
                         z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"&#49;\"/></vertices><triangles><triangle v1=\"0\" v2=\"2\" v3=\"1\"/>\
                         <triangle v1=\"0\" v2=\"1\" v3=\"3\"/><triangle v1=\"0\" v2=\"3\" v3=\"2\"/><triangle v1=\"1\" v2=\"2\" \
                         v3=\"3\"/></triangles></mesh>";

    #[test]
    fn comes_back_as_rounded_to_single_precision() {
        let mut mesh = tetrahedron();
        mesh.vertices[3][2] = 1.0 / 3.0;
        let meta = Metadata { title: "a & <b>".into(), design: "x = 1 < 2\n".into(), application: "t".into() };
        let mut bytes = Vec::new();
        write(&mesh, &meta, &mut bytes).unwrap();
        let back = read(&bytes).unwrap();
        assert!(back.vertices.contains(&[0.0, 0.0, f64::from(1.0f32 / 3.0)]));
        assert_eq!(back.triangles.len(), 4);
        refuses_damage("3mf", &bytes, bytes.len());
    }

    #[test]
    fn units_items_components_and_mirrors() {
        let text = format!(
            "<?xml version=\"1.0\"?><c:model unit=\"inch\" xmlns:c=\"core\"><c:resources><c:object id=\"3\">{}</c:object>\
             <c:object id=\"4\"><c:components><c:component objectid=\"3\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/>\
             <c:component objectid=\"3\" transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/></c:components></c:object>\
             <c:object id=\"5\" type=\"support\">{0}</c:object><x:object/></c:resources><c:build>\
             <c:item objectid=\"4\" transform=\"0 2 0 -2 0 0 0 0 2 0 0 10\"/><c:item objectid=\"5\"/></c:build></c:model>",
            SHAPE.replace("</", "</c:").replace('<', "<c:").replace("<c:/c:", "</c:")
        );
        let mesh = read(&pack(&text)).unwrap();
        assert_eq!(mesh.triangles.len(), 8);
        let inch = 25.4f64;
        assert!((mesh.volume() - 2.0 * 8.0 / 6.0 * inch.powi(3)).abs() < 1e-8, "{}", mesh.volume());
        let b = mesh.bounds();
        // x' = −2y, y' = 2x: x from −2 to 0, y from −2 to 12, z from 10 to 12 inches.
        for (got, want) in b.min.iter().chain(&b.max).zip([-2.0, -2.0, 10.0, 0.0, 12.0, 12.0]) {
            assert!((got - want * inch).abs() < 1e-10, "{b:?}");
        }
    }

    #[test]
    fn models_that_cannot_be_are_refused() {
        let wrap = |unit: &str, items: &str, objects: &str| {
            format!("<model unit=\"{unit}\"><resources>{objects}</resources><build>{items}</build></model>")
        };
        let object = format!("<object id=\"1\">{SHAPE}</object>");
        let item = "<item objectid=\"1\"/>";
        assert!(read(&pack(&wrap("millimeter", item, &object))).is_ok());
        let looping =
            "<object id=\"1\"><components><component objectid=\"1\"/><component objectid=\"1\"/></components></object>";
        let cases = [
            (wrap("furlong", item, &object), "furlong"),
            (wrap("meter", "", &object), "places none"),
            (wrap("meter", "<item objectid=\"2\"/>", &object), "object 2"),
            (wrap("meter", item, looping), "holds itself"),
            (wrap("meter", item, &object.replace("v3=\"1\"", "v3=\"4\"")), "[0, 2, 4]"),
            (wrap("meter", item, &object.replace("x='0'", "x='nan'")), "not finite"),
            (wrap("meter", "<item objectid=\"1\" transform=\"1 0\"/>", &object), "twelve numbers"),
            ("<html></html>".to_string(), "html"),
            ("no".to_string(), "no XML"),
        ];
        for (text, word) in cases {
            let fault = read(&pack(&text)).unwrap_err();
            assert!(fault.message.contains(word), "{fault} ({word})");
        }
    }
}
