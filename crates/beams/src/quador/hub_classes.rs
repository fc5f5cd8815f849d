//! Classes of hubs that are equal up to translation: one representative is computed for all.

use std::collections::HashMap;

use super::Quadors;

/// A partition of the hubs into classes of equal hubs.
pub(super) struct HubClasses {
    /// The class of each hub.
    pub of: Vec<u32>,
    /// A representative of each class.
    pub sample: Vec<usize>,
    /// Number of hubs of each class.
    pub count: Vec<usize>,
}

/// Rounding before comparison: of directions, and of lengths in units of the typical radius.
const DIGITS: f64 = 1e9;

impl Quadors {
    /// The classes of all hubs: equal to 1e-9, beams in the same order.
    pub(super) fn classes(&self) -> HubClasses {
        let mut known: HashMap<Vec<i64>, u32> = HashMap::new();
        let (mut sample, mut count) = (Vec::new(), Vec::new());
        let per = DIGITS / self.scale;
        let length = |v: f64| (v * per).round() as i64;
        let number = |v: f64| (v * DIGITS).round() as i64;
        let of = (0..self.len())
            .map(|i| {
                let hub = self.hub(i);
                let mut key = Vec::with_capacity(1 + 9 * hub.half_beams.len());
                key.push(length(hub.radius));
                for s in hub.half_beams {
                    key.extend(s.axis.map(number));
                    key.extend([s.contact, s.split].map(length));
                    key.push(number(s.meridian[0]));
                    key.push(s.end as i64);
                }
                key.extend(hub.taus.iter().map(|tau| number(*tau)));
                *known.entry(key).or_insert_with(|| {
                    sample.push(i);
                    count.push(0);
                    sample.len() as u32 - 1
                })
            })
            .collect::<Vec<u32>>();
        of.iter().for_each(|&c| count[c as usize] += 1);
        HubClasses { of, sample, count }
    }
}
