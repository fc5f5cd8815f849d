//! Exact queries of beams: membership, rays, nearest places, slices, and the faces of hubs.

use std::sync::Arc;

use beams::quador::slice::{Slice as Cut, SlicePlane};
use beams::quador::{Bezier, HubFillets, Quadors as Core, homogeneous_matrix};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rayon::prelude::*;

use crate::arrays::{evaluated, points};
use crate::error;
use crate::run::run;

/// Beams as quadrics.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Quadors {
    pub quadors: Arc<Core>,
}

/// Distance, normals, hubs.
type Hits<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>);
/// Places, normals, distances, hubs.
type Feet<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>);

fn rows<'py, const D: usize>(
    py: Python<'py>,
    of: impl IntoIterator<Item = [f64; D]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = of.into_iter().flatten().collect();
    let n = flat.len() / D;
    flat.into_pyarray(py).reshape([n, D])
}

/// Control points (n, 3, D) and weights (n,).
type Curves<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<f64>>);

fn curves<'py, const D: usize>(py: Python<'py>, of: &[Bezier<D>]) -> PyResult<Curves<'py>> {
    let flat: Vec<f64> = of.iter().flat_map(|b| b.points).flatten().collect();
    let weights: Vec<f64> = of.iter().map(|b| b.weight).collect();
    Ok((flat.into_pyarray(py).reshape([of.len(), 3, D])?, weights.into_pyarray(py)))
}

/// The beams that a set of half-beams belongs to.
fn beams(core: &Core, hub: usize, label: u64) -> Vec<u32> {
    let all = core.hub(hub).half_beams.iter().enumerate();
    all.filter(|(i, _)| *i < 64 && label >> i & 1 == 1).map(|(_, s)| s.beam).collect()
}

#[pymethods]
impl Quadors {
    /// How many hubs there are.
    #[getter]
    fn hubs(&self) -> usize {
        self.quadors.len()
    }

    /// How many beams there are.
    #[getter]
    fn beams(&self) -> usize {
        self.quadors.beams()
    }

    /// The volume of the whole, mm³.
    fn volume(&self, py: Python<'_>) -> PyResult<f64> {
        run(py, None, None, |_| self.quadors.checked_volume())?.map_err(error::fault)
    }

