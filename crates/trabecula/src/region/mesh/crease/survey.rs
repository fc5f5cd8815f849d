//! What is found out about patches beforehand: which need different colors, and in which ways they meet.

use std::collections::HashMap;

use super::super::MeshRegion;
use super::super::patches::Patches;
use super::{COLORS, Creased, LOOKS, NEAR, REACH, SETS, Set, bits};
use crate::math::{Vec3, add, scale};

impl Creased {
    /// Gives patches that are near each other different colors, as far as there are enough.
    pub(super) fn paint(&mut self, places: &[Vec3], count: usize) {
        if count <= COLORS {
            self.color = (0..count as u8).collect();
            self.colors = count;
        } else {
            let mut beside: Vec<HashMap<u32, u32>> = vec![HashMap::new(); count];
            let mut hits = Vec::new();
            for p in places {
                self.around(*p, (REACH + NEAR) * self.step, &mut hits);
                for (i, a) in hits.iter().enumerate() {
                    for b in &hits[..i] {
                        let [a, b] = [a, b].map(|h| self.patch[h.triangle as usize]);
                        // The nearest ones matter most.
                        let weight = if i == 1 { 1000 } else { 1 };
                        *beside[a as usize].entry(b).or_default() += weight;
                        *beside[b as usize].entry(a).or_default() += weight;
                    }
                }
            }
            let mut order: Vec<usize> = (0..count).collect();
            order.sort_by_key(|i| std::cmp::Reverse(beside[*i].len()));
            let mut color = vec![u8::MAX; count];
            let mut used = [0usize; COLORS];
            for i in order {
                let mut cost = [0u64; COLORS];
                for (n, weight) in &beside[i] {
                    if let Some(c) = cost.get_mut(usize::from(color[*n as usize])) {
                        *c += u64::from(*weight);
                    }
                }
                let best = (0..COLORS)
                    .min_by_key(|c| (cost[*c], used[*c]))
                    .unwrap_or(0);
                color[i] = best as u8;
                used[best] += 1;
            }
            self.color = color;
            self.colors = COLORS;
        }
        self.switched = vec![false; self.colors];
    }

    /// Finds the ways in which patches meet.
    pub(super) fn survey(&mut self, places: &[Vec3]) {
        let mut hits = Vec::new();
        let mut found: HashMap<u32, usize> = HashMap::new();
        let mut ways: HashMap<(u32, Vec<u32>), usize> = HashMap::new();
        for p in places {
            self.around(*p, REACH * self.step, &mut hits);
            let mut members = self.members(*p, &hits);
            let cliques = self.cliques(*p, &mut members);
            let near = self.colors_of(&members, (1 << members.len()) - 1);
            let held: Vec<u32> = cliques
                .iter()
                .map(|c| self.colors_of(&members, *c))
                .collect();
            for c in held.iter().filter(|c| !c.is_power_of_two()) {
                *found.entry(*c).or_default() += 1;
            }
            *ways.entry((near, held)).or_default() += 1;
        }
        let mut sets: Vec<(usize, u32)> = found.into_iter().map(|(s, n)| (n, s)).collect();
        sets.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        sets.truncate(SETS);
        self.sets = sets
            .into_iter()
            .map(|(_, colors)| Set {
                colors,
                switched: false,
            })
            .collect();
        for (near, held) in ways.keys() {
            let alone = held
                .iter()
                .filter(|c| c.is_power_of_two())
                .fold(0, |w, c| w | c);
            for c in bits(near & !alone) {
                self.switched[c] = true;
            }
            for s in &mut self.sets {
                let inside = s.colors & near == s.colors;
                s.switched |= inside && !held.iter().any(|h| h & s.colors == *h);
            }
        }
    }
}

/// Places at which patches may meet: at borders, some elsewhere on the surface, and beside all these.
pub(super) fn places(region: &MeshRegion, patches: &Patches, step: f64) -> Vec<Vec3> {
    const BESIDE: [Vec3; 4] = [
        [0.0; 3],
        [1.3, 0.4, -0.7],
        [-0.8, 1.1, 0.5],
        [-0.5, -1.2, 0.9],
    ];
    let mesh = &region.mesh;
    let mut places = Vec::new();
    for e in patches
        .borders
        .iter()
        .step_by(patches.borders.len().div_ceil(LOOKS))
    {
        let (corners, k) = (
            mesh.corners(e.halves[0] as usize / 3),
            e.halves[0] as usize % 3,
        );
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        places.extend([a, scale(add(a, b), 0.5)]);
    }
    for i in (0..mesh.triangles.len()).step_by(mesh.triangles.len().div_ceil(LOOKS / 2)) {
        let [a, b, c] = mesh.corners(i);
        places.push(scale(add(a, add(b, c)), 1.0 / 3.0));
    }
    let beside = |p: Vec3| BESIDE.map(|b| add(p, scale(b, step)));
    places.into_iter().flat_map(beside).collect()
}
