//! Advice where a map folds, or where directions wind round lines that no core covers.

use super::core_solve;
use super::frame::Orientation;
use super::phase_request::PhaseRequest;
use super::singular_lines::{FrameEquivalence, SingularLine};
use geometry::fault::{Fault, number, position};
use geometry::math::Vec3;

impl PhaseRequest {
    /// What makes directions vary more slowly where `smooth` is possible, else where the surface alone gives them.
    pub(super) fn smoother(&self) -> &'static str {
        match (&self.orientation, self.align) {
            (Orientation::Angles(_), Some(_)) => {
                "give a larger align_depth, over half of which directions are averaged"
            }
            (Orientation::Angles(_), None) => "let the angles vary more slowly",
            _ => "smooth directions over more than a wavelength (smooth, in mm)",
        }
    }

    /// How the lines can be covered, if they can.
    fn cover(&self, singular: &[SingularLine]) -> Option<String> {
        let served = !singular.is_empty()
            && singular.len() <= core_solve::MOST
            && self.core.is_none()
            && !matches!(self.alike(), FrameEquivalence::Line)
            && !singular.iter().any(SingularLine::is_closed);
        let lines = if singular.len() == 1 { "the line" } else { "the lines" };
        served.then(|| match core_solve::refuse(self) {
            Ok(()) => format!("cover {lines} with core = \"solid\" or \"void\""),
            Err(clash) => format!("cover {lines} with core = \"solid\" or \"void\" in place of {}", clash.at),
        })
    }
}

/// What may keep a map from folding, whose cells are at most `longest` mm long.
pub(super) fn remedy(wanted: &PhaseRequest, longest: f64, covered: bool, singular: &[SingularLine]) -> String {
    let slower = "let orientation and wavelength vary more slowly";
    let smoother = match (&wanted.orientation, wanted.smooth) {
        (Orientation::Angles(_), _) => wanted.align.map(|_| wanted.smoother().to_string()),
        (of, None) => Some(format!("smooth the {} over a length, such as smooth = {}", of.key(), number(longest))),
        (_, Some(length)) => Some(format!("use a smooth of more than {} mm", number(length))),
    };
    let more = match (covered, wanted.stretch) {
        (true, _) => Some("give a larger core_radius"),
        // Where directions wind a range unfolds nothing.
        (false, None) if singular.is_empty() => {
            Some("bound what cells are stretched by, such as stretch = [0.67, 1.5]")
        }
        _ => None,
    };
    let all = [wanted.cover(singular), smoother, Some(slower.into()), more.map(String::from)];
    let text = all.into_iter().flatten().collect::<Vec<_>>().join(", ");
    text[..1].to_uppercase() + &text[1..]
}

/// A map that folds at a place.
pub(super) fn folded(p: Vec3, remedy: &str, tried: &str) -> Fault {
    let message = format!(
        "the map folds at {} (det J ≤ 0): cells turn inside out there{tried}. {remedy}, or allow it with folds = true",
        position(p)
    );
    Fault::new("", message)
}
