//! Radii for a wire frame: how thick its struts are, and how large the balls that they meet in.

use super::wire::Wire;
use super::{Beam, Graph, Hub, Profile};
use geometry::fault::{Fault, number};
use geometry::math::{Vec3, add, scale};

/// How thick beams are; `V` is a length that may vary.
#[derive(Clone)]
pub struct Radii<V> {
    /// Radius of a beam at mid length (mm), taken there; none if the hubs decide.
    pub radius: Option<V>,
    /// Radius of hubs (mm), taken at their centres; none for the largest radius of the beams that meet there.
    pub hub: Option<V>,
    /// What beams are; none for the quadric with the radius at mid length, or where there is none the cone.
    pub profile: Option<Profile>,
}

/// A graph of a frame: `values` fills a length that varies at points (mm), `own` are the radii of its
/// nodes (NaN where none is given, empty if none is), which come first.
///
/// # Errors
/// A node without a radius of its own where no radius is given; a radius that is not positive, with its place.
pub fn sized<V>(
    wire: &Wire,
    own: &[f64],
    radii: &Radii<V>,
    values: impl Fn(&V, &[Vec3], &mut [f64]),
) -> Result<Graph, Fault> {
    let lengths = |v: &V, points: &[Vec3], key| lengths(|out| values(v, points, out), points, key);
    let middles: Vec<Vec3> = (wire.struts.iter())
        .map(|s| {
            let [a, b] = s.map(|n| wire.nodes[n as usize]);
            scale(add(a, b), 0.5)
        })
        .collect();
    let thick = radii.radius.as_ref().map(|v| lengths(v, &middles, "radius")).transpose()?;
    let mut sizes = match &radii.hub {
        Some(v) => lengths(v, &wire.nodes, "hub")?,
        None => {
            let mut most = vec![f64::NAN; wire.nodes.len()];
            for (s, r) in wire.struts.iter().zip(thick.iter().flatten()) {
                for n in s {
                    most[*n as usize] = most[*n as usize].max(*r);
                }
            }
            most
        }
    };
    for (size, own) in sizes.iter_mut().zip(own).filter(|(_, own)| !own.is_nan()) {
        *size = *own;
    }
    if let Some(n) = sizes.iter().position(|r| r.is_nan()) {
        return Err(Fault::new(
            "radius",
            format!(
                "the node at {} has no radius of its own, and no radius of beams is given; give one",
                place(wire.nodes[n])
            ),
        ));
    }
    let hub = |(center, radius): (&Vec3, f64)| Hub { center: *center, radius };
    let beam = |(i, ends): (usize, &[u32; 2])| Beam {
        ends: *ends,
        profile: match (radii.profile, &thick) {
            (Some(profile), _) => profile,
            (None, Some(thick)) => Profile::Mid(thick[i]),
            (None, None) => Profile::Cone,
        },
    };
    Ok(Graph {
        hubs: wire.nodes.iter().zip(sizes).map(hub).collect(),
        beams: wire.struts.iter().enumerate().map(beam).collect(),
    })
}

/// A place in a sentence.
pub fn place(p: Vec3) -> String {
    let [x, y, z] = p.map(number);
    format!("({x}, {y}, {z}) mm")
}

/// A length that varies, at the points.
fn lengths(values: impl Fn(&mut [f64]), points: &[Vec3], key: &str) -> Result<Vec<f64>, Fault> {
    let mut out = vec![0.0; points.len()];
    values(&mut out);
    match out.iter().position(|r| !(*r > 0.0 && r.is_finite())) {
        Some(i) => Err(Fault::new(
            key,
            format!(
                "{key} is {} mm at {}; it must be a finite number greater than 0",
                number(out[i]),
                place(points[i])
            ),
        )),
        None => Ok(out),
    }
}
