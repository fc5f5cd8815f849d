use super::*;
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;

/// A surface of a function on a cube by cutting the six tetrahedra of each grid cell, closed at the cube's faces.
pub(super) fn contour(n: usize, f: impl Fn(Vec3) -> f64) -> SurfaceMesh {
    let mut s = SurfaceMesh::default();
    let corner = |i: usize, k: usize| (i >> k) & 1;
    let mut ids = std::collections::HashMap::new();
    let point = |g: [usize; 3]| g.map(|c| c as f64 / n as f64);
    // Nodes on the outermost planes are outside; a cut face is a triangle with all corners near such a plane.
    let value = |g: [usize; 3]| {
        if g.iter().any(|c| *c == 0 || *c == n) { 1e-3 + f(point(g)).max(0.0) } else { f(point(g)) }
    };
    for cell in 0..n * n * n {
        let base = [cell % n, cell / n % n, cell / (n * n)];
        for path in [[1, 2, 4], [1, 4, 2], [2, 1, 4], [2, 4, 1], [4, 1, 2], [4, 2, 1]] {
            let ks = [0, path[0], path[0] + path[1], 7];
            let nodes = ks.map(|k| [0, 1, 2].map(|a| base[a] + corner(k, a)));
            let values = nodes.map(value);
            let (inside, outside): (Vec<usize>, Vec<usize>) = (0..4).partition(|i| values[*i] < 0.0);
            if inside.is_empty() || outside.is_empty() {
                continue;
            }
            let mut vertex = |i: usize, j: usize| {
                let (a, b) = (nodes[i].min(nodes[j]), nodes[i].max(nodes[j]));
                *ids.entry((a, b)).or_insert_with(|| {
                    let t = values[i] / (values[i] - values[j]);
                    let (p, q) = (point(nodes[i]), point(nodes[j]));
                    s.mesh.vertices.push(add(p, scale(sub(q, p), t)));
                    s.mesh.vertices.len() as u32 - 1
                })
            };
            let ring: Vec<u32> = match (inside.len(), outside.len()) {
                (2, 2) => {
                    [(0, 0), (0, 1), (1, 1), (1, 0)].iter().map(|&(i, j)| vertex(inside[i], outside[j])).collect()
                }
                _ => inside.iter().flat_map(|i| outside.iter().map(|j| (*i, *j))).map(|(i, j)| vertex(i, j)).collect(),
            };
            let out = sub(point(nodes[outside[0]]), point(nodes[inside[0]]));
            for k in 1..ring.len() - 1 {
                let mut t = [ring[0], ring[k], ring[k + 1]];
                let [a, b, c] = t.map(|v| s.mesh.vertices[v as usize]);
                if dot(cross(sub(b, a), sub(c, a)), out) < 0.0 {
                    t.swap(1, 2);
                }
                let edge = 1.5 / n as f64;
                let flat = (0..3)
                    .any(|k| [a, b, c].iter().all(|p| p[k] < edge) || [a, b, c].iter().all(|p| p[k] > 1.0 - edge));
                s.mesh.triangles.push(t);
                s.cut.push(flat);
            }
        }
    }
    s
}

/// A ball in the middle of the cube.
pub(super) fn sphere(n: usize) -> SurfaceMesh {
    contour(n, |p| norm(sub(p, [0.5; 3])) - 0.37)
}

fn gyroid(cells: f64) -> impl Fn(Vec3) -> f64 {
    move |p| {
        let [(sx, cx), (sy, cy), (sz, cz)] = p.map(|v| (v * cells * core::f64::consts::TAU).sin_cos());
        sx * cy + sy * cz + sz * cx
    }
}

const VIEW: View = View { size: [200, 150], azimuth: 35.0, elevation: 25.0, projection: Projection::Perspective };

#[test]
fn nothing_gives_the_background() {
    let rgb = render(&SurfaceMesh::default(), &VIEW, &RenderOptions::default());
    assert_eq!(rgb.len(), 200 * 150 * 3);
    assert!(rgb.iter().all(|v| *v > 200));
    assert!(render(&SurfaceMesh::default(), &View { size: [0, 9], ..VIEW }, &RenderOptions::default()).is_empty());
    assert!(
        render(&SurfaceMesh::default(), &View { size: [usize::MAX, 2], ..VIEW }, &RenderOptions::default()).is_empty()
    );
}

