//! A skin, as it is declared, and where it leaves the region's surface open.

use super::data::GradeSpec;
use crate::kind::Kind;
use crate::region::{HalfSpaceKind, RegionKind};

/// A skin: the part of the region that is at most so far below its surface.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Skin", noun = "a skin")]
pub struct SkinSpec {
    /// Depth below the region's surface to which it reaches.
    #[kind(unit = "mm", above = 0.0)]
    pub thickness: GradeSpec,
    /// Where it leaves the region's surface open: flat faces, named as sides of its bounds such as "-z" or by half-spaces, faces that
    /// a STEP file names, or what lies in another region.
    #[kind(default)]
    pub open: Vec<OpenSpec>,
}

/// What stays open of the region's surface.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(untagged)]
pub enum OpenSpec {
    /// The flat face on a side of the region's bounds.
    Side(SideSpec),
    /// A place.
    Place(OpenPlace),
}

/// A place that stays open.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a half-space, faces or a region", alternatives)]
pub enum OpenPlace {
    /// The flat face on the plane of a half-space, facing as its normal does.
    Plane(HalfSpaceKind),
    /// Faces that a STEP file names.
    Faces(OpenFaces),
    /// What lies in another region.
    Region(OpenRegion),
}

/// Faces from which no skin grows.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct OpenFaces {
    /// Faces of the region's STEP file from which no skin grows, each by its name, its colour such as "#ff0000", or its number.
    #[kind(least = 1)]
    pub faces: Vec<String>,
}

/// A region in which there is no skin.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct OpenRegion {
    /// The region in which there is no skin.
    pub region: RegionKind,
}

/// A side of the region's bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(name = "Side", noun = "side")]
pub enum SideSpec {
    /// Least x.
    #[kind(rename = "-x", hints("left", "xmin"))]
    LowX,
    /// Greatest x.
    #[kind(rename = "+x", hints("right", "xmax"))]
    HighX,
    /// Least y.
    #[kind(rename = "-y", hints("front", "ymin"))]
    LowY,
    /// Greatest y.
    #[kind(rename = "+y", hints("back", "ymax"))]
    HighY,
    /// Least z: the bottom.
    #[kind(rename = "-z", hints("bottom", "down", "zmin"))]
    LowZ,
    /// Greatest z: the top.
    #[kind(rename = "+z", hints("top", "up", "zmax"))]
    HighZ,
}

impl SideSpec {
    /// Its axis, and whether it is the upper one.
    pub fn axis(self) -> (usize, bool) {
        match self {
            SideSpec::LowX => (0, false),
            SideSpec::HighX => (0, true),
            SideSpec::LowY => (1, false),
            SideSpec::HighY => (1, true),
            SideSpec::LowZ => (2, false),
            SideSpec::HighZ => (2, true),
        }
    }
}
