//! Reading of 3MF: what the build items place, in millimetres.

use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io::{self, BufRead, BufReader, Cursor, Read};

use quick_xml::events::{BytesStart, Event};
use zip::ZipArchive;
use zip::result::ZipError;

use super::MODEL;
use super::model::{Lattice, ModelFile, Object, ObjectReference, PlacedObject, Placement, Source};
use crate::fault::{Fault, counted};
use crate::formats::join::Joiner;
use crate::formats::text::{parse, shown};
use crate::formats::xml::{Scanner, attribute, attribute_where};
use crate::math::{Vec3, determinant, scale};
use crate::mesh::Mesh;

/// Components may nest this deep; deeper is a loop.
const DEPTH: usize = 32;

/// What all files of an archive may inflate to: a multiple of the archive's size, and a constant. Meshes come to ten times.
const MOST: (u64, u64) = (100, 1 << 24);

fn fault(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// An archive in memory.
struct Package<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// Numbers of the files by name: small letters, no leading slash.
    names: HashMap<String, usize>,
    size: usize,
    /// Bytes that may yet be inflated.
    left: u64,
}

fn plain(name: &str) -> String {
    name.trim_start_matches('/').to_ascii_lowercase()
}

impl<'a> Package<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, Fault> {
        let size = bytes.len();
        let zip = ZipArchive::new(Cursor::new(bytes))
            .map_err(|_| fault(format!("no ZIP directory in {size} bytes: truncated or not 3MF")))?;
        let mut names = HashMap::new();
        for i in 0..zip.len() {
            if let Some(Ok(name)) = zip.name_for_index(i) {
                names.entry(plain(&name)).or_insert(i);
            }
        }
        Ok(Package { zip, names, size, left: MOST.0 * size as u64 + MOST.1 })
    }

    /// What `parse` makes of a file of the archive as it is inflated; its size and checksum are checked.
    fn file<T>(&mut self, name: &str, parse: impl FnOnce(&mut dyn BufRead) -> Result<T, Fault>) -> Result<T, Fault> {
        let index =
            *self.names.get(&plain(name)).ok_or_else(|| fault(format!("the archive holds no \"{name}\": not 3MF")))?;
        let file = self.zip.by_index(index).map_err(|e| match e {
            ZipError::UnsupportedArchive(ZipError::PASSWORD_REQUIRED) => {
                fault(format!("\"{name}\" is encrypted: save the file without a password"))
            }
            ZipError::CompressionMethodNotSupported(m) => {
                fault(format!("\"{name}\" is packed by method {m}: only 0 and 8 (deflate) are read"))
            }
            e => fault(format!("\"{name}\" is damaged or truncated: {e}")),
        })?;
        let size = file.size();
        self.left = self.left.checked_sub(size).ok_or_else(|| {
            let (of, most) = (self.size, MOST.0);
            fault(format!("\"{name}\" inflates to {size} bytes, from an archive of {of}: more than {most} times as much is no mesh"))
        })?;
        let mut content = BufReader::with_capacity(1 << 16, file.take(size + 1));
        let parsed = parse(&mut content);
        // The checksum is known at the end. A damaged file is called so, whatever its text seemed to say.
        io::copy(&mut content, &mut io::sink()).map_err(|e| fault(format!("\"{name}\" is damaged: {e}")))?;
        if content.into_inner().limit() != 1 {
            return Err(fault(format!("\"{name}\" does not inflate to {size} bytes: damaged")));
        }
        parsed
    }
}

/// Reads the objects that the build places (supports left out), joined to one mesh in mm.
pub fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    joined(bytes, ObjectFilter::Placed)
}

/// Reads one of the objects that the build places, by its name, in mm.
pub fn read_object(bytes: &[u8], name: &str) -> Result<Mesh, Fault> {
    joined(bytes, ObjectFilter::Named(name))
}

