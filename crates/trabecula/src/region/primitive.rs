/// An axis-aligned box.
pub struct Cuboid;
/// A cylinder.
pub struct Cylinder;
/// A half-space.
pub struct HalfSpace;
/// A ball.
pub struct Sphere;