#[test]
fn one_triangle_fills_what_it_should() {
    let mesh =
        Mesh { vertices: vec![[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 1.0, 1.0]], triangles: vec![[0, 1, 2]] };
    // Seen along −x it is half of a square that fills 92 % of the height.
    let s = SurfaceMesh { mesh, cut: vec![false] };
    let view = View { azimuth: 0.0, elevation: 0.0, size: [200, 200], ..VIEW };
    let (with, without) = (
        render(&s, &view, &RenderOptions::default()),
        render(&SurfaceMesh::default(), &view, &RenderOptions::default()),
    );
    let pixels = with.chunks(3).zip(without.chunks(3)).filter(|(a, b)| a != b).count() as f64;
    let want = 0.5 * (0.92f64 * 200.0).powi(2);
    assert!((pixels / want - 1.0).abs() < 0.02, "{pixels} {want}");
    // Every side sees something, even the back of an open mesh, a point, and a number that is none.
    for azimuth in [90.0, 180.0, f64::NAN] {
        assert_eq!(render(&s, &View { azimuth, ..view }, &RenderOptions::default()).len(), 200 * 200 * 3);
    }
    let point = SurfaceMesh { mesh: Mesh { vertices: vec![[1.0; 3]], triangles: vec![[0, 0, 0]] }, cut: vec![] };
    assert_eq!(render(&point, &view, &RenderOptions::default()), without);
}

#[test]
fn nearer_hides_farther_and_cut_differs_from_lattice() {
    let square = |x: f64| [[x, -1.0, -1.0], [x, 1.0, -1.0], [x, 1.0, 1.0], [x, -1.0, 1.0]];
    let mesh = Mesh {
        vertices: [square(0.0), square(0.1)].concat(),
        triangles: vec![[4, 5, 6], [4, 6, 7], [0, 1, 2], [0, 2, 3]],
    };
    let s = SurfaceMesh { mesh, cut: vec![true, true, false, false] };
    let view = View { azimuth: 0.0, elevation: 0.0, size: [60, 60], ..VIEW };
    let middle = |rgb: Vec<u8>| [0, 1, 2].map(|k| rgb[(30 * 60 + 30) * 3 + k]);
    let front = middle(render(&s, &view, &RenderOptions::default()));
    let back = middle(render(&s, &View { azimuth: 180.0, ..view }, &RenderOptions::default()));
    assert!(front[2] > front[0], "the cut is bluish: {front:?}");
    assert!(back[0] > back[2], "the lattice is warm: {back:?}");
}

#[test]
fn bands_do_not_show() {
    let s = contour(24, gyroid(2.0));
    let one = render(&s, &VIEW, &RenderOptions::default());
    assert_eq!(render_in_bands(&s, &VIEW, &RenderOptions::default(), 1), one);
    assert_eq!(render_in_bands(&s, &VIEW, &RenderOptions::default(), 2 * BAND * VIEW.size[0] * OVER), one);
}

