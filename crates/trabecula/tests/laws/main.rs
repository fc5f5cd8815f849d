//! Laws of the whole: random designs, rates of convergence, bodies known exactly.

mod beam_fraction;
mod blend;
mod combined;
mod common;
mod crease;
mod damage;
mod fields;
mod flush;
mod islands;
mod local_thickness;
mod measured;
mod noisy_stress;
mod phase;
mod simplify;
mod skin;
mod smooth;
mod spaces;
mod spacing;
mod surface;
mod tets;
mod thickness;
mod tiling;
mod tiling_amounts;
mod tiling_fields;
mod walls;
mod wavelength;
