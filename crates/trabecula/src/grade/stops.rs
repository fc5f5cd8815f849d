//! Stops: a piecewise linear function of one number, given by pairs.

use crate::kind::{Defs, DesignError, Fault, Key, Kind, Node, NodeCursor};
use geometry::fault::number;
use geometry::math::Interval;

/// Pairs `[s, value]`, at least one, finite, s ascending. Between them a function is linear ([`Stops::at`]) or constant
/// ([`Stops::step`]); before the first and after the last it is constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Stops(pub(crate) Vec<[f64; 2]>);

impl Kind for Stops {
    const DOC: &'static str = "Positions and the values taken there.";

    fn expected() -> String {
        "a list of [position, value]".into()
    }

    fn fits(node: &Node) -> u8 {
        Vec::<[f64; 2]>::fits(node)
    }

    fn read(at: &NodeCursor) -> Result<Self, DesignError> {
        let stops = at.list(&Self::expected())?;
        stops.iter().map(|s| s.numbers("[position, value]")).collect::<Result<Vec<_>, _>>().map(Stops)
    }

    fn write(&self) -> Node {
        self.0.write()
    }

    /// The limits of `key` are those of the values.
    fn check(&self, key: &Key) -> Result<(), Fault> {
        if self.0.is_empty() {
            return Err(Fault::new("", "no stops given; give at least one [position, value]"));
        }
        let mut last = f64::NEG_INFINITY;
        for (i, &[at, value]) in self.0.iter().enumerate() {
            let here = |f: Fault| f.under(&format!("[{i}]"));
            Key::NONE.admit(at).map_err(here)?;
            if at <= last {
                let message =
                    format!("positions must rise from stop to stop, found {} after {}", number(at), number(last));
                return Err(here(Fault::new("", message).found(number(at))));
            }
            last = at;
            key.admit_at(value, &format!(" at position {}", number(at))).map_err(here)?;
        }
        Ok(())
    }

    fn schema(_: &Key, defs: &mut Defs) -> Node {
        let pairs = Vec::<[f64; 2]>::schema(&Key { least: 1, ..Key::NONE }, defs);
        pairs.with("x-type", "Stops".into())
    }
}

impl Stops {
    /// One less each value.
    pub fn complement(mut self) -> Stops {
        self.0.iter_mut().for_each(|s| s[1] = 1.0 - s[1]);
        self
    }

    /// Value and slope of the piecewise linear function at `s`. At a stop, the slope of the segment that begins there.
    #[inline]
    pub fn at(&self, s: f64) -> (f64, f64) {
        let i = self.0.partition_point(|p| p[0] <= s);
        match (i.checked_sub(1).and_then(|j| self.0.get(j)), self.0.get(i)) {
            (Some([s0, v0]), Some([s1, v1])) => {
                let slope = (v1 - v0) / (s1 - s0);
                ((v0 + slope * (s - s0)).clamp(v0.min(*v1), v0.max(*v1)), slope)
            }
            (Some([_, v]), None) | (None, Some([_, v])) => (*v, 0.0),
            (None, None) => (f64::NAN, 0.0),
        }
    }

    /// The first and the last position: beyond them a function is constant.
    pub fn ends(&self) -> Interval {
        Interval::new(self.0[0][0], self.0[self.0.len() - 1][0])
    }

    /// An interval that contains every value of the piecewise linear function on an interval: exact but for rounding.
    pub fn range(&self, s: Interval) -> Interval {
        if s.lo.is_nan() || s.hi.is_nan() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let mut largest = 0.0f64;
        let (a, b) = (self.at(s.lo).0, self.at(s.hi).0);
        let mut r = Interval::new(a.min(b), a.max(b));
        for [at, v] in &self.0 {
            largest = largest.max(v.abs());
            if (s.lo..=s.hi).contains(at) {
                r = r.union(Interval::new(*v, *v));
            }
        }
        let slack = largest * 4.0 * f64::EPSILON;
        Interval::new(r.lo - slack, r.hi + slack)
    }

    /// The index of the last stop at or below `s`, else of the first stop.
    #[inline]
    fn below(&self, s: f64) -> usize {
        self.0.partition_point(|p| p[0] <= s).max(1) - 1
    }

    /// The value of the last stop at or below `s`, else of the first stop.
    #[inline]
    pub fn step(&self, s: f64) -> f64 {
        self.0[self.below(s)][1]
    }

    /// The least and the greatest value of the piecewise constant function on an interval; exact.
    pub fn step_range(&self, s: Interval) -> Interval {
        let taken = match s.lo.is_nan() || s.hi.is_nan() {
            true => &self.0[..],
            false => &self.0[self.below(s.lo.min(s.hi))..=self.below(s.hi.max(s.lo))],
        };
        let [lo, hi] = taken.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], p| [l.min(p[1]), h.max(p[1])]);
        Interval::new(lo, hi)
    }
}