/// The names of the objects that the build places, in its order; empty where they have none.
pub fn object_names(bytes: &[u8]) -> Result<Vec<String>, Fault> {
    let mut package = Package::open(bytes)?;
    let root = root_of(&mut package);
    Ok(names(&package.file(&root, model)?))
}

fn names(main: &ModelFile) -> Vec<String> {
    main.items.iter().map(|i| main.objects.get(&i.id).map(|o| o.name.clone()).unwrap_or_default()).collect()
}

fn joined(bytes: &[u8], filter: ObjectFilter) -> Result<Mesh, Fault> {
    let mut joiner = Joiner::default();
    let held = place_all(bytes, filter, &mut |placed| {
        if placed.object.slices {
            let message =
                "the file holds slices, and triangles that only stand for them; read the design or a mesh of it";
            return Err(Fault::new("", message));
        }
        let mirrored = determinant(&placed.matrix) < 0.0;
        for &[a, b, c] in &placed.object.triangles {
            let t = if mirrored { [a, c, b] } else { [a, b, c] };
            joiner.triangle(t.map(|v| placed.vertices[v as usize]))?;
        }
        Ok(())
    })?;
    let mesh = joiner.finish();
    if held.items == 0 {
        let objects = counted(held.objects, "object");
        return Err(Fault::new("", format!("{objects}, but the build places none of them")));
    }
    if mesh.triangles.is_empty() && held.lattices > 0 {
        return Err(Fault::new("", "the file holds beams and no triangle; beams are read with [beams.NAME] and path"));
    }
    Ok(mesh)
}

/// Which objects of a file are given.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum ObjectFilter<'a> {
    /// Those that the build places.
    Placed,
    /// Those of a name that it places.
    Named(&'a str),
    /// Beam lattices, where they are defined.
    Lattices,
}

/// Numbers of what a file holds.
pub(super) struct Contents {
    /// Objects of the main model.
    objects: usize,
    /// Uses of them by the build.
    items: usize,
    /// Beam lattices.
    lattices: usize,
}

/// Gives objects (supports left out) where they are, and what there is.
pub(super) fn place_all(
    bytes: &[u8],
    filter: ObjectFilter,
    take: &mut dyn FnMut(&PlacedObject) -> Result<(), Fault>,
) -> Result<Contents, Fault> {
    let mut package = Package::open(bytes)?;
    let root = root_of(&mut package);
    let mut main = package.file(&root, model)?;
    if let ObjectFilter::Named(name) = filter {
        let known = names(&main);
        let mut of = known.iter().map(|n| n == name);
        main.items.retain(|_| of.next().unwrap_or(false));
        if main.items.is_empty() {
            let listed = known.iter().filter(|n| !n.is_empty()).cloned().collect::<Vec<String>>().join(", ");
            let there =
                if listed.is_empty() { "its objects have no names".into() } else { format!("there are {listed}") };
            return Err(Fault::new("", format!("no object is named {}; {there}", shown(name.as_bytes()))));
        }
    }
    if filter == ObjectFilter::Lattices {
        let mut ids: Vec<u32> = main.objects.iter().filter(|o| o.1.lattice.is_some()).map(|o| *o.0).collect();
        ids.sort_unstable();
        main.items =
            ids.into_iter().map(|id| ObjectReference { path: String::new(), id, placement: Placement::NONE }).collect();
    }
    let mut files = HashMap::new();
    let (unit, items, objects) = (main.unit, main.items.len(), main.objects.len());
    let mut waiting: Vec<String> = outside(&main).collect();
    files.insert(String::new(), main);
    while let Some(path) = waiting.pop() {
        if let Entry::Vacant(place) = files.entry(path) {
            let part = package.file(place.key(), model)?;
            waiting.extend(outside(&part));
            place.insert(part);
        }
    }
    // Instances multiply what the file holds; a small file that asks for billions is refused.
    let held: usize = files.values().flat_map(|f| f.objects.values()).map(Object::size).sum();
    let mut traversal = BuildTraversal { files: &files, unit, take, left: 10_000_000 + 64 * held, uses: 0 };
    for i in 0..items {
        traversal.place("", &files[""].items[i], &Placement::NONE, 0)?;
    }
    Ok(Contents { objects, items, lattices: files.values().map(ModelFile::lattices).sum() })
}

