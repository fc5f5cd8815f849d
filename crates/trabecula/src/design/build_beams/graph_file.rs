//! Graphs in files of other programs.

use crate::design::data::*;
use crate::environment::Environment;
use crate::kind::{DesignError, Unit, Warning};
use ::beams::graph::{GivenRadii, Wireframe};
use ::beams::{JoinedChains, join_chains};
use geometry::fault::{Fault, counted};
use geometry::formats::{BeamGraph, read_graph};

/// The wireframe of a file and its radii, where the design does not give others.
pub(super) fn read(
    file: &FileGraph,
    spec: &BeamsSpec,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<(Wireframe, GivenRadii), DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let bytes = environment.load(&file.path, &below("path"))?;
    let suffix = file.path.rsplit_once('.').map_or("", |(_, e)| e);
    let wrong = |f: Fault| DesignError::new(below("path"), format!("{}: {}", file.path, f.message)).found(&file.path);
    let mut graph = read_graph(&bytes, suffix).map_err(wrong)?;
    if let (true, Some(unit)) = (graph.in_mm, file.unit)
        && unit != Unit::Mm
    {
        let message = "this file names its own unit and was read in mm; leave unit out";
        return Err(DesignError::new(below("unit"), message));
    }
    let unit = if graph.in_mm { 1.0 } else { file.unit.unwrap_or(Unit::Mm).in_mm() };
    if file.scale * unit != 1.0 {
        graph.scale(file.scale * unit);
    }
    let mut remarks = std::mem::take(&mut graph.remarks);
    let joined = join_chains(&mut graph);
    if joined.frusta > 0 {
        let made = counted(joined.beams.len(), "beam");
        remarks.push(format!("{} frusta in chains that represent quadrics read as {made}", joined.frusta));
    }
    let bare = graph.bare_ends();
    if bare > 0 {
        remarks.push(format!("{} of beams that are no balls read as balls", counted(bare, "end")));
    }
    let own = radii(&mut graph, &joined, spec, environment, &mut remarks)?;
    let made = remarks.into_iter().map(|r| Warning { path: below("path"), message: format!("{}: {r}", file.path) });
    warnings.extend(made);
    Ok((Wireframe { nodes: graph.nodes, struts: graph.beams }, own))
}

/// The radii that hold; beams within the ball of one of their hubs are left out.
fn radii(
    graph: &mut BeamGraph,
    joined: &JoinedChains,
    spec: &BeamsSpec,
    environment: &Environment,
    remarks: &mut Vec<String>,
) -> Result<GivenRadii, DesignError> {
    if spec.radius.is_some() || spec.fraction.is_some() {
        return Ok(GivenRadii::default());
    }
    let mut own = GivenRadii { nodes: std::mem::take(&mut graph.radii), struts: std::mem::take(&mut graph.beam_radii) };
    if spec.hub.is_some() {
        own.nodes.clear();
        return Ok(own);
    }
    if own.is_empty() {
        let message = "\"radius\" is missing, and the file has none: of a beam at mid length, mm";
        return Err(DesignError::new(&environment.path, message));
    }
    // A hub holds the ends of its beams.
    let mut sizes = own.nodes.clone();
    sizes.resize(graph.nodes.len(), f64::NAN);
    // The radius of a beam that was a chain is that at mid length.
    for (ends, radii) in graph.beams.iter().zip(&own.struts).take(joined.beams.start as usize) {
        for (n, r) in ends.iter().zip(radii) {
            sizes[*n as usize] = sizes[*n as usize].max(*r);
        }
    }
    for (given, size) in own.nodes.iter_mut().zip(&sizes).filter(|(given, _)| !given.is_nan()) {
        *given = *size;
    }
    let wire = Wireframe { nodes: std::mem::take(&mut graph.nodes), struts: std::mem::take(&mut graph.beams) };
    let differs = |r: f64, n: u32| (r - sizes[n as usize]).abs() > 1e-9 * r;
    let (mut swallowed, mut thinner) = (0, 0);
    let mut kept = Vec::with_capacity(wire.struts.len());
    for (i, s) in wire.struts.iter().enumerate() {
        let [a, b] = s.map(|n| sizes[n as usize]);
        let length = wire.length(*s);
        // Beams of no length are counted where nodes are merged.
        let inside = length > 0.0 && length <= (a - b).abs();
        swallowed += usize::from(inside);
        let unlike = own.struts.get(i).is_some_and(|r| differs(r[0], s[0]) || differs(r[1], s[1]));
        thinner += usize::from(unlike && !inside && !joined.beams.contains(&(i as u32)));
        kept.push(!inside);
    }
    let mut left = kept.iter();
    own.struts.retain(|_| left.next() == Some(&true));
    graph.nodes = wire.nodes;
    graph.beams = wire.struts.into_iter().zip(kept).filter(|(_, k)| *k).map(|(s, _)| s).collect();
    if swallowed > 0 {
        remarks.push(format!("{} within the ball of a hub left out", counted(swallowed, "beam")));
    }
    if thinner > 0 {
        remarks.push(format!(
            "{} thinner at an end than the hub there: made a quadric tangent to the hubs' balls, with the mean of its radii at mid \
             length",
            counted(thinner, "beam")
        ));
    }
    Ok(own)
}
