//! Tables of what has a name or a number: looked up far more often than anything else here.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Names are spread well by a multiplication; nobody chooses them to collide.
#[derive(Default)]
pub(super) struct Spread(u64);

impl Hasher for Spread {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..part.len()].copy_from_slice(part);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_usize(&mut self, n: usize) {
        self.write_u64(n as u64);
    }

    fn write_u64(&mut self, n: u64) {
        const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
        self.0 = (self.0 ^ n).wrapping_mul(ODD).rotate_left(32);
    }

    fn write_u128(&mut self, n: u128) {
        self.write_u64(n as u64);
        self.write_u64((n >> 64) as u64);
    }
}

/// Something by names or numbers of places.
pub(super) type By<K, T> = HashMap<K, T, BuildHasherDefault<Spread>>;
/// Something by the names of vertices.
pub(super) type ByName<T> = By<u128, T>;
