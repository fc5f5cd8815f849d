use super::Region;
/// Union.
pub struct Union(pub Vec<Region>);
/// Intersection.
pub struct Intersection(pub Vec<Region>);
/// The first without the others.
pub struct Difference(pub Vec<Region>);
/// A region grown (positive) or shrunk.
pub struct Offset {
    /// The region.
    pub of: Region,
    /// mm.
    pub by: f64,
}
