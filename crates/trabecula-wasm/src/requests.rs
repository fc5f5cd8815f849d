//! What a page can ask, and the answers.

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::formats::{self, Metadata};
use geometry::math::Aabb;
use geometry::progress::{Progress, Silent, Stopped};
use geometry::surface_mesh::SurfaceMesh;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use trabecula::analysis::{thickness_at_vertices, usual_step};
use trabecula::design::{Built, Design, DesignError, Loader};
use trabecula::extract;
use trabecula::region::{Cuboid, Intersection, Region, SignedDistance};
use trabecula::report::{IslandsReport, MeshReport};
use trabecula::surface_maker::{Figures, MeshedSurface, SurfaceOptions};

use crate::corners::arrays;
use crate::edit::{Change, edit};
use crate::host;
use crate::rays::rays;
use crate::resolution::{self, Resolution};

/// Triangles of a mesh above which it is not drawn, and a picture of it must do.
const DRAWN: usize = 1_500_000;

/// Voxels at most of the thickness that colours a mesh: seconds.
const VOXELS: f64 = 4e6;

/// How many times the grid cells that are asked for make a picture of the whole wait.
const FAR: f64 = 5.0;

/// Grid cells of a picture above which its triangles are estimated first, and the most triangles of one.
const MANY: f64 = 1e6;
const LARGEST: f64 = 2e6;

/// A request. Bytes may follow.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
enum Request {
    /// What cells there are.
    Catalogue,
    /// The bytes of a file that designs name.
    File { name: String },
    /// Changes of a design's text.
    Edit { text: String, changes: Vec<Change> },
    /// A design, TOML or JSON, to be built.
    Open { text: String },
    /// The figures of the design, as `trabecula check --json`.
    Figures,
    /// Arrays of the surface on about this number of grid cells; of a middle part of it, if that is allowed and the whole takes many more,
    /// or if the whole has too many triangles for a picture.
    Picture {
        cells: f64,
        #[serde(default)]
        part: bool,
    },
    /// Textures by which a graphics card marches rays through the solid; those of the cell and of the region if they are wanted.
    Rays { cell: bool, region: bool },
    /// The surface as `trabecula mesh` makes it: its figures, and its arrays.
    Mesh { edge: Option<f64>, per_cell: Option<f64> },
    /// The local thickness of that surface's solid (mm), f32 for each vertex that was drawn; 0 where it is thinner than a voxel.
    Thickness,
    /// That surface as the bytes of a file.
    Write { suffix: String },
}

/// Why there is no answer.
enum Refused {
    Design(Box<DesignError>),
    Words(String),
}

impl From<DesignError> for Refused {
    fn from(e: DesignError) -> Refused {
        Refused::Design(Box::new(e))
    }
}

impl From<String> for Refused {
    fn from(words: String) -> Refused {
        Refused::Words(words)
    }
}

impl From<Stopped> for Refused {
    fn from(stopped: Stopped) -> Refused {
        Refused::Words(match stopped {
            Stopped::Interrupted => "stopped".into(),
            Stopped::Io(e) => e.to_string(),
            Stopped::Refused(fault) => fault.to_string(),
        })
    }
}

impl Refused {
    fn json(&self) -> Json {
        match self {
            Refused::Words(words) => json!({ "error": { "text": words, "message": words } }),
            Refused::Design(e) => json!({ "error": {
                "text": e.to_string(), "line": e.line, "path": e.path, "message": e.message, "nearest": e.nearest,
            } }),
        }
    }
}

/// JSON and bytes.
type Answer = Result<(Json, Vec<u8>), Refused>;

/// What is kept from one request to the next.
#[derive(Default)]
pub struct Session {
    files: DroppedFiles,
    built: Option<Built>,
    /// The design as the command would write it.
    text: String,
    made: Option<SurfaceMesh>,
    /// Of each vertex that was drawn of it, that of the surface.
    drawn: Vec<u32>,
}

/// Files that were given to the page, by name.
#[derive(Default)]
struct DroppedFiles(BTreeMap<String, Vec<u8>>);

impl Loader for DroppedFiles {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        let found = self.0.get(path).or_else(|| self.0.get(path.rsplit(['/', '\\']).next().unwrap_or(path)));
        found.cloned().ok_or_else(|| "the page does not have this file; drop it here".to_string())
    }
}

/// Progress that the page shows.
struct Shown;

impl Progress for Shown {
    fn step(&self, done: u64, total: u64) -> bool {
        host::progress(done as f64, total as f64);
        true
    }
}