/// The name of the main model.
fn root_of(package: &mut Package) -> String {
    let root = package.file("_rels/.rels", |text| Ok(target(text))).ok().flatten();
    let models = || package.names.iter().filter(|n| n.0.ends_with(".model")).min_by_key(|n| n.1).map(|n| n.0.clone());
    root.or_else(models).unwrap_or_else(|| MODEL.to_string())
}

/// The path of the model from the package's relationships.
fn target(relations: &mut dyn BufRead) -> Option<String> {
    let (mut buffer, mut s) = (Vec::new(), Scanner::new(relations, "relationships"));
    loop {
        match s.next(&mut buffer).ok()? {
            Event::Start(tag) | Event::Empty(tag)
                if attribute(&tag, "Type").is_some_and(|t| t.ends_with("/3dmodel")) =>
            {
                return Some(attribute(&tag, "Target")?.into_owned());
            }
            Event::Eof => return None,
            _ => {}
        }
    }
}

/// Other files that a model's components and items name.
fn outside(model: &ModelFile) -> impl Iterator<Item = String> {
    let uses = model.objects.values().flat_map(|o| &o.components).chain(&model.items);
    uses.filter(|u| !u.path.is_empty()).map(|u| u.path.clone())
}

/// The objects of a build as they are reached through their components, and what may yet come of them.
struct BuildTraversal<'a> {
    files: &'a HashMap<String, ModelFile>,
    unit: f64,
    take: &'a mut dyn FnMut(&PlacedObject) -> Result<(), Fault>,
    left: usize,
    uses: usize,
}

impl BuildTraversal<'_> {
    fn place(&mut self, path: &str, of: &ObjectReference, outer: &Placement, depth: usize) -> Result<(), Fault> {
        let path = if of.path.is_empty() { path } else { &of.path };
        let files = self.files;
        let Some(object) = files.get(path).and_then(|f| f.objects.get(&of.id)) else {
            return Err(Fault::new("", format!("object {} is placed but does not exist", of.id)));
        };
        if depth > DEPTH {
            return Err(Fault::new("", format!("object {} holds itself, or nests deeper than {DEPTH}", of.id)));
        }
        self.uses += 1;
        let size = object.size();
        if size > self.left || self.uses > 1_000_000 {
            return Err(Fault::new("", "the components multiply to more triangles than the file can mean"));
        }
        self.left -= size;
        if object.is_support() {
            return Ok(());
        }
        let placement = outer.after(&of.placement);
        let vertices: Vec<Vec3> = object.vertices.iter().map(|v| scale(placement.of(*v), self.unit)).collect();
        if vertices.iter().flatten().any(|x| !x.is_finite()) {
            return Err(Fault::new("", format!("object {} is placed at coordinates that are not finite", of.id)));
        }
        (self.take)(&PlacedObject { object, matrix: placement.m, vertices, unit: self.unit })?;
        object.components.iter().try_for_each(|c| self.place(path, c, &placement, depth + 1))
    }
}

/// A model file as it is read.
#[derive(Default)]
struct ModelParser {
    model: ModelFile,
    /// What stands before the core's element names: empty, or "c:" and the like. Extensions have another.
    prefix: Option<String>,
    object: Option<(u32, Object)>,
}

