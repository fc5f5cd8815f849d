//! Line drawings as SVG: contours and edges with hidden lines left out, sections hatched.

use std::fmt::Write;

use rayon::prelude::*;

use super::hatching::hatching;
use super::paper::Paper;
use super::raster::Projected;
use super::section::SeenSection;
use super::space_lines::{LineKind, SpaceLine, space_lines};
use super::svg_path::path;
use super::visible_parts::{PicturePoint, PictureSamples, simpler};
use super::{BAND, Background, Camera, Marks, OVER, RenderOptions, View, legend, picture, png, svg_legend};
use crate::surface_mesh::SurfaceMesh;
use std::borrow::Cow;

/// Samples along the longer side of the picture by which lines are judged to be seen.
const SAMPLES: f64 = 3600.0;
/// Of the width of the picture: that of contours and of edges, of hatching, and from one line of it to the next.
const STROKES: [f64; 3] = [1.0 / 340.0, 1.0 / 500.0, 1.0 / 900.0];
const HATCH: f64 = 1.0 / 75.0;
/// Of the width of the picture: the length of edges that are too short to be drawn.
const CRUMB: f64 = 0.012;
/// Pixels of a picture behind lines.
const LARGEST_BEHIND: f64 = 2.5e7;

/// The page of a line drawing.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// Width and height in the unit.
    pub size: [f64; 2],
    /// `mm` or `px`.
    pub unit: &'a str,
    /// Width of contours in the unit, to which all other lines are in proportion; 1/340 of the page's width if not given.
    pub line_width: Option<f64>,
}

/// The text of an SVG file with what is seen of a surface as lines: contours, where it turns away from the eye; edges, where its faces meet at
/// more than 35°, where it ends and between lattice and cuts; the outline of a section, hatched; and marks. Colours and lines of the options are
/// seen in a picture behind that, as large as the view says in pixels, with their legend; the background is not drawn. Empty for views that
/// are no picture (see `render`), of which the page has the aspect.
pub fn line_drawing(surface: &SurfaceMesh, view: &View, options: &RenderOptions, page: &Page) -> String {
    let size = page.size;
    let [w, h] = view.size.map(|n| n as f64);
    let bounds = surface.mesh.bounds();
    if !(w > 0.0 && h > 0.0 && view.azimuth.is_finite() && view.elevation.is_finite()) {
        return String::new();
    }
    let paper = sheet(view);
    let samples = paper.size;
    // Pixels of the drawing for each sample.
    let part = size[0] / samples[0] as f64;
    let mut groups: [Vec<Vec<PicturePoint>>; 3] = Default::default();
    let mut hatched = Vec::new();
    let legend = legend::rows(options, view, &paper);
    let foot = legend::height(&legend, &paper);
    let coloured = options.colours.is_some() || options.lines.is_some();
    let mut per_mm = None;
    if !bounds.is_empty() && bounds.is_finite() {
        let section = options.section.map(|s| s.before_faces(&bounds));
        let section = section.as_ref();
        let shown = section.map_or_else(|| Cow::from(&surface.mesh.vertices), |s| Cow::from(s.kept(&surface.mesh)));
        let camera = Camera::new(&bounds, &shown, view, [samples[0], samples[1].saturating_sub(foot).max(1)]);
        let rows = samples[1].div_ceil(BAND) * BAND;
        let raster = Projected::of(surface, &camera, [samples[0], rows], section).draw(surface, 0, rows);
        let scale = camera.samples_per_mm(1.0 / camera.distance);
        let lines =
            space_lines(surface, options.normals.as_deref(), &camera, section, CRUMB * samples[0] as f64 / scale);
        let seen = PictureSamples { camera: &camera, raster: &raster };
        let parts: Vec<(LineKind, Vec<Vec<PicturePoint>>)> =
            lines.par_iter().map(|line| (line.kind, seen.parts(line))).collect();
        for (kind, lines) in parts {
            groups[kind as usize].extend(lines);
        }
        if section.is_some_and(|s| SeenSection::new(s, &camera).faces_the_eye()) {
            hatched = hatching(&polygons(&lines, &camera), HATCH * samples[0] as f64);
        }
        per_mm = Some(scale);
    }
    let drawn =
        groups.map(|lines| lines.into_iter().map(|line| line.iter().map(|p| p.map(|c| c * part)).collect()).collect());
    let hatched = hatched.iter().map(|line| line.map(|p| p.map(|c| c * part)).to_vec()).collect();
    let behind =
        if coloured { behind(surface, view, options, foot as f64 / samples[1] as f64, size) } else { String::new() };
    text(&drawn, &hatched, &behind, &svg_legend::text(&legend, &paper, part, per_mm), page)
}