impl Session {
    /// The answer to a request: a line of JSON, spaces up to a multiple of eight bytes, and bytes.
    pub fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        let end = request.iter().position(|b| *b == b'\n').unwrap_or(request.len());
        let bytes = request.get(end + 1..).unwrap_or_default();
        let read = serde_json::from_slice(&request[..end]).map_err(|e| Refused::Words(format!("request: {e}")));
        let (head, body) = read.and_then(|r| self.answered(r, bytes)).unwrap_or_else(|e| (e.json(), Vec::new()));
        let mut out = head.to_string().into_bytes();
        out.resize((out.len() + 1).next_multiple_of(8) - 1, b' ');
        out.push(b'\n');
        out.extend(body);
        out
    }

    fn answered(&mut self, request: Request, bytes: &[u8]) -> Answer {
        match request {
            Request::Catalogue => Ok((catalogue(), Vec::new())),
            Request::File { name } => {
                self.files.0.insert(name, bytes.to_vec());
                Ok((json!({}), Vec::new()))
            }
            Request::Edit { text, changes } => Ok((json!({ "text": edit(&text, &changes)? }), Vec::new())),
            Request::Open { text } => self.open(&text),
            Request::Figures => self.figures(),
            Request::Picture { cells, part } => picture(self.built()?, cells, part),
            Request::Rays { cell, region } => {
                Ok(rays(self.built()?, cell, region)?.unwrap_or_else(|| (json!({ "none": true }), Vec::new())))
            }
            Request::Mesh { edge, per_cell } => self.mesh(edge, per_cell),
            Request::Thickness => self.thickness(),
            Request::Write { suffix } => self.write(&suffix),
        }
    }

    fn built(&self) -> Result<&Built, Refused> {
        self.built.as_ref().ok_or_else(|| Refused::Words("there is no design".into()))
    }

    fn open(&mut self, text: &str) -> Answer {
        (self.built, self.made) = (None, None);
        let design =
            if text.trim_start().starts_with('{') { Design::from_json(text)? } else { Design::from_toml(text)? };
        let built = design.build(&self.files)?;
        let bounds = built.solid.region.bounds();
        let head = json!({
            "data": design.to_json(),
            "bounds": [bounds.min, bounds.max],
            "wavelength": built.solid.wavelength,
            "warnings": built.warnings,
            "repairs": built.repairs.iter().map(|(path, _)| path).collect::<Vec<_>>(),
        });
        self.text = design.to_toml().unwrap_or_default();
        self.built = Some(built);
        Ok((head, Vec::new()))
    }

    fn figures(&self) -> Answer {
        let built = self.built()?;
        let report = built.report();
        let mut head = serde_json::to_value(&report).map_err(|e| e.to_string())?;
        let error = if report.chord.is_none() { built.volume_error(report.spacing) } else { None };
        head["volume_error"] = json!(error);
        Ok((head, Vec::new()))
    }

    fn mesh(&mut self, edge: Option<f64>, per_cell: Option<f64>) -> Answer {
        self.made = None;
        let built = self.built()?;
        let resolution = resolution::of_mesh(built, edge, per_cell)?;
        let made = surface(built, resolution, &Shown)?;
        let surface = if built.is_open() { made.surface.uncapped() } else { made.surface };
        let edge = if let Resolution::Grid(edge) = resolution { edge } else { 0.0 };
        let volume = extract::region_volume(&built.solid.region, edge, &Silent)?;
        let figures = MeshReport::of(&Figures::of(&surface), true, Some(volume));
        let triangles = surface.mesh.triangles.len();
        let apart = &made.components;
        let words =
            (apart.others > apart.dropped).then(|| format!("the result is not in one piece: {}", apart.description()));
        let coarse = match resolution {
            Resolution::Grid(edge) => {
                built.coarse_steps(edge, figures.volume + apart.dropped_volume, apart.others as usize + 1)
            }
            Resolution::Chord(_) => None,
        };
        let notes: Vec<String> = words.into_iter().chain(coarse).collect();
        let (spacing, chord) = match resolution {
            Resolution::Grid(edge) => (Some(edge), None),
            Resolution::Chord(chord) => (None, Some(chord)),
        };
        let drawn = (triangles <= DRAWN).then(|| arrays(&surface));
        let head = json!({
            "figures": figures, "vertices": drawn.as_ref().map(|a| a.vertices.len()), "triangles": triangles, "edge": spacing, "chord": chord, "drawn": drawn.is_some(),
            "islands": IslandsReport::from(&made.components), "open": built.is_open(),
            "notes": notes,
        });
        self.made = Some(surface);
        let (vertices, bytes) = drawn.map_or_else(Default::default, |a| (a.vertices, a.bytes));
        self.drawn = vertices;
        Ok((head, bytes))
    }

    fn thickness(&self) -> Answer {
        let Some(surface) = &self.made else { return Err("there is no mesh yet".to_string().into()) };
        let [x, y, z] = surface.mesh.bounds().size();
        let step = usual_step(surface, None).max((x * y * z / VOXELS).cbrt());
        let found = thickness_at_vertices(surface, step, &Shown)?;
        let values: Vec<f32> = self.drawn.iter().map(|v| found[*v as usize] as f32).collect();
        let known = values.iter().filter(|t| t.is_finite());
        let (low, high) = known.fold((f32::INFINITY, 0.0f32), |(l, h), t| (l.min(*t), h.max(*t)));
        let bytes = values.iter().flat_map(|t| if t.is_finite() { *t } else { 0.0 }.to_le_bytes()).collect();
        Ok((json!({ "span": [low.min(high), high], "step": step }), bytes))
    }

    fn write(&self, suffix: &str) -> Answer {
        let Some(surface) = &self.made else { return Err("there is no mesh yet".to_string().into()) };
        // As the command does, so that the bytes are the same.
        let application = format!("Trabecula {}", env!("CARGO_PKG_VERSION"));
        let meta = Metadata { title: "Lattice part".into(), design: self.text.clone(), application };
        let mut bytes = Vec::new();
        formats::write_mesh(&surface.mesh, suffix, &meta, &mut bytes).map_err(|e| e.to_string())?;
        Ok((json!({ "bytes": bytes.len() }), bytes))
    }
}