    /// Whether points (n, 3) are in the solid.
    fn contains<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let points = self::points(&points)?;
        let held: Vec<bool> = run(py, None, None, |_| {
            let contains = |p: &[[f64; 3]], out: &mut [bool]| {
                out.iter_mut().zip(p).for_each(|(o, p)| *o = self.quadors.contains(*p));
            };
            evaluated(&points, self.quadors.is_large(), contains)
        })?;
        Ok(held.into_pyarray(py))
    }

    /// First hits of rays from origins (n, 3) along directions (n, 3): distance in lengths of the direction (infinite
    /// without a hit), normal, hub (-1 without).
    fn rays<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Hits<'py>> {
        let (origins, directions) = (self::points(&origins)?, self::points(&directions)?);
        if origins.len() != directions.len() {
            return Err(PyValueError::new_err(format!(
                "{} origins and {} directions: give one direction for each origin",
                origins.len(),
                directions.len()
            )));
        }
        let hits: Vec<_> = run(py, None, None, |_| {
            let each = origins.par_iter().zip(&directions).with_min_len(64);
            each.map(|(o, d)| self.quadors.ray(*o, *d)).collect()
        })?;
        let distance: Vec<f64> = hits.iter().map(|h| h.map_or(f64::INFINITY, |h| h.distance)).collect();
        let hubs: Vec<i64> = hits.iter().map(|h| h.map_or(-1, |h| h.hub as i64)).collect();
        Ok((
            distance.into_pyarray(py),
            rows(py, hits.iter().map(|h| h.map_or([0.0; 3], |h| h.normal)))?,
            hubs.into_pyarray(py),
        ))
    }

    /// The nearest places of the surface to points (n, 3): place, normal, signed distance, hub.
    fn closest<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Feet<'py>> {
        let points = self::points(&points)?;
        let feet = run(py, None, None, |_| {
            let nearest = self.quadors.closest_points();
            let each = points.par_iter().with_min_len(16);
            each.map(|p| nearest.closest(*p)).collect::<Result<Vec<_>, _>>()
        })?
        .map_err(error::fault)?;
        let distance: Vec<f64> = feet.iter().map(|f| f.distance).collect();
        let hubs: Vec<i64> = feet.iter().map(|f| i64::from(f.hub)).collect();
        Ok((
            rows(py, feet.iter().map(|f| f.at))?,
            rows(py, feet.iter().map(|f| f.normal))?,
            distance.into_pyarray(py),
            hubs.into_pyarray(py),
        ))
    }

    /// The slice by the plane through a point with a normal.
    fn slice(&self, py: Python<'_>, point: [f64; 3], normal: [f64; 3]) -> PyResult<Slice> {
        let plane = SlicePlane::new(point, normal).map_err(error::fault)?;
        let cut = run(py, None, None, |_| self.quadors.slice(&plane))?;
        Ok(Slice { cut: cut.map_err(error::fault)? })
    }

    /// For all hubs: centres (n, 3), crotches (n,), those with less than asked for (n,), radii (n, 2), τ (n, 2).
    fn fillets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.quadors;
        let all: Vec<_> = run(py, None, None, |_| (0..core.len()).into_par_iter().map(|i| core.fillets(i)).collect())?;
        let counts = |of: &dyn Fn(&HubFillets) -> usize| -> Vec<i64> { all.iter().map(|f| of(f) as i64).collect() };
        let d = PyDict::new(py);
        d.set_item("centers", rows(py, (0..core.len()).map(|i| core.center(i)))?)?;
        d.set_item("crotches", counts(&|f| f.crotches).into_pyarray(py))?;
        d.set_item("short", counts(&|f| f.short).into_pyarray(py))?;
        d.set_item("radius", rows(py, all.iter().map(|f| f.radius))?)?;
        d.set_item("tau", rows(py, all.iter().map(|f| f.tau))?)?;
        Ok(d)
    }

    /// The surface of a hub: centre, vertices, arcs, faces; and its rational patches.
    fn hub<'py>(&self, py: Python<'py>, hub: usize) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.quadors;
        if hub >= core.len() {
            return Err(PyValueError::new_err(format!(
                "hub {hub} is not there: there are {}, numbered from 0",
                core.len()
            )));
        }
        let complex = core.complex(hub).map_err(error::fault)?;
        let of = core.hub(hub);
        let d = PyDict::new(py);
        d.set_item("center", core.center(hub))?;
        d.set_item("radius", of.radius)?;
        d.set_item("vertices", rows(py, complex.vertices.iter().map(|v| v.at))?)?;
        // The faces on both sides of each arc.
        let mut sides = vec![[-1i64; 2]; complex.arcs.len()];
        for (i, f) in complex.faces.iter().enumerate() {
            for &(a, forward) in f.loops.iter().flatten() {
                sides[a as usize][usize::from(!forward)] = i as i64;
            }
        }
        let arcs = PyList::empty(py);
        for (a, faces) in complex.arcs.iter().zip(sides) {
            let it = PyDict::new(py);
            it.set_item("vertices", a.ends)?;
            it.set_item("faces", faces)?;
            let (points, weights) = curves(py, &a.curves())?;
            it.set_item("points", points)?;
            it.set_item("weights", weights)?;
            arcs.append(it)?;
        }
        d.set_item("arcs", arcs)?;
        let faces = PyList::empty(py);
        for f in &complex.faces {
            let it = PyDict::new(py);
            it.set_item("beams", beams(core, hub, f.label))?;
            let flat: Vec<f64> = homogeneous_matrix(&f.quadric, [0.0; 3]).into_iter().flatten().collect();
            it.set_item("quadric", flat.into_pyarray(py).reshape([4, 4])?)?;
            it.set_item("loops", f.loops.clone())?;
            it.set_item("end_circle", f.end_circle.map(|s| of.half_beams[s as usize].beam))?;
            faces.append(it)?;
        }
        d.set_item("faces", faces)?;
        let (made, left) = complex.patches(&of);
        let patches = PyList::empty(py);
        for p in &made {
            let it = PyDict::new(py);
            it.set_item("face", p.face)?;
            let (net, weights) = p.control_net();
            let flat: Vec<f64> = net.into_iter().flatten().flatten().collect();
            it.set_item("points", flat.into_pyarray(py).reshape([3, 3, 3])?)?;
            let flat: Vec<f64> = weights.into_iter().flatten().collect();
            it.set_item("weights", flat.into_pyarray(py).reshape([3, 3])?)?;
            it.set_item("range", p.range())?;
            let loops = PyList::empty(py);
            for walked in &p.trims {
                let t = PyDict::new(py);
                let space: Vec<_> = walked.iter().map(|t| t.space).collect();
                let flat: Vec<_> = walked.iter().map(|t| t.flat).collect();
                let (points, weights) = curves(py, &space)?;
                t.set_item("points", points)?;
                t.set_item("weights", weights)?;
                let (points, weights) = curves(py, &flat)?;
                t.set_item("parameters", points)?;
                t.set_item("parameter_weights", weights)?;
                let arcs: Vec<i64> = walked.iter().map(|t| t.arc.map_or(-1, i64::from)).collect();
                t.set_item("arcs", arcs.into_pyarray(py))?;
                loops.append(t)?;
            }
            it.set_item("loops", loops)?;
            patches.append(it)?;
        }
        d.set_item("patches", patches)?;
        d.set_item("unpatched", left)?;
        Ok(d)
    }
}

