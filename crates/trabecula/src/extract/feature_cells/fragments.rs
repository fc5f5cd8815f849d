//! A simplex cut by one plane after the other into convex fragments.

/// A vertex while a simplex is cut: the corners of the face in which it lies and the surfaces that meet there, as bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::extract) struct CutVertex {
    pub corners: u8,
    pub surfaces: u64,
}

/// The convex fragments of a simplex, and their facets, as numbers of vertices. The buffers serve for one simplex after the
/// other, as most have few fragments.
#[derive(Default)]
pub(in crate::extract) struct Fragments {
    /// All vertices, corners of the simplex first.
    pub vertices: Vec<CutVertex>,
    /// Values of the surfaces that cut it at its corners, by surface.
    pub values: Vec<[f64; 4]>,
    /// Whether the surface that cuts next is negative at each vertex.
    pub negative: Vec<bool>,
    now: FragmentList,
    next: FragmentList,
    /// Where the plane cuts the facets of one fragment, directed as in the new facet of its negative part.
    edges: Vec<(u16, u16)>,
}

/// Fragments one after the other, their facets, and the rings of these.
#[derive(Default)]
struct FragmentList {
    /// The surfaces that are negative in each fragment, and the end of its facets.
    fragments: Vec<(u64, usize)>,
    /// The surface on which each facet lies, unless it is part of a facet of the simplex, and the end of its ring.
    facets: Vec<(Option<usize>, usize)>,
    rings: Vec<u16>,
}

impl FragmentList {
    fn clear(&mut self) {
        self.fragments.clear();
        self.facets.clear();
        self.rings.clear();
    }

    fn facet(&mut self, surface: Option<usize>, ring: impl IntoIterator<Item = u16>) {
        self.rings.extend(ring);
        self.facets.push((surface, self.rings.len()));
    }
}

impl Fragments {
    /// Starts with one fragment: a simplex where the surfaces `negative` are negative and of which these are facets,
    /// counter-clockwise seen from outside, with the surfaces on which they lie; or one of its facets.
    pub fn start(&mut self, negative: u64, facets: impl IntoIterator<Item = (Option<usize>, [u16; 3])>) {
        self.vertices.clear();
        self.vertices.extend([1, 2, 4, 8].map(|corners| CutVertex { corners, surfaces: 0 }));
        self.now.clear();
        for (surface, ring) in facets {
            self.now.facet(surface, ring);
        }
        self.now.fragments.push((negative, self.now.facets.len()));
    }

    /// All facets: the surfaces that are negative in its fragment, the surface on which it lies, its ring.
    pub fn facets(&self) -> impl Iterator<Item = (u64, Option<usize>, &[u16])> {
        let FragmentList { fragments, facets, rings } = &self.now;
        let mut fragment = 0;
        let mut start = 0;
        facets.iter().enumerate().map(move |(n, &(surface, end))| {
            while n >= fragments[fragment].1 {
                fragment += 1;
            }
            let ring = &rings[start..end];
            start = end;
            (fragments[fragment].0, surface, ring)
        })
    }

    /// The facets on surfaces that are negative behind them: each facet between two fragments once.
    pub fn negative_facets(&self) -> impl Iterator<Item = (u64, usize, &[u16])> {
        let on = self.facets().filter_map(|(negative, surface, ring)| Some((negative, surface?, ring)));
        on.filter(|(negative, f, _)| negative >> f & 1 == 1)
    }

    /// Cuts all fragments by the plane of a surface, whose signs are in `negative`.
    pub fn cut(&mut self, surface: usize) {
        let now = std::mem::take(&mut self.now);
        self.next.clear();
        let first = self.vertices.len();
        let mut from = 0;
        for &(negative, end) in &now.fragments {
            self.edges.clear();
            for inside in [true, false] {
                let before = self.next.facets.len();
                for n in from..end {
                    let start = n.checked_sub(1).map_or(0, |n| now.facets[n].1);
                    let (on, stop) = now.facets[n];
                    self.half(surface, inside, on, &now.rings[start..stop], first);
                }
                if self.next.facets.len() > before {
                    self.close(surface, inside);
                    let own = if inside { 1 << surface } else { 0 };
                    self.next.fragments.push((negative | own, self.next.facets.len()));
                }
            }
            from = end;
        }
        self.now = std::mem::replace(&mut self.next, now);
    }

    /// Adds the part of a facet on one side of the plane. The new vertices begin at `first`.
    fn half(&mut self, surface: usize, inside: bool, on: Option<usize>, ring: &[u16], first: usize) {
        let is_inside = |v: u16| self.negative[usize::from(v)];
        let count = ring.iter().filter(|v| is_inside(**v)).count();
        if count == 0 || count == ring.len() {
            if (count > 0) == inside {
                self.next.facet(on, ring.iter().copied());
            }
            return;
        }
        let begin = self.next.rings.len();
        let (mut leave, mut enter) = (None, None);
        for i in 0..ring.len() {
            let ends = [ring[i], ring[(i + 1) % ring.len()]];
            let [a, b] = ends.map(|v| self.negative[usize::from(v)]);
            if a == inside {
                self.next.rings.push(ring[i]);
            }
            if a != b {
                let new = self.crossing(ends, surface, first);
                self.next.rings.push(new);
                *(if a { &mut leave } else { &mut enter }) = Some(new);
            }
        }
        if self.next.rings.len() > begin + 2 {
            self.next.facets.push((on, self.next.rings.len()));
        } else {
            self.next.rings.truncate(begin);
        }
        if inside {
            self.edges.extend(enter.zip(leave));
        }
    }

    /// The vertex in which the plane crosses an edge between two others.
    fn crossing(&mut self, ends: [u16; 2], surface: usize, first: usize) -> u16 {
        let [a, b] = ends.map(|v| self.vertices[usize::from(v)]);
        let new = CutVertex { corners: a.corners | b.corners, surfaces: (a.surfaces & b.surfaces) | 1 << surface };
        let known = self.vertices[first..].iter().position(|v| *v == new);
        let at = first + known.unwrap_or(self.vertices.len() - first);
        if at == self.vertices.len() {
            self.vertices.push(new);
        }
        at as u16
    }

    /// Adds the new facet in the plane.
    fn close(&mut self, surface: usize, inside: bool) {
        let Some(&(start, mut at)) = self.edges.first() else {
            return;
        };
        let begin = self.next.rings.len();
        self.next.rings.push(start);
        while at != start && self.next.rings.len() - begin <= self.edges.len() {
            self.next.rings.push(at);
            at = self.edges.iter().find(|e| e.0 == at).map_or(start, |e| e.1);
        }
        if self.next.rings.len() < begin + 3 {
            self.next.rings.truncate(begin);
            return;
        }
        if !inside {
            self.next.rings[begin..].reverse();
        }
        self.next.facets.push((Some(surface), self.next.rings.len()));
    }
}
