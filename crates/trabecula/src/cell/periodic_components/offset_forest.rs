//! Union-find with offsets: connected components of a periodic graph, and the lattice translations of their closed paths.
//!
//! Each element stores its period relative to its parent; path halving adds these offsets. An edge between two
//! elements of one tree closes a path whose translation is the edge's period plus the difference of their offsets: it is added to
//! the component's sublattice. A component keeps the index of its eldest element (the elder rule of persistent homology).

use super::sublattice::{Int3, Sublattice};

/// A vector sum.
fn plus(a: Int3, b: Int3) -> Int3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// A vector difference.
fn minus(a: Int3, b: Int3) -> Int3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The effect of an edge between two elements.
pub(in crate::cell) enum UnionOutcome {
    /// They were connected in R³ already.
    Same,
    /// A component became connected with a translate of itself that was none of its translations.
    Loop {
        /// Its eldest element.
        component: u32,
        /// The translation (periods).
        shift: Int3,
    },
    /// Two components became one.
    Merged {
        /// Their eldest elements, the elder first, which stays that of the union.
        components: [u32; 2],
        /// The period of the second relative to the first.
        shift: Int3,
    },
}

/// Trees over elements of the torus. Each component has the sublattice of translations of its closed paths.
pub(in crate::cell) struct Forest {
    parent: Vec<u32>,
    /// The period of each element relative to its parent.
    shift: Vec<Int3>,
    /// When each element was added, or `ABSENT`.
    rank: Vec<u32>,
    /// For roots: the eldest element of the component, and its translations.
    elder: Vec<u32>,
    translations: Vec<Sublattice>,
    clock: u32,
}

const ABSENT: u32 = u32::MAX;

impl Forest {
    /// No element present, of `n`.
    pub(in crate::cell) fn new(n: usize) -> Forest {
        Forest {
            parent: (0..n as u32).collect(),
            shift: vec![[0; 3]; n],
            rank: vec![ABSENT; n],
            elder: (0..n as u32).collect(),
            translations: vec![Sublattice::default(); n],
            clock: 0,
        }
    }

    /// Adds an element, as a component of its own.
    pub(in crate::cell) fn insert(&mut self, i: u32) {
        self.rank[i as usize] = self.clock;
        self.clock += 1;
    }

    /// Whether an element is present.
    pub(in crate::cell) fn has(&self, i: u32) -> bool {
        self.rank[i as usize] != ABSENT
    }

    /// Whether the element is the eldest of its component.
    pub(in crate::cell) fn is_eldest(&mut self, i: u32) -> bool {
        let root = self.find(i).0;
        self.elder[root as usize] == i
    }

    /// The eldest element of the component of an element, and the period of the element relative to it.
    pub(in crate::cell) fn eldest(&mut self, i: u32) -> (u32, Int3) {
        let (root, period) = self.find(i);
        let eldest = self.elder[root as usize];
        (eldest, minus(period, self.find(eldest).1))
    }

    /// The translations of the component of an element.
    pub(in crate::cell) fn translations(&mut self, i: u32) -> Sublattice {
        let root = self.find(i).0;
        self.translations[root as usize]
    }

    /// Adds translations to the component of an element.
    pub(in crate::cell) fn add_translations(&mut self, i: u32, translations: &Sublattice) {
        let root = self.find(i).0;
        self.translations[root as usize].absorb(translations);
    }

    /// The root of an element, and the element's period relative to it; halves the path.
    fn find(&mut self, mut i: u32) -> (u32, Int3) {
        let mut total = [0; 3];
        loop {
            let p = self.parent[i as usize];
            if p == i {
                return (i, total);
            }
            let q = self.parent[p as usize];
            self.shift[i as usize] = plus(self.shift[i as usize], self.shift[p as usize]);
            self.parent[i as usize] = q;
            total = plus(total, self.shift[i as usize]);
            i = q;
        }
    }

    /// Whether `a`, and `b` moved by `wrap` periods, are connected in R³.
    pub(in crate::cell) fn together(&mut self, a: u32, b: u32, wrap: Int3) -> bool {
        let ((ra, ga), (rb, gb)) = (self.find(a), self.find(b));
        ra == rb && self.translations[ra as usize].contains(minus(plus(ga, wrap), gb))
    }

    /// Joins `a` with `b` moved by `wrap` periods.
    pub(in crate::cell) fn join(&mut self, a: u32, b: u32, wrap: Int3) -> UnionOutcome {
        let ((ra, ga), (rb, gb)) = (self.find(a), self.find(b));
        // The period of the root of b relative to the root of a.
        let gap = minus(plus(ga, wrap), gb);
        if ra == rb {
            let grew = self.translations[ra as usize].insert(gap);
            let component = self.elder[ra as usize];
            return if grew { UnionOutcome::Loop { component, shift: gap } } else { UnionOutcome::Same };
        }
        let (ea, eb) = (self.elder[ra as usize], self.elder[rb as usize]);
        let shift = minus(plus(gap, self.find(eb).1), self.find(ea).1);
        let back = |v| minus([0; 3], v);
        let (keep, lose, gap, components, shift) = if self.rank[ea as usize] < self.rank[eb as usize] {
            (ra, rb, gap, [ea, eb], shift)
        } else {
            (rb, ra, back(gap), [eb, ea], back(shift))
        };
        let translations = self.translations[lose as usize];
        self.translations[keep as usize].absorb(&translations);
        self.parent[lose as usize] = keep;
        self.shift[lose as usize] = gap;
        UnionOutcome::Merged { components, shift }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_closes_on_its_translate() {
        // Four elements round the torus along x; the last step wraps.
        let mut f = Forest::new(4);
        (0..4).for_each(|i| f.insert(i));
        for i in 0..3 {
            assert!(matches!(f.join(i, i + 1, [0; 3]), UnionOutcome::Merged { components: [0, _], .. }));
        }
        assert!(f.together(0, 3, [0; 3]) && !f.together(0, 3, [1, 0, 0]));
        assert!(matches!(f.join(3, 0, [1, 0, 0]), UnionOutcome::Loop { component: 0, shift: [1, 0, 0] }));
        assert!(f.together(0, 3, [-5, 0, 0]) && !f.together(0, 3, [0, 1, 0]));
        assert!(matches!(f.join(2, 1, [2, 0, 0]), UnionOutcome::Same));
    }

    #[test]
    fn shifts_are_between_elders_whatever_the_roots() {
        let mut f = Forest::new(4);
        [2, 0, 1, 3].into_iter().for_each(|i| f.insert(i));
        f.join(0, 1, [1, 0, 0]);
        f.join(3, 2, [0, 1, 0]);
        // 1 meets 3 across z: 0 at the origin, 1 at x, 3 at x + z, 2 at x + y + z.
        match f.join(1, 3, [0, 0, 1]) {
            UnionOutcome::Merged { components, shift } => assert_eq!((components, shift), ([2, 0], [-1, -1, -1])),
            _ => panic!("two components become one"),
        }
        assert!(f.together(0, 2, [1, 1, 1]) && f.together(2, 0, [-1, -1, -1]));
    }
}