fn surface(built: &Built, resolution: Resolution, progress: &dyn Progress) -> Result<MeshedSurface, Refused> {
    Ok(match resolution {
        Resolution::Grid(edge) => built.surface().mesh(&SurfaceOptions::new(edge), progress)?,
        Resolution::Chord(chord) => {
            let beams = built.beam_surface().map_err(Stopped::Refused)?;
            trabecula::SurfaceMaker::mesh(&beams, &SurfaceOptions::new(chord), progress)?
        }
    })
}

fn picture(built: &Built, cells: f64, part: bool) -> Answer {
    let resolution = resolution::of_picture(built, cells, LARGEST);
    let (edge, whole) = match resolution {
        Resolution::Grid(edge) => (Some(edge), resolution::cells(built, edge)),
        Resolution::Chord(_) => (None, cells),
    };
    let share = match edge {
        Some(_) if part && whole > FAR * cells => cells / whole,
        // Triangles grow as cells do, where the lattice is about as dense.
        Some(_) if whole > MANY => {
            resolution::resource_estimate(built, resolution).map_or(1.0, |n| LARGEST / n.triangles)
        }
        _ => 1.0,
    };
    let middle = match edge {
        Some(edge) if share < 1.0 => middle(built, edge, share.cbrt())?,
        _ => None,
    };
    let partly = middle.is_some();
    let (surface, bounds) = match middle {
        Some(found) => found,
        None => (surface(built, resolution, &Silent)?.surface, built.solid.region.bounds()),
    };
    let surface = if built.is_open() { surface.uncapped() } else { surface };
    let drawn = arrays(&surface);
    let head = json!({
        "triangles": surface.mesh.triangles.len(), "vertices": drawn.vertices.len(), "edge": edge,
        "cells": if partly { share * whole } else { whole }, "part": partly, "bounds": [bounds.min, bounds.max],
    });
    Ok((head, drawn.bytes))
}

/// The surface in a box in the middle of the region's bounds, this share of them along each axis; `None` where nothing is there.
fn middle(built: &Built, edge: f64, share: f64) -> Result<Option<(SurfaceMesh, Aabb)>, Refused> {
    let Built { solid, .. } = built;
    let bounds = solid.region.bounds();
    let at = |side: f64| {
        [0, 1, 2].map(|a| 0.5 * (bounds.min[a] + bounds.max[a] + side * share * (bounds.max[a] - bounds.min[a])))
    };
    let window: Region = Arc::new(Cuboid::new(at(-1.0), at(1.0)).map_err(Stopped::Refused)?);
    let both = Intersection::new(vec![solid.region.clone(), window]).map_err(Stopped::Refused)?;
    let seen = both.bounds();
    let (field, filled) = (solid.field.clone(), solid.filled.clone());
    let cropped = trabecula::Solid { region: Arc::new(both), field, filled, ..*solid };
    let surface = extract::surface(&cropped, edge, &Silent)?;
    Ok((!surface.mesh.triangles.is_empty()).then_some((surface, seen)))
}

fn catalogue() -> Json {
    let cells = trabecula::cell::catalogue().iter();
    let cells: Vec<Json> = cells.map(|c| json!({ "name": c.name, "title": c.title, "formula": c.formula })).collect();
    let graphs = beams::graph::catalogue().iter();
    let graphs: Vec<Json> = graphs.map(|c| json!({ "name": c.name, "title": c.title })).collect();
    json!({ "version": env!("CARGO_PKG_VERSION"), "cells": cells, "beams": graphs })
}
