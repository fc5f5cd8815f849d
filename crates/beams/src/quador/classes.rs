//! Hubs that are equal but for their place: what is found of one holds for all.

use std::collections::HashMap;

use super::Quadors;

/// Hubs by what they are, wherever they are.
pub(super) struct Classes {
    /// The class of each hub.
    pub of: Vec<u32>,
    /// A hub of each class.
    pub sample: Vec<usize>,
    /// How many hubs each class has.
    pub count: Vec<usize>,
}

/// What numbers are rounded to before they are compared: of directions, and of lengths in the lattice's typical radius.
const DIGITS: f64 = 1e9;

impl Quadors {
    /// The classes of all hubs: equal to a billionth, beams in the same order.
    pub(super) fn classes(&self) -> Classes {
        let mut known: HashMap<Vec<i64>, u32> = HashMap::new();
        let (mut sample, mut count) = (Vec::new(), Vec::new());
        let per = DIGITS / self.scale;
        let length = |v: f64| (v * per).round() as i64;
        let number = |v: f64| (v * DIGITS).round() as i64;
        let of = (0..self.len())
            .map(|i| {
                let hub = self.hub(i);
                let mut key = Vec::with_capacity(1 + 9 * hub.stubs.len());
                key.push(length(hub.radius));
                for s in hub.stubs {
                    key.extend(s.axis.map(number));
                    key.extend([s.contact, s.split].map(length));
                    key.extend([s.section[0], s.share].map(number));
                    key.push(s.end as i64);
                }
                *known.entry(key).or_insert_with(|| {
                    sample.push(i);
                    count.push(0);
                    sample.len() as u32 - 1
                })
            })
            .collect::<Vec<u32>>();
        of.iter().for_each(|&c| count[c as usize] += 1);
        Classes { of, sample, count }
    }
}