/// The paper that lines are judged on, as fine as that takes.
fn sheet(view: &View) -> Paper {
    let [w, h] = view.size.map(|n| n as f64);
    let fine = SAMPLES / w.max(h);
    Paper { size: [w, h].map(|n| ((n * fine).round() as usize).max(1)), channels: 3, bytes: Vec::new() }
}

/// A picture of the surface with its colours, as an element of a drawing; `foot` is the share of the height that is free below the part.
fn behind(surface: &SurfaceMesh, view: &View, options: &RenderOptions, foot: f64, [w, h]: [f64; 2]) -> String {
    let pixels = view.size.map(|n| n as f64);
    let less = (LARGEST_BEHIND / (pixels[0] * pixels[1])).sqrt().min(1.0);
    let view = View { size: pixels.map(|n| ((n * less) as usize).max(1)), ..*view };
    let options = RenderOptions { background: Background::Transparent, ..options.clone() };
    let foot = (foot * (view.size[1] * OVER) as f64).round() as usize;
    let Some((rows, _)) = picture(surface, &view, &options, (foot, false), super::SAMPLES) else {
        return String::new();
    };
    let bytes = png(&rows, view.size, Background::Transparent.channels(), None);
    format!("<image width=\"{w}\" height=\"{h}\" xlink:href=\"data:image/png;base64,{}\"/>\n", base64(&bytes))
}

/// Bytes as text, by RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0u32, |bits, i| bits << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= three.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

/// Whether a line drawing has room for its legend and its marks.
pub fn line_drawing_fits(options: &RenderOptions, view: &View) -> bool {
    let bare = options.colours.is_none() && options.lines.is_none() && options.marks == Marks::default();
    bare || !legend::rows(options, view, &sheet(view)).is_empty()
}

/// The outlines of the section in the picture.
fn polygons(lines: &[SpaceLine], camera: &Camera) -> Vec<Vec<PicturePoint>> {
    let closed = lines.iter().filter(|line| line.kind == LineKind::Section);
    let place = |line: &SpaceLine| -> Vec<PicturePoint> {
        let placed = line.points.iter().map(|p| camera.project(p.at));
        simpler(&placed.map(|[x, y, _]| [x, y]).collect::<Vec<PicturePoint>>())
    };
    closed.map(place).collect()
}

