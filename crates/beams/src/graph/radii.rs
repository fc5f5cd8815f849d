//! Radii for a wireframe: beam radii and hub radii.

use super::wireframe::{GivenRadii, Wireframe};
use super::{Beam, Graph, HubBall, Profile};
use crate::quador::Pencil;
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

/// The graph of a wireframe. `values` evaluates a varying length at points (mm); `own` radii of nodes take precedence, and those of
/// beams hold where no radius of beams is given: a beam is the cone where it has the radii of its hubs, and otherwise the quadric
/// with their mean at mid length, or the nearest that there is.
///
/// # Errors
/// A node without any radius; a radius that is not positive and finite, with its position.
pub fn with_radii<V>(
    wireframe: &Wireframe,
    own: &GivenRadii,
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
            let ends = |i: usize| match &beam_radii {
                Some(of) => [of[i]; 2],
                None => own.struts.get(i).copied().unwrap_or([f64::NAN; 2]),
            };
            for (i, s) in wireframe.struts.iter().enumerate() {
                for (n, r) in s.iter().zip(ends(i)) {
                    most[*n as usize] = most[*n as usize].max(r);
                }
            }
            most
        }
    };
    for (size, own) in sizes.iter_mut().zip(&own.nodes).filter(|(_, own)| !own.is_nan()) {
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
    let given = |i: usize, ends: &[u32; 2]| {
        let hubs = ends.map(|n| sizes[n as usize]);
        let length = wireframe.length(*ends);
        own.struts.get(i).map_or(Profile::Cone, |r| given_profile(*r, hubs, length))
    };
    let hub = |(center, radius): (&Vec3, f64)| HubBall { center: *center, radius };
    let beam = |(i, ends): (usize, &[u32; 2])| Beam {
        ends: *ends,
        profile: match (radii.profile, &beam_radii) {
            (Some(profile), _) => profile,
            (None, Some(beam_radii)) => Profile::Mid(beam_radii[i]),
            (None, None) => given(i, ends),
        },
    };
    let beams = wireframe.struts.iter().enumerate().map(beam).collect();
    Ok(Graph { hubs: wireframe.nodes.iter().zip(sizes).map(hub).collect(), beams })
}

/// Share of the range of radii at mid length that a beam keeps from its ends, at which quadrics degenerate.
const KEPT: f64 = 1e-3;

/// The profile of a beam with radii of its own at its ends, between hubs.
fn given_profile(radii: [f64; 2], hubs: [f64; 2], length: f64) -> Profile {
    let same = |k: usize| (radii[k] - hubs[k]).abs() <= 1e-9 * hubs[k];
    if radii[0].is_nan() || same(0) && same(1) {
        return Profile::Cone;
    }
    let mean = 0.5 * (radii[0] + radii[1]);
    // A beam that cannot be is refused later, with its place.
    let Ok(pencil) = Pencil::new(length, hubs, Profile::Cone) else { return Profile::Mid(mean) };
    let (least, most) = pencil.mid_radius_range();
    let most = most.min(1e3 * mean.max(least));
    let margin = KEPT * (most - least);
    Profile::Mid(mean.clamp(least + margin, most - margin))
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
