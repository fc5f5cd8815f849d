//! Radii for a wireframe: beam radii and hub radii.

use super::wireframe::Wireframe;
use super::{Beam, Graph, Hub, Profile};
use geometry::fault::{Fault, number};
use geometry::math::{Vec3, add, scale};

/// Radius rules for beams and hubs; `V` is a length that may vary in space.
#[derive(Clone)]
pub struct Radii<V> {
    /// Beam radius at mid length (mm), evaluated there; `None` if the hubs decide.
    pub radius: Option<V>,
    /// Hub radius (mm), evaluated at the centres; `None` for the largest radius of the incident beams.
    pub hub: Option<V>,
    /// Beam profile; `None` for the quadric with the given mid-length radius, or the cone if there is no such radius.
    pub profile: Option<Profile>,
}

/// The graph of a wireframe. `values` evaluates a varying length at points (mm); `own` are node radii that take
/// precedence (NaN where none is given, empty if none at all).
///
/// # Errors
/// A node without any radius; a radius that is not positive and finite, with its position.
pub fn with_radii<V>(
    wireframe: &Wireframe,
    own: &[f64],
    radii: &Radii<V>,
    values: impl Fn(&V, &[Vec3], &mut [f64]),
) -> Result<Graph, Fault> {
    let lengths = |v: &V, points: &[Vec3], key| lengths(|out| values(v, points, out), points, key);
    let middles: Vec<Vec3> = (wireframe.struts.iter())
        .map(|s| {
            let [a, b] = s.map(|n| wireframe.nodes[n as usize]);
            scale(add(a, b), 0.5)
        })
        .collect();
    let beam_radii = radii.radius.as_ref().map(|v| lengths(v, &middles, "radius")).transpose()?;
    let mut sizes = match &radii.hub {
        Some(v) => lengths(v, &wireframe.nodes, "hub")?,
        None => {
            let mut most = vec![f64::NAN; wireframe.nodes.len()];
            for (s, r) in wireframe.struts.iter().zip(beam_radii.iter().flatten()) {
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
                "no radius for the node at {}: give one for the node, for hubs or for beams",
                position_text(wireframe.nodes[n])
            ),
        ));
    }
    let hub = |(center, radius): (&Vec3, f64)| Hub { center: *center, radius };
    let beam = |(i, ends): (usize, &[u32; 2])| Beam {
        ends: *ends,
        profile: match (radii.profile, &beam_radii) {
            (Some(profile), _) => profile,
            (None, Some(beam_radii)) => Profile::Mid(beam_radii[i]),
            (None, None) => Profile::Cone,
        },
    };
    Ok(Graph {
        hubs: wireframe.nodes.iter().zip(sizes).map(hub).collect(),
        beams: wireframe.struts.iter().enumerate().map(beam).collect(),
    })
}

/// A position as text for messages.
pub fn position_text(p: Vec3) -> String {
    let [x, y, z] = p.map(number);
    format!("({x}, {y}, {z}) mm")
}

/// A varying length at points, checked to be positive and finite.
fn lengths(values: impl Fn(&mut [f64]), points: &[Vec3], key: &str) -> Result<Vec<f64>, Fault> {
    let mut out = vec![0.0; points.len()];
    values(&mut out);
    match out.iter().position(|r| !(*r > 0.0 && r.is_finite())) {
        Some(i) => Err(Fault::new(
            key,
            format!(
                "{} radius must be positive and finite, found {} mm at {}",
                if key == "hub" { "hub" } else { "beam" },
                number(out[i]),
                position_text(points[i])
            ),
        )),
        None => Ok(out),
    }
}
