//! Union-find: numbers that belong together, as trees that grow together (Galler and Fischer, Communications of the ACM 7, 1964).
//!
//! `root[v]` is the next number on the way from v to the lowest of its own; to begin with each is its own.

/// The lowest number that belongs with `v`, halving the way there.
#[inline]
pub fn find(root: &mut [u32], mut v: u32) -> u32 {
    loop {
        let up = root[v as usize];
        if up == v {
            return v;
        }
        let next = root[up as usize];
        root[v as usize] = next;
        v = next;
    }
}

/// Joins what belongs with `a` and with `b`; whether they were apart.
#[inline]
pub fn unite(root: &mut [u32], a: u32, b: u32) -> bool {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b) as usize] = a.min(b);
    a != b
}

/// The partition of `n` numbers into singletons.
pub fn singles(count: usize) -> Vec<u32> {
    (0..count as u32).collect()
}

/// The number of each member's set, in the order of their lowest members, and how many sets there are.
pub fn labels(root: &mut [u32]) -> (Vec<u32>, usize) {
    let mut label = vec![u32::MAX; root.len()];
    let mut count = 0;
    for i in 0..label.len() {
        let r = find(root, i as u32) as usize;
        if r == i {
            label[i] = count;
            count += 1;
        } else {
            label[i] = label[r];
        }
    }
    (label, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_to_the_lowest_of_their_own() {
        let mut root = singles(6);
        assert!(unite(&mut root, 5, 3) && unite(&mut root, 1, 4) && unite(&mut root, 4, 5));
        assert!(!unite(&mut root, 1, 3));
        let found: Vec<u32> = (0..6).map(|v| find(&mut root, v)).collect();
        assert_eq!(found, [0, 1, 2, 1, 1, 1]);
        assert_eq!(labels(&mut root), (found, 3));
    }
}
