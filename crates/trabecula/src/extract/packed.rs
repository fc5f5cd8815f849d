//! Numbers as bytes, the same on every system, and back: whole numbers in groups of seven bits, the lowest first (LEB128).

use geometry::fault::Fault;

/// Bytes that grow.
#[derive(Default)]
pub(super) struct Packer(pub Vec<u8>);

impl Packer {
    pub fn whole(&mut self, mut v: u128) {
        while v >= 0x80 {
            self.0.push(v as u8 | 0x80);
            v >>= 7;
        }
        self.0.push(v as u8);
    }

    pub fn count(&mut self, v: usize) {
        self.whole(v as u128);
    }

    pub fn real(&mut self, v: f64) {
        self.0.extend(v.to_le_bytes());
    }
}

/// Bytes that are read. Nothing that they may hold leads to a panic, or to more memory than some times their own number.
pub(super) struct Unpacker<'a>(pub &'a [u8]);

/// What is said of bytes that are none of ours.
pub(super) fn damaged() -> Fault {
    Fault::new("", "the partial result of a range of tiles is damaged; make the range again")
}

impl Unpacker<'_> {
    pub fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let (first, rest) = self.0.split_first_chunk::<N>().ok_or_else(damaged)?;
        self.0 = rest;
        Ok(*first)
    }

    pub fn whole(&mut self) -> Result<u128, Fault> {
        let mut v = 0;
        for shift in (0..128).step_by(7) {
            let [byte] = self.take()?;
            v |= u128::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(v);
            }
        }
        Err(damaged())
    }

    /// A whole number below a limit.
    pub fn below(&mut self, limit: u128) -> Result<u32, Fault> {
        let v = self.whole()?;
        u32::try_from(v).ok().filter(|_| v < limit).ok_or_else(damaged)
    }

    /// The number of things that follow, of a byte each at least.
    pub fn count(&mut self) -> Result<usize, Fault> {
        let v = self.whole()?;
        usize::try_from(v).ok().filter(|n| *n <= self.0.len()).ok_or_else(damaged)
    }

    pub fn word(&mut self) -> Result<u64, Fault> {
        u64::try_from(self.whole()?).map_err(|_| damaged())
    }

    pub fn real(&mut self) -> Result<f64, Fault> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    pub fn reals<const N: usize>(&mut self) -> Result<[f64; N], Fault> {
        let mut all = [0.0; N];
        for v in &mut all {
            *v = self.real()?;
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_and_damaged_bytes_are_refused() {
        let wholes = [0, 1, 127, 128, 300, u128::from(u64::MAX), u128::MAX];
        let mut packer = Packer::default();
        wholes.iter().for_each(|v| packer.whole(*v));
        packer.real(-0.1);
        let mut back = Unpacker(&packer.0);
        assert!(wholes.iter().all(|v| back.whole().ok() == Some(*v)));
        assert_eq!((back.real().ok(), back.0.len()), (Some(-0.1), 0));
        assert!(back.whole().is_err() && back.real().is_err());
        assert!(Unpacker(&[0xff; 30]).whole().is_err() && Unpacker(&[5, 0, 0]).count().is_err());
    }
}