/// A plane slice.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Slice {
    cut: Cut,
}

#[pymethods]
impl Slice {
    /// The solid's area, mm².
    #[getter]
    fn area(&self) -> f64 {
        self.cut.area
    }

    /// How far the plane was moved, mm.
    #[getter]
    fn moved(&self) -> f64 {
        self.cut.moved
    }

    /// Number of hubs evaluated.
    #[getter]
    fn hubs(&self) -> usize {
        self.cut.hubs
    }

    /// Origin, u, v, normal.
    #[getter]
    fn plane(&self) -> [[f64; 3]; 4] {
        let p = &self.cut.plane;
        [p.origin, p.axes[0], p.axes[1], p.normal]
    }

    /// For each loop: control points (n, 3, 2), weights (n,), hubs (n,), conics (n, 6) and where their (u, v) start (n, 2).
    fn loops<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |arcs: &Vec<beams::quador::slice::ConicArc>| {
            let all: Vec<Bezier<2>> = arcs.iter().flat_map(|a| a.curves.iter().copied()).collect();
            let each = || arcs.iter().flat_map(|a| a.curves.iter().map(move |_| a));
            let d = PyDict::new(py);
            let (points, weights) = curves(py, &all)?;
            d.set_item("points", points)?;
            d.set_item("weights", weights)?;
            let hubs: Vec<i64> = each().map(|a| i64::from(a.hub)).collect();
            d.set_item("hubs", hubs.into_pyarray(py))?;
            d.set_item("conics", rows(py, each().map(|a| a.conic))?)?;
            d.set_item("about", rows(py, each().map(|a| a.about))?)?;
            Ok(d)
        };
        self.cut.loops.iter().map(one).collect()
    }

    /// The loops as polygons (n, 2) no further than `chord` (mm) from them.
    fn polygons<'py>(&self, py: Python<'py>, chord: f64) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
        if !(chord > 0.0 && chord.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "chord is {chord}; it must be a finite number greater than 0, mm"
            )));
        }
        let polygons = run(py, None, None, |_| self.cut.polygons(chord))?;
        polygons.into_iter().map(|p| rows(py, p)).collect()
    }
}