/// Parses one model file.
fn model(text: &mut dyn BufRead) -> Result<ModelFile, Fault> {
    let (mut buffer, mut s) = (Vec::new(), Scanner::new(text, "3MF model"));
    let mut parser = ModelParser::default();
    loop {
        match s.next(&mut buffer)? {
            Event::Start(tag) => parser.start(&s, &tag)?,
            Event::Empty(tag) => {
                parser.start(&s, &tag)?;
                parser.end(&s, tag.name().into_inner())?;
            }
            Event::End(tag) => parser.end(&s, tag.name().into_inner())?,
            Event::Eof if parser.prefix.is_none() => return Err(s.fault("no XML: truncated or not 3MF")),
            Event::Eof => return Ok(parser.model),
            _ => {}
        }
    }
}

impl ModelParser {
    fn start(&mut self, s: &Source, tag: &BytesStart) -> Result<(), Fault> {
        let name = tag.name().into_inner();
        let Some(prefix) = &self.prefix else {
            let Some(prefix) = name.strip_suffix("model") else {
                return Err(s.fault(format!("the root is {}, not a 3MF model", shown(name.as_bytes()))));
            };
            self.prefix = Some(prefix.to_string());
            self.model.unit = unit(s, tag)?;
            return Ok(());
        };
        let local = name.rsplit(':').next().unwrap_or(name);
        match (name.strip_prefix(prefix.as_str()), &mut self.object) {
            (Some("object"), None) => {
                let kind = attribute(tag, "type").map_or("model".into(), Cow::into_owned);
                let properties = attribute(tag, "pid").is_some() && attribute(tag, "pindex").is_some();
                let name = attribute(tag, "name").map_or(String::new(), Cow::into_owned);
                // Of the slice extension: the mesh is a coarse one that stands for the slices.
                let slices = attribute_where(tag, |n| n.ends_with(":slicestackid")).is_some()
                    && attribute_where(tag, |n| n.ends_with(":meshresolution")).is_some_and(|v| v == "lowres");
                let object = Object { kind, name, slices, properties, ..Object::default() };
                self.object = Some((s.required(tag, "id")?, object));
            }
            (_, Some((_, o))) if local == "beamlattice" => o.lattice = Some(Lattice::begin(s, tag)?),
            (Some("vertex"), Some((_, o))) => o.vertices.push(vertex(s, tag)?),
            (Some("triangle"), Some((_, o))) => {
                o.triangles.push([s.required(tag, "v1")?, s.required(tag, "v2")?, s.required(tag, "v3")?]);
            }
            (Some("component"), Some((_, o))) => o.components.push(using(s, tag)?),
            (Some("item"), None) => self.model.items.push(using(s, tag)?),
            (_, Some((_, Object { lattice: Some(lattice), .. }))) => lattice.element(s, tag, local)?,
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self, s: &Source, name: &str) -> Result<(), Fault> {
        let prefix = self.prefix.as_deref().unwrap_or_default();
        if name.strip_prefix(prefix) == Some("object")
            && let Some((id, o)) = self.object.take()
        {
            check(s, id, &o)?;
            if let Some(lattice) = &o.lattice {
                lattice.check(s, id, &o, &self.model.objects)?;
            }
            self.model.objects.insert(id, o);
        }
        Ok(())
    }
}

fn unit(s: &Source, tag: &BytesStart) -> Result<f64, Fault> {
    let name = attribute(tag, "unit").unwrap_or("millimeter".into());
    Ok(match &*name {
        "micron" => 0.001,
        "millimeter" => 1.0,
        "centimeter" => 10.0,
        "inch" => 25.4,
        "foot" => 304.8,
        "meter" => 1000.0,
        _ => {
            let known = "micron, millimeter, centimeter, inch, foot, meter";
            return Err(s.fault(format!("the unit {} is none of {known}", shown(name.as_bytes()))));
        }
    })
}

/// A vertex, in single precision as the format's other readers hold it.
fn vertex(s: &Source, tag: &BytesStart) -> Result<Vec3, Fault> {
    let mut p = [f64::NAN; 3];
    for (a, name) in ["x", "y", "z"].iter().enumerate() {
        let v: f32 = s.required(tag, name)?;
        if !v.is_finite() {
            return Err(s.fault(format!("{name} = {v} is not finite")));
        }
        p[a] = f64::from(v);
    }
    Ok(p)
}

fn using(s: &Source, tag: &BytesStart) -> Result<ObjectReference, Fault> {
    let mut placement = Placement::NONE;
    if let Some(text) = attribute(tag, "transform") {
        let v: Option<Vec<f64>> = text.split_ascii_whitespace().map(|w| parse(w.as_bytes())).collect();
        let v = v.filter(|v| v.len() == 12 && v.iter().all(|x| x.is_finite()));
        let v = v.ok_or_else(|| s.fault(format!("the transform {} is not twelve numbers", shown(text.as_bytes()))))?;
        // Rows of the file multiply row vectors: its columns are ours.
        for i in 0..3 {
            placement.m[i] = [v[i], v[3 + i], v[6 + i]];
            placement.shift[i] = v[9 + i];
        }
    }
    // The production extension's path, under whatever prefix.
    let path = attribute_where(tag, |n| n.ends_with(":path")).map(Cow::into_owned).unwrap_or_default();
    Ok(ObjectReference { path, id: s.required(tag, "objectid")?, placement })
}

fn check(s: &Source, id: u32, o: &Object) -> Result<(), Fault> {
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
    use super::super::package::{self, DeflatedChunk, Entry};
    use super::super::write;
    use super::*;
    use crate::formats::Metadata;
    use crate::formats::tests::{refuses_damage, tetrahedron};

    fn archive(entries: &mut [Entry]) -> Vec<u8> {
        let mut bytes = Vec::new();
        package::write(entries, package::LIMIT, &mut bytes).unwrap();
        bytes
    }

    fn pack(model: &str) -> Vec<u8> {
        let mut aside = Vec::new();
        let mut entry = Entry::new(MODEL, &mut aside);
        entry.push(DeflatedChunk::of(model.as_bytes())).unwrap();
        archive(&mut [entry])
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
        write(&mesh, &meta, &mut Vec::new(), &mut bytes).unwrap();
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

    #[test]
    fn blanks_without_end_are_refused_before_they_are_made() {
        let (mut first, mut second) = (Vec::new(), Vec::new());
        let mut long = Entry::new("blanks", &mut first);
        let blanks = vec![b'\n'; 1 << 20];
        (0..60).for_each(|_| long.push(DeflatedChunk::of(&blanks)).unwrap());
        let mut short = Entry::new("some", &mut second);
        (0..9).for_each(|_| short.push(DeflatedChunk::of(&blanks)).unwrap());
        let bytes = archive(&mut [long, short]);
        let mut package = Package::open(&bytes).unwrap();
        let message = package.file("blanks", |_| Ok(())).unwrap_err().message;
        assert!(message.contains("62914560") && message.contains("100 times"), "{message}");
        // What is inflated twice counts twice.
        assert!((0..99).any(|_| package.file("some", |_| Ok(())).is_err()));
    }

    #[test]
    fn a_damaged_file_is_called_so() {
        let good = pack(&format!("<model><resources><object id=\"1\">{SHAPE}</object></resources></model>"));
        let name = |e: Fault| e.message;
        // The checksum of the central directory.
        let at = good.windows(4).position(|w| w == 0x0201_4b50u32.to_le_bytes()).unwrap() + 16;
        let mut bad = good.clone();
        bad[at] ^= 1;
        assert!(name(read(&bad).unwrap_err()).contains("damaged"));
        // A size that is one more than there is.
        let mut bad = good.clone();
        bad[at + 8] = bad[at + 8].wrapping_add(1);
        assert!(name(read(&bad).unwrap_err()).contains("damaged"));
        // A directory that claims 65535 files.
        let mut bad = good.clone();
        let end = bad.len() - 22;
        bad[end + 8..end + 12].fill(0xff);
        assert!(read(&bad).is_err());
    }
}