/// An inclined edge runs through pixels that have part of both sides, in large pictures as in small ones.
#[test]
fn edges_are_smooth_at_any_size() {
    let mesh =
        Mesh { vertices: vec![[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.4, 1.0]], triangles: vec![[0, 1, 2]] };
    let s = SurfaceMesh { mesh, cut: vec![true] };
    for size in [[200, 150], [2400, 1800]] {
        let view = View { azimuth: 0.0, elevation: 0.0, size, ..VIEW };
        let (with, without) = (
            render(&s, &view, &RenderOptions::default()),
            render(&SurfaceMesh::default(), &view, &RenderOptions::default()),
        );
        let level = |y: usize, x: usize| i32::from(with[3 * (y * size[0] + x)]);
        // In each row, the pixels between the background and the first that is like its right neighbour.
        let blended = |y: usize| {
            let first = (0..size[0]).find(|x| with[3 * (y * size[0] + x)] != without[3 * (y * size[0] + x)]);
            first.map_or(0, |x| usize::from((level(y, x) - level(y, x + 2)).abs() > 8))
        };
        let rows = size[1] / 4..size[1] * 3 / 4;
        let share = rows.clone().map(blended).sum::<usize>() as f64 / rows.len() as f64;
        assert!(share > 0.5, "{size:?}: {share}");
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let s = contour(24, gyroid(2.0));
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let many = rayon::ThreadPoolBuilder::new().num_threads(5).build();
    let (Ok(one), Ok(many)) = (one, many) else {
        return;
    };
    assert_eq!(
        one.install(|| render(&s, &VIEW, &RenderOptions::default())),
        many.install(|| render(&s, &VIEW, &RenderOptions::default()))
    );
}

/// A block from [0, 0, 0] to [3, 2, 2], cut all over.
fn block() -> SurfaceMesh {
    let corner = |i: usize| [0, 1, 2].map(|a| [3.0, 2.0, 2.0][a] * ((i >> a) & 1) as f64);
    let quads: [[u32; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let cut = vec![true; triangles.len()];
    SurfaceMesh { mesh: Mesh { vertices: (0..8).map(corner).collect(), triangles }, cut }
}

fn pixel(rgb: &[u8], [x, y]: [f64; 2]) -> [i32; 3] {
    let at = 3 * (y as usize * VIEW.size[0] + x as usize);
    [0, 1, 2].map(|k| i32::from(rgb[at + k]))
}

/// A line changes the picture along its projection and nowhere else, in its colour; it is stronger before the surface than behind it.
#[test]
fn lines_are_where_they_are_projected() {
    let s = block();
    let camera = Camera::new(&s.mesh.bounds(), &s.mesh.vertices, &VIEW, VIEW.size);
    let place = |p: Vec3| camera.project(p);
    let options = |lines: Vec<(usize, Vec<Vec3>)>| RenderOptions {
        lines: Some(Lines { lines, names: Vec::new(), caption: String::new(), radius: 0.06 }),
        ..RenderOptions::default()
    };
    let bare = render(&s, &VIEW, &options(Vec::new()));
    let inside = vec![[0.4, 0.5, 0.6], [1.6, 1.5, 0.7], [2.6, 0.6, 1.5]];
    // Towards the eye from the block.
    let before: Vec<Vec3> = inside.iter().map(|p| add(*p, scale(camera.axes[2], 4.0))).collect();
    let mut red = Vec::new();
    for line in [&inside, &before] {
        let drawn = render(&s, &VIEW, &options(vec![(0, line.clone())]));
        let along: Vec<[f64; 3]> = line
            .windows(2)
            .flat_map(|p| (0..=200).map(|i| add(p[0], scale(sub(p[1], p[0]), f64::from(i) / 200.0))))
            .map(place)
            .collect();
        for (i, (a, b)) in drawn.chunks(3).zip(bare.chunks(3)).enumerate().filter(|(_, (a, b))| a != b) {
            let (x, y) = ((i % VIEW.size[0]) as f64 + 0.5, (i / VIEW.size[0]) as f64 + 0.5);
            // Within the tube's projection and the pixel's half diagonal.
            let near = along.iter().any(|p| (p[0] - x).hypot(p[1] - y) < 0.06 * camera.focal * p[2] + 0.75);
            assert!(near, "{x} {y}: {b:?} became {a:?}");
        }
        let middle = place(scale(add(line[0], line[1]), 0.5));
        let [r, g, b] = pixel(&drawn, [middle[0], middle[1]]);
        assert!(r > g + 30 && r > b + 30, "{r} {g} {b}");
        red.push(r - g);
    }
    assert!(red[1] > red[0] + 20, "{red:?}");
}

/// A surface with one part alone has one colour, two parts have theirs where they are, and half of each is between them.
#[test]
fn shares_are_mixtures() {
    let s = block();
    let shares = |of: &dyn Fn(Vec3) -> f64| {
        let values = s.mesh.vertices.iter().flat_map(|p| [1.0 - of(*p), of(*p)]).collect();
        let names = vec!["first".into(), "second".into()];
        let colours = Some(Colours::Shares(Shares { title: String::new(), names, values }));
        render(&s, &VIEW, &RenderOptions { colours, ..RenderOptions::default() })
    };
    let empty = render(&SurfaceMesh::default(), &VIEW, &RenderOptions::default());
    let [first, second, half] = [0.0, 1.0, 0.5].map(|share| shares(&|_| share));
    let both = shares(&|p| f64::from(p[0] > 1.5));
    // Both names, one below the other.
    let foot = VIEW.size[1] - 56;
    let mut seen = [0; 2];
    for i in (0..foot * VIEW.size[0]).filter(|i| first[3 * i..3 * i + 3] != empty[3 * i..3 * i + 3]) {
        let of = |rgb: &[u8]| [0, 1, 2].map(|k| i32::from(rgb[3 * i + k]));
        let ([r, _, b], [s, _, c]) = (of(&first), of(&second));
        assert!(b >= r && s >= c, "{:?} {:?}", of(&first), of(&second));
        for k in 0..3 {
            let ends = [of(&first)[k], of(&second)[k]];
            assert!(ends[0].min(ends[1]) <= of(&half)[k] && of(&half)[k] <= ends[0].max(ends[1]));
        }
        let far = |rgb: &[u8]| of(&both).iter().zip(of(rgb)).map(|(a, b)| (a - b).abs()).sum::<i32>();
        seen[usize::from(far(&first) > far(&second))] += 1;
    }
    assert!(seen.iter().all(|n| *n > 100), "{seen:?}");
}

/// The part stays clear of the legend.
#[test]
fn legends_have_room() {
    let options = |caption: &str| RenderOptions {
        lines: Some(Lines { names: vec!["One".into()], caption: caption.into(), ..Lines::default() }),
        ..RenderOptions::default()
    };
    let (with, without) =
        (render(&block(), &VIEW, &options("two")), render(&SurfaceMesh::default(), &VIEW, &options("two")));
    // Two rows of 14 pixels, half as much between and about them.
    let foot = (VIEW.size[1] - 56) * VIEW.size[0] * 3;
    assert!(with[foot..] == without[foot..] && with[..foot] != without[..foot]);
    assert_ne!(render(&block(), &VIEW, &options("three")), with);
}

/// A section seen from the side that is left out shows the solid cut, in the area that it has; from the other side it shows the
/// outside alone; one that leaves out nothing changes nothing.
#[test]
fn a_section_is_as_large_as_the_solid_there() {
    let ball = contour(24, |p| norm(sub(p, [0.5; 3])) - 0.4);
    let view = View { size: [200, 200], azimuth: 20.0, elevation: 90.0, projection: Projection::Perspective };
    let options = |offset: f64, side: f64| RenderOptions {
        section: Some(SectionPlane { normal: [0.0, 0.0, side], offset: side * offset }),
        ..RenderOptions::default()
    };
    let red = |rgb: &[u8]| rgb.chunks(3).filter(|c| i32::from(c[0]) > i32::from(c[1]) + 60).count() as f64;
    let whole = render(&ball, &view, &RenderOptions::default());
    for height in [0.3, 0.5, 0.75] {
        let seen = render(&ball, &view, &options(height, 1.0));
        let shown = options(height, 1.0).section.expect("a section").kept(&ball.mesh);
        let camera = Camera::new(&ball.mesh.bounds(), &shown, &view, view.size);
        let near = camera.project([0.5, 0.5, height])[2];
        let radius = (0.16 - (height - 0.5) * (height - 0.5)).sqrt() * camera.focal * near;
        // The boundary within a pixel, and the sag of the ball's facets: an eighth of the square of their edge over its radius.
        let band = core::f64::consts::TAU * radius * (1.0 + camera.focal * near / 24.0 / 24.0);
        let area = core::f64::consts::PI * radius * radius;
        assert!((red(&seen) - area).abs() < band, "{height}: {} of {area} within {band}", red(&seen));
        // Lighter than the whole ball, which is seen from the side that is kept.
        assert_eq!(red(&render(&ball, &view, &options(height, -1.0))), 0.0);
    }
    assert_eq!(red(&whole), 0.0);
    assert!(render(&ball, &view, &options(2.0, 1.0)) == whole);
    assert!(
        render(&ball, &view, &options(-2.0, 1.0)) == render(&SurfaceMesh::default(), &view, &RenderOptions::default())
    );
    // The same with any number of threads, and whatever is drawn at once.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("pool");
    let slanted = options(0.5, 1.0);
    let slanted = RenderOptions {
        section: slanted.section.map(|s| SectionPlane { normal: unit([1.0, 2.0, 2.0]), ..s }),
        ..slanted
    };
    let one = alone.install(|| render(&ball, &VIEW, &slanted));
    assert!(one == render(&ball, &VIEW, &slanted) && one == render_in_bands(&ball, &VIEW, &slanted, 1));
}

#[test]
#[ignore = "writes pictures to look at"]
fn gallery() {
    let dir = std::env::temp_dir();
    for (name, s) in
        [("network", contour(160, |p| gyroid(3.0)(p) + 0.25)), ("sheet", contour(160, |p| gyroid(3.0)(p).abs() - 0.3))]
    {
        let view = View { size: [1200, 900], azimuth: 35.0, elevation: 28.0, projection: Projection::Perspective };
        let t = std::time::Instant::now();
        let rgb = render(&s, &view, &RenderOptions::default());
        let drawn = t.elapsed();
        let file = png(&rgb, view.size, 3, None);
        println!(
            "{name}: {} triangles, {drawn:?}, {:?}, {} bytes",
            s.mesh.triangles.len(),
            t.elapsed() - drawn,
            file.len()
        );
        assert!(std::fs::write(dir.join(format!("trabecula-{name}.png")), file).is_ok());
    }
}

/// On a transparent background a pixel has the colour of what covers it, and alpha the share that is covered: over the same background it is
/// the same picture.
#[test]
fn a_transparent_background_mixes_to_the_same_picture() {
    let s = sphere(24);
    let [white, clear] = [Background::White, Background::Transparent]
        .map(|background| render(&s, &VIEW, &RenderOptions { background, ..RenderOptions::default() }));
    assert_eq!((white.len(), clear.len()), (200 * 150 * 3, 200 * 150 * 4));
    let (mut partly, mut inside) = (0, 0);
    for (w, c) in white.chunks(3).zip(clear.chunks(4)) {
        let cover = f32::from(c[3]) / 255.0;
        for k in 0..3 {
            // In linear light; a byte of alpha and one of colour are half a step off at most each, and steps are 2/255 at most in the light.
            let mixed = cover * tint::decode(c[k]) + 1.0 - cover;
            assert!((mixed - tint::decode(w[k])).abs() < 0.02, "{w:?} {c:?}");
        }
        partly += usize::from(c[3] > 0 && c[3] < 255);
        inside += usize::from(c[3] == 255);
    }
    assert!(partly > 100 && inside > 4000 && clear[3] == 0, "{partly} {inside}");
    // Writing covers what it is written on.
    let legend = RenderOptions {
        colours: Some(Colours::Scale(Tint {
            title: "t".into(),
            amount: Amount::AtVertices(vec![0.0; s.mesh.vertices.len()]),
            span: [0.0, 1.0],
        })),
        background: Background::Transparent,
        ..RenderOptions::default()
    };
    let drawn = render(&s, &VIEW, &legend);
    assert!(drawn.chunks(4).any(|p| p == [40, 40, 44, 255]) && drawn[3] == 0);
}

/// A box, no triangle of which is a cut.
fn cuboid(low: Vec3, high: Vec3) -> SurfaceMesh {
    let mesh = Mesh::cuboid(low, high);
    SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh }
}

/// Columns and rows of the pixels that are: first and beyond the last.
fn spans(size: [usize; 2], is: impl Fn(usize) -> bool) -> [[usize; 2]; 2] {
    let mut found = [[usize::MAX, 0]; 2];
    for i in (0..size[0] * size[1]).filter(|i| is(*i)) {
        for (k, at) in [i % size[0], i / size[0]].into_iter().enumerate() {
            found[k] = [found[k][0].min(at), found[k][1].max(at + 1)];
        }
    }
    found
}

const PARALLEL: View = View { size: [400, 300], azimuth: -90.0, elevation: 0.0, projection: Projection::Orthographic };

/// By parallel rays a box is as large as its sides at one scale, from any side and at any depth; by a lens its far side is smaller.
#[test]
fn a_box_is_to_scale_by_parallel_rays() {
    let s = cuboid([1.0, -2.0, 3.0], [13.0, 4.0, 11.0]);
    let options = RenderOptions { background: Background::Transparent, ..RenderOptions::default() };
    for (azimuth, elevation, wide, high) in [(-90.0, 0.0, 12.0, 8.0), (0.0, 0.0, 6.0, 8.0), (-90.0, 90.0, 12.0, 6.0)] {
        let view = View { azimuth, elevation, ..PARALLEL };
        let rgba = render(&s, &view, &options);
        let [x, y] = spans(view.size, |i| rgba[4 * i + 3] >= 128).map(|[a, b]| (b - a) as f64);
        let scale = f64::min(0.92 * 400.0 / wide, 0.92 * 300.0 / high);
        // Each side to half a pixel.
        assert!((x - scale * wide).abs() <= 1.0 && (y - scale * high).abs() <= 1.0, "{x} {y} {scale}");
        let filled = (0..400 * 300).map(|i| f64::from(rgba[4 * i + 3]) / 255.0).sum::<f64>();
        assert!((filled - scale * scale * wide * high).abs() <= (x + y) / 3.0, "{filled}");
    }
    // From a corner the nearest and the farthest edge are as long as each other.
    let far = |projection| {
        let view = View { azimuth: 45.0, elevation: 0.0, projection, size: [400, 300] };
        let bounds = s.mesh.bounds();
        let camera = Camera::new(&bounds, &s.mesh.vertices, &view, view.size);
        let long = |x: f64, y: f64| camera.project([x, y, 3.0])[1] - camera.project([x, y, 11.0])[1];
        long(1.0, -2.0) / long(13.0, 4.0)
    };
    assert!((far(Projection::Orthographic) - 1.0).abs() < 1e-12 && far(Projection::Perspective) < 0.9);
}

/// The bar is as many pixels long as it says; marks change nothing above the foot but its height, and small pictures have none.
#[test]
fn the_scale_bar_is_as_long_as_it_says() {
    let s = cuboid([0.0; 3], [12.0, 6.0, 2.0]);
    let white = |marks| RenderOptions { background: Background::White, marks, ..RenderOptions::default() };
    let bar = white(Marks { scale_bar: true, axes: false });
    for size in [[400, 300], [900, 700], [1600, 1200]] {
        let view = View { size, ..PARALLEL };
        let rgb = render(&s, &view, &bar);
        // Below the box, which fills the width, the bar is the longest run of ink in a row.
        let scale = 0.92 * size[0] as f64 / 12.0;
        let below = size[1] / 2 + scale as usize + 2;
        let row = |y: usize| (0..size[0]).map(|x| rgb[3 * (y * size[0] + x)] < 140).collect::<Vec<_>>();
        let run = |y: usize| row(y).chunk_by(|a, b| a == b).filter(|r| r[0]).map(<[bool]>::len).max().unwrap_or(0);
        let longest = (below..size[1]).map(run).max().unwrap_or(0) as f64;
        // 2 mm: 3/10 of the width are 3.9 mm.
        assert!((longest - 2.0 * scale).abs() <= 1.0, "{longest} {scale}");
    }
    let small = View { size: [120, 90], ..PARALLEL };
    assert!(!bar.fits(&small) && bar.fits(&PARALLEL) && RenderOptions::default().fits(&small));
    assert_eq!(render(&s, &small, &bar), render(&s, &small, &white(Marks::default())));
    let axes = render(&s, &PARALLEL, &white(Marks { scale_bar: false, axes: true }));
    let seen = |k: usize| (0..400 * 300).any(|i| axes[3 * i..3 * i + 3] == palette::LINES[k]);
    assert!((0..3).all(seen), "each axis has its colour, the one that is seen from its end by its letter");
}

/// A face in the plane of a section is cut as a whole, whatever the camera, and of what lies beyond nothing is left.
#[test]
fn a_face_in_the_plane_of_a_section_is_of_one_kind() {
    let s = cuboid([0.0; 3], [12.0; 3]);
    for projection in [Projection::Perspective, Projection::Orthographic] {
        for (azimuth, elevation) in [(30.0, 25.0), (77.0, 60.0), (10.0, 90.0)] {
            let view = View { size: [400, 300], azimuth, elevation, projection };
            let cut = |offset| {
                let section = Some(SectionPlane { normal: [0.0, 0.0, 1.0], offset });
                let rgb = render(&s, &view, &RenderOptions { section, ..RenderOptions::default() });
                rgb.chunks(3).filter(|p| i32::from(p[0]) - i32::from(p[1]) > 60).count() as f64
            };
            let (at, below) = (cut(12.0), cut(11.99));
            assert!(below > 4000.0 && (at / below - 1.0).abs() < 0.01, "{at} {below}");
        }
    }
}

/// A ball that is seen by parallel rays, its normals, and the normal that each pixel sees, where it sees the ball well off its contour.
fn seen_ball(view: &View) -> (SurfaceMesh, Vec<[f32; 3]>, Vec<(usize, Vec3)>) {
    let ball = contour(40, |p| norm(sub(p, [0.5; 3])) - 0.4);
    let out = |v: &u32| unit(sub(ball.mesh.vertices[*v as usize], [0.5; 3])).map(|c| c as f32);
    let normals = ball.mesh.triangles.as_flattened().iter().map(out).collect();
    let [w, h] = view.size;
    let radius = 0.46 * w.min(h) as f64;
    let [right, up, eye] = view.axes();
    let normal = |i: usize| {
        let x = ((i % w) as f64 + 0.5 - w as f64 / 2.0) / radius;
        let y = (h as f64 / 2.0 - (i / w) as f64 - 0.5) / radius;
        let n = add(scale(right, x), add(scale(up, y), scale(eye, (1.0 - x * x - y * y).max(0.0).sqrt())));
        (x.hypot(y) < 0.93).then_some((i, n))
    };
    let seen = (0..w * h).filter_map(normal).collect();
    (ball, normals, seen)
}

/// A pixel of a ball has the colour of the overhang there, for any build direction: that of the same ball in the one colour of that angle.
/// What faces up is grey, and so is what is steeper than the end of the scale.
#[test]
fn a_ball_has_the_colours_of_its_overhang() {
    let view = View { size: [160, 160], azimuth: 20.0, elevation: -30.0, projection: Projection::Orthographic };
    let (ball, normals, seen) = seen_ball(&view);
    let options = |amount: Amount, end: f64| {
        let colours = Some(Colours::Scale(Tint { title: String::new(), amount, span: [0.0, end] }));
        render(&ball, &view, &RenderOptions { colours, normals: Some(normals.clone()), ..RenderOptions::default() })
    };
    let [first, second] = [[0.0, 0.0, 1.0], unit([1.0, -2.0, 2.0])];
    for (up, end) in [(first, 90.0), (first, 45.0), (second, 60.0)] {
        let drawn = options(Amount::Overhang(up), end);
        let mut compared = 0;
        for angle in [20.0, 40.0, 50.0, 70.0, 110.0] {
            let number = if angle < end { angle } else { f64::NAN };
            let alone = options(Amount::AtVertices(vec![number; ball.mesh.vertices.len()]), end);
            for (i, n) in seen.iter().filter(|(_, n)| ((-dot(*n, up)).acos().to_degrees() - angle).abs() < 0.5) {
                // Half a degree and the curvature of a facet; between two of six stops a colour changes by 131 at most.
                let most = 131.0 * 5.0 * 0.6 / end + 2.0;
                let off = (0..3).map(|k| i32::from(drawn[3 * i + k]).abs_diff(i32::from(alone[3 * i + k]))).max();
                assert!(off.is_some_and(|off| f64::from(off) <= most), "{angle} of {end}: {off:?} at {n:?}");
                compared += 1;
            }
        }
        assert!(compared > 200, "{compared}");
    }
}

/// A section has the colours of a function there, by four points of the grid to either side; hatched in the same.
#[test]
fn a_section_has_the_colours_of_what_is_inside() {
    let view = View { size: [160, 160], azimuth: 0.0, elevation: 90.0, projection: Projection::Orthographic };
    let (ball, ..) = seen_ball(&view);
    let options = |grid: &dyn Fn(usize) -> f64| {
        let amount = Amount::AtVertices(vec![0.0; ball.mesh.vertices.len()]);
        let colours = Some(Colours::Scale(Tint { title: String::new(), amount, span: [0.0, 1.0] }));
        let steps = [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let grid = SectionColours {
            grid: PlaneGrid { origin: [0.0, 0.0, 0.5], steps, counts: [3, 2] },
            values: (0..6).map(grid).collect(),
        };
        let section = Some(SectionPlane { normal: [0.0, 0.0, 1.0], offset: 0.5 });
        render(
            &ball,
            &view,
            &RenderOptions { colours, section, section_colours: Some(grid), ..RenderOptions::default() },
        )
    };
    // By the x of its point: x at a point of the grid is 0, 1/2 or 1.
    let ramp = options(&|i| (i % 3) as f64 / 2.0);
    let mut compared = 0;
    for share in [0.2, 0.4, 0.5, 0.65, 0.8] {
        let alone = options(&|_| share);
        // Seen from above with y to the right, x runs down.
        for i in 0..160 * 160 {
            let [x, y] = [i % 160, i / 160].map(|c| (c as f64 + 0.5 - 80.0) / (0.46 * 160.0) * 0.4);
            if x.hypot(y) < 0.38 && (0.5 + y - share).abs() < 0.01 {
                let off = (0..3).map(|k| i32::from(ramp[3 * i + k]).abs_diff(i32::from(alone[3 * i + k]))).max();
                // A hundredth of the scale, between two stops.
                assert!(off.is_some_and(|off| f64::from(off) <= 131.0 * 5.0 * 0.01 + 2.0), "{share}: {off:?}");
                compared += 1;
            }
        }
    }
    assert!(compared > 300, "{compared}");
}

/// A ball is as dark by what stands around it at all its points that see the same: no facet of a coarse mesh shows.
#[test]
fn facets_of_a_ball_throw_no_shade() {
    let view = View { size: [240, 240], azimuth: 20.0, elevation: 10.0, projection: Projection::Orthographic };
    let ball = contour(10, |p| norm(sub(p, [0.5; 3])) - 0.4);
    let out = |v: &u32| unit(sub(ball.mesh.vertices[*v as usize], [0.5; 3])).map(|c| c as f32);
    let given: Vec<[f32; 3]> = ball.mesh.triangles.as_flattened().iter().map(out).collect();
    let camera = Camera::new(&ball.mesh.bounds(), &ball.mesh.vertices, &view, view.size.map(|n| n * OVER));
    let normals = shading_normals::ShadingNormals::of(&ball, Some(&given));
    let open = occlusion::Occlusion::of(&ball, &normals, &camera, view.size.map(|n| n * OVER), None);
    let raster = Projected::of(&ball, &camera, view.size.map(|n| n * OVER), None).draw(&ball, 0, 240 * OVER);
    let mut least = 1.0f32;
    for y in (0..720).step_by(3) {
        for x in (0..720).step_by(3) {
            if (x as f64 - 360.0).hypot(y as f64 - 360.0) < 0.8 * 331.0 {
                least = least.min(open.open(x, y, raster.near[y * 720 + x]));
            }
        }
    }
    assert!(least > 0.97, "{least}");
}
