//! The tetrahedra at nodes.

/// The tetrahedra at nodes, ascending.
pub(super) struct NodeTets {
    start: Vec<u32>,
    tets: Vec<u32>,
}

impl NodeTets {
    /// Of the nodes for which `wanted` holds; none at the others.
    pub fn new(tets: impl Iterator<Item = [u32; 4]> + Clone, wanted: &[bool]) -> NodeTets {
        let mut start = vec![0u32; wanted.len() + 1];
        let nodes = |t: [u32; 4]| t.into_iter().filter(|n| wanted[*n as usize]);
        tets.clone().flat_map(nodes).for_each(|n| start[n as usize + 1] += 1);
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut fill = start.clone();
        let mut of = vec![0u32; start[start.len() - 1] as usize];
        for (i, t) in (0..).zip(tets) {
            for n in nodes(t) {
                of[fill[n as usize] as usize] = i;
                fill[n as usize] += 1;
            }
        }
        NodeTets { start, tets: of }
    }

    /// The tetrahedra at node `n`.
    pub fn of(&self, n: u32) -> &[u32] {
        &self.tets[self.start[n as usize] as usize..self.start[n as usize + 1] as usize]
    }
}
