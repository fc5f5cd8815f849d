//! Candidates in order of their cost, to about three parts in a hundred.
//!
//! A bucket holds the costs that share their exponent and five bits of their mantissa. Adding and taking are a few
//! instructions, the order within a bucket is that of a stack, and nothing depends on anything but the calls.

/// Low bits of a single-precision cost that are ignored.
const DROPPED: u32 = 18;

/// A candidate: half-edge, and the versions of its ends when it was put in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// The half-edge.
    pub edge: u32,
    /// Sum of the versions of its ends.
    pub stamp: u32,
}

/// The queue.
pub struct Queue {
    buckets: Vec<Vec<Candidate>>,
    lowest: usize,
}

impl Queue {
    /// An empty queue.
    pub fn new() -> Queue {
        Queue { buckets: vec![Vec::new(); (f32::INFINITY.to_bits() >> DROPPED) as usize + 1], lowest: 0 }
    }

    /// Adds a candidate of cost `cost` ≥ 0.
    pub fn push(&mut self, cost: f64, candidate: Candidate) {
        let bucket = ((cost.max(0.0) as f32).to_bits() >> DROPPED) as usize;
        let last = self.buckets.len() - 1;
        self.buckets[bucket.min(last)].push(candidate);
        self.lowest = self.lowest.min(bucket);
    }

    /// Takes the cheapest candidate.
    pub fn pop(&mut self) -> Option<Candidate> {
        while let Some(bucket) = self.buckets.get_mut(self.lowest) {
            if let Some(c) = bucket.pop() {
                return Some(c);
            }
            *bucket = Vec::new(); // costs rise: what this one held is not wanted again
            self.lowest += 1;
        }
        self.lowest = self.buckets.len() - 1;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_come_out_in_order() {
        let mut q = Queue::new();
        let costs: Vec<f64> =
            (0..1000u32).map(|i| f64::from(i * 7919 % 1000).powi(5) * 1e-9).chain([f64::INFINITY, 0.0]).collect();
        for (i, c) in costs.iter().enumerate() {
            let edge = i as u32;
            q.push(*c, Candidate { edge, stamp: 0 });
        }
        let mut last = 0.0f64;
        let mut n = 0;
        while let Some(c) = q.pop() {
            let cost = costs[c.edge as usize];
            // A bucket spans a 32nd of its power of two.
            assert!(cost >= last / (1.0 + 1.0 / 32.0), "{cost} after {last}");
            last = last.max(cost);
            n += 1;
            if n == 500 {
                q.push(0.0, Candidate { edge: 0, stamp: 1 });
                assert_eq!(q.pop().map(|c| c.stamp), Some(1));
            }
        }
        assert_eq!(n, costs.len());
    }
}
