//! Steps that are too coarse for the surface of a lattice over tetrahedra, where what it should be is known exactly.

use super::Built;
use crate::tiling::{connectivity, steps_enough};
use geometry::fault::{counted, number};

/// Share of the solid's volume by which a surface may be off.
const OFF: f64 = 0.01;
/// The same on a grid, of which a cell is as often solid by mistake as it is void.
const OFF_GRID: f64 = 0.05;
/// Share of the mesh that may be solid or not: with an overlap, and where tetrahedra are bent, the fraction is known by samples.
const SAMPLED: f64 = 0.002;
/// The most of a volume that chords are taken to cost, times the square of the steps along the edge of a tetrahedron: a tenth at twelve steps.
/// What is more off than that has another cause, and no finer step is advised for it.
const CHORDS: f64 = 0.1 * 12.0 * 12.0;
/// Fewest steps along the edge of a tetrahedron.
pub(super) const LEAST: f64 = 4.0;

impl Built {
    /// What is wrong with the surface of a lattice over tetrahedra that was made in steps of `edge` (mm), encloses `volume`
    /// (mm³) and has this number of `pieces`, and the step that suffices; `None` if nothing is, and for other solids.
    pub fn coarse_steps(&self, edge: f64, volume: f64, pieces: usize) -> Option<String> {
        let [only] = &self.tilings[..] else { return None };
        if self.blend.is_some() || !self.solid.filled.is_empty() {
            return None;
        }
        let tiling = &only.tiling;
        let (flat, solid) = tiling.volumes();
        let all = only.mesh.region_volume.filter(|_| tiling.map.is_bent()).unwrap_or(flat);
        let (found, share) = (volume / all, only.finished.unwrap_or(solid / flat));
        let off = found / share - 1.0;
        let predicted = if pieces > 1 { connectivity(tiling).map(|c| c.components) } else { None };
        let broken = predicted.filter(|p| pieces > *p);
        let most = match only.explicit {
            false => OFF_GRID,
            true if tiling.map.overlap() > 0.0 || only.finished.is_some() => OFF.max(SAMPLED / share),
            true => OFF,
        };
        if off.abs() <= most && broken.is_none() {
            return None;
        }
        let mean = tiling.map.mean_edge();
        let steps = (mean / edge).round().max(LEAST);
        // The error of the volume falls with the square of the step. More than chords cost is nothing that finer steps mend.
        let for_volume = (steps * (off.abs() / most).sqrt()).ceil();
        let for_volume = if only.explicit { for_volume.min((CHORDS / most).sqrt().ceil()) } else { for_volume };
        // On a grid, how many pieces finer steps leave is not known without making them.
        let unknown = broken.is_some() && !only.explicit;
        let for_pieces =
            broken.filter(|_| !unknown).and_then(|_| steps_enough(tiling, steps as usize + 1)).unwrap_or(0);
        let enough = for_volume.max(for_pieces as f64);
        if enough <= steps && !unknown {
            return None;
        }
        let of_volume = (off.abs() > most)
            .then(|| format!("has a solid fraction of {found:.4}, the lattice {share:.4} ({:+.1} %)", 100.0 * off));
        let apart =
            broken.map(|p| format!("is in {}, the lattice in {}", counted(pieces, "piece"), counted(p, "piece")));
        let wrong: Vec<String> = of_volume.into_iter().chain(apart).collect();
        let edge_enough = number((1e3 * mean / enough).floor() / 1e3);
        let advice = match (enough > steps, unknown) {
            (true, false) => {
                format!("use an edge of {edge_enough} mm or less, {enough} steps along that of a tetrahedron")
            }
            (true, true) => {
                format!("an edge of {edge_enough} mm or less mends the fraction; still finer ones may join the pieces")
            }
            (false, _) => "finer ones may join the pieces, and islands = \"drop\" leaves out the loose ones".into(),
        };
        Some(format!("steps of {} mm are too coarse: the result {}; {advice}", number(edge), wrong.join(" and ")))
    }
}