/// The file.
fn text(
    groups: &[Vec<Vec<PicturePoint>>; 3],
    hatched: &Vec<Vec<PicturePoint>>,
    behind: &str,
    foot: &str,
    page: &Page,
) -> String {
    let [contours, edges, section] = groups;
    let Page { size: [w, h], unit, line_width } = *page;
    let widest = line_width.unwrap_or(STROKES[0] * w);
    let [strong, thin, fine] = STROKES.map(|share| share / STROKES[0] * widest);
    // A hundredth of a stroke.
    let digits = (1.5 - widest.log10()).ceil().clamp(0.0, 9.0) as usize;
    let link = if behind.is_empty() { "" } else { " xmlns:xlink=\"http://www.w3.org/1999/xlink\"" };
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\"{link} width=\"{w}{unit}\" height=\"{h}{unit}\" viewBox=\"0 0 {w} {h}\">\n\
         {behind}<g fill=\"none\" stroke=\"#000\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n"
    );
    for (name, width, lines) in [
        ("hatching", fine, hatched),
        ("edges", thin, edges),
        ("contours", strong, contours),
        ("section", strong, section),
    ] {
        if !lines.is_empty() {
            let _ =
                writeln!(out, "<path id=\"{name}\" stroke-width=\"{width:.digits$}\" d=\"{}\"/>", path(lines, digits));
        }
    }
    out.push_str(foot);
    out.push_str("</g>\n</svg>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests::{contour, sphere};
    use super::super::{Projection, SectionPlane};
    use super::*;
    use crate::mesh::Mesh;

    const VIEW: View = View { size: [400, 300], azimuth: 35.0, elevation: 25.0, projection: Projection::Perspective };

    fn page(size: [f64; 2], unit: &str) -> Page<'_> {
        Page { size, unit, line_width: None }
    }

    /// The points of a path by its name.
    fn lines(svg: &str, name: &str) -> Vec<Vec<PicturePoint>> {
        let Some(at) = svg.find(&format!("id=\"{name}\"")) else {
            return Vec::new();
        };
        let from = at + svg[at..].find(" d=\"").expect("path") + 4;
        let path = &svg[from..from + svg[from..].find('"').expect("end")];
        let whole = path.split('M').filter(|p| !p.is_empty());
        whole
            .map(|p| {
                let numbers: Vec<f64> =
                    p.trim_end_matches('Z').split(['L', ' ']).map(|v| v.parse().expect("number")).collect();
                let mut points: Vec<PicturePoint> = numbers.chunks(2).map(|c| [c[0], c[1]]).collect();
                if p.ends_with('Z') {
                    points.push(points[0]);
                }
                points
            })
            .collect()
    }

    /// Of a cube three sides are seen: nine of twelve edges, and no contour but along them.
    #[test]
    fn a_cube_is_nine_edges() {
        let mesh = Mesh::cuboid([0.0; 3], [1.0; 3]);
        let surface = SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh };
        let svg = line_drawing(&surface, &VIEW, &RenderOptions::default(), &page([85.0, 63.75], "mm"));
        assert!(svg.contains("width=\"85mm\" height=\"63.75mm\" viewBox=\"0 0 85 63.75\""));
        let found = lines(&svg, "edges");
        let bounds = surface.mesh.bounds();
        let camera = Camera::new(&bounds, &surface.mesh.vertices, &VIEW, [400, 300]);
        let place = |p: [f64; 3]| {
            let [x, y, _] = camera.project(p);
            [x, y].map(|c| c * 85.0 / 400.0)
        };
        // From +x +y +z the corner at the origin is hidden.
        let mut expected = 0.0;
        for (a, b) in [(1, 3), (1, 5), (3, 7), (5, 7), (2, 3), (2, 6), (6, 7), (4, 5), (4, 6)] {
            let corner = |i: usize| place(core::array::from_fn(|k| (i >> k & 1) as f64));
            let (p, q) = (corner(a), corner(b));
            expected += (p[0] - q[0]).hypot(p[1] - q[1]);
        }
        let total: f64 = found.iter().map(|line| super::super::visible_parts::length(line)).sum();
        // Each of the three hidden ends may be seen for the samples around it.
        assert!((total - expected).abs() < 6.0 * 8.0 * 85.0 / SAMPLES, "{total} {expected}");
        assert!(lines(&svg, "hatching").is_empty());
    }

    /// The contour of a ball is one circle of the radius at which the lens sees it.
    #[test]
    fn a_ball_is_one_circle() {
        let surface = sphere(40);
        let svg = line_drawing(&surface, &VIEW, &RenderOptions::default(), &page([400.0, 300.0], "px"));
        let found = lines(&svg, "contours");
        assert_eq!(found.len(), 1, "{svg:.300}");
        let span = |k: usize| found[0].iter().fold((f64::INFINITY, 0.0f64), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        let middle = [0, 1].map(|k| (span(k).0 + span(k).1) / 2.0);
        let radii: Vec<f64> = found[0].iter().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).collect();
        let (low, high) = radii.iter().fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(*r), h.max(*r)));
        // 92 % of the height, but for the chords of the mesh, (edge / radius)² / 8.
        assert!(low > 0.985 * 138.0 && high < 1.005 * 138.0, "{low} {high}");
        assert!(lines(&svg, "edges").is_empty());
        assert!(svg.len() < 20_000, "{}", svg.len());
    }

    /// A beam of six facets has edges along itself by its mesh, by the normals of the cylinder that it stands for two contours.
    #[test]
    fn a_beam_of_few_facets_is_drawn_by_its_normals() {
        const SIDES: usize = 6;
        let mut mesh = Mesh::default();
        let mut normals: Vec<[f32; 3]> = Vec::new();
        let out = |k: usize| {
            let (s, c) = (core::f64::consts::TAU * (k % SIDES) as f64 / SIDES as f64 + 0.3).sin_cos();
            [0.0, c, s]
        };
        for k in 0..SIDES {
            let [_, y, z] = out(k);
            mesh.vertices.extend([[-4.0, y, z], [4.0, y, z]]);
        }
        for k in 0..SIDES {
            let [a, b, c, d] =
                [2 * k, 2 * k + 1, (2 * k + 2) % (2 * SIDES), (2 * k + 3) % (2 * SIDES)].map(|v| v as u32);
            mesh.triangles.extend([[a, d, b], [a, c, d]]);
            for v in [k, k + 1, k, k, k + 1, k + 1] {
                normals.push(out(v).map(|n| n as f32));
            }
        }
        let surface = SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh };
        let view = View { azimuth: -90.0, elevation: 20.0, ..VIEW };
        let along = |normals: Option<Vec<[f32; 3]>>, name: &str| {
            let svg = line_drawing(
                &surface,
                &view,
                &RenderOptions { normals, ..RenderOptions::default() },
                &page([400.0, 300.0], "px"),
            );
            let long = |line: &Vec<PicturePoint>| (line[0][0] - line[line.len() - 1][0]).abs() > 200.0;
            lines(&svg, name).iter().filter(|line| long(line)).count()
        };
        assert!(along(None, "edges") >= 3);
        assert_eq!(along(Some(normals.clone()), "edges"), 0);
        assert_eq!(along(Some(normals), "contours"), 2);
    }

    /// Half a ball: the outline of the section is hatched by as much as it has area.
    #[test]
    fn a_section_is_hatched() {
        let surface = sphere(40);
        let eye = View { azimuth: 0.0, elevation: 0.0, ..VIEW };
        let section = Some(SectionPlane { normal: [1.0, 0.0, 0.0], offset: 0.5 });
        let options = RenderOptions { section, ..RenderOptions::default() };
        let svg = line_drawing(&surface, &eye, &options, &page([400.0, 300.0], "px"));
        let outline = lines(&svg, "section");
        assert_eq!(outline.len(), 1);
        let corners = &outline[0];
        let area = corners.windows(2).map(|p| (p[0][0] * p[1][1] - p[0][1] * p[1][0]) / 2.0).sum::<f64>().abs();
        let hatch = lines(&svg, "hatching");
        let total: f64 = hatch.iter().map(|line| super::super::visible_parts::length(line)).sum();
        assert!((total * 400.0 * HATCH / area - 1.0).abs() < 0.02, "{total} {area}");
        // From behind, the section is not seen.
        let behind = line_drawing(&surface, &View { azimuth: 180.0, ..eye }, &options, &page([400.0, 300.0], "px"));
        assert!(lines(&behind, "hatching").is_empty());
        assert_eq!(lines(&behind, "contours").len() + lines(&behind, "section").len(), 1);
    }

    /// Without perspective a box is as large as its sides at one scale, which is that of the bar.
    #[test]
    fn a_box_and_a_bar_are_of_one_scale() {
        let mesh = Mesh::cuboid([1.0, -2.0, 3.0], [13.0, 4.0, 11.0]);
        let surface = SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh };
        let view = View { azimuth: -90.0, elevation: 0.0, projection: Projection::Orthographic, size: [800, 600] };
        let options = RenderOptions { marks: Marks { scale_bar: true, axes: true }, ..RenderOptions::default() };
        let svg = line_drawing(&surface, &view, &options, &page([80.0, 60.0], "mm"));
        let span_in = |svg: &str, name: &str, k: usize| {
            let all = lines(svg, name).concat();
            all.iter().fold(0.0f64, |m, p| m.max(p[k])) - all.iter().fold(f64::INFINITY, |m, p| m.min(p[k]))
        };
        let span = |name: &str, k: usize| span_in(&svg, name, k);
        let scale = span("edges", 0) / 12.0;
        // Whole samples at either end.
        let step = 80.0 / SAMPLES;
        assert!((span("edges", 1) - 8.0 * scale).abs() < 2.0 * step, "{} {}", span("edges", 1), 8.0 * scale);
        let at = svg.find(" mm</text>").expect("words");
        let said: f64 = svg[svg[..at].rfind('>').expect("start") + 1..at].parse().expect("a number");
        assert!((span("scale_bar", 0) - said * scale).abs() < 2.0 * step, "{said}");
        assert_eq!(svg.matches("class=\"axis\"").count(), 3);
        let plain = line_drawing(&surface, &view, &RenderOptions::default(), &page([80.0, 60.0], "mm"));
        assert!(!plain.contains("<text") && !plain.contains("scale_bar"));
        // With no marks below, it fills the width but for the margins.
        assert!((span_in(&plain, "edges", 0) - 0.92 * 80.0).abs() < 2.0 * step);
    }

    /// What lies behind is not drawn, and the drawing is the same for any number of threads.
    #[test]
    fn the_same_for_any_number_of_threads_and_nothing_of_nothing() {
        let surface = contour(16, |p| (0..3).map(|k| (2.0 * core::f64::consts::TAU * p[k]).cos()).sum::<f64>());
        let drawn = || line_drawing(&surface, &VIEW, &RenderOptions::default(), &page([400.0, 300.0], "px"));
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("pool").install(drawn);
        assert_eq!(one, drawn());
        let nothing =
            line_drawing(&SurfaceMesh::default(), &VIEW, &RenderOptions::default(), &page([400.0, 300.0], "px"));
        assert!(!nothing.contains("<path"));
        assert!(
            line_drawing(&surface, &View { size: [0, 3], ..VIEW }, &RenderOptions::default(), &page([1.0, 1.0], "px"))
                .is_empty()
        );
    }
}
