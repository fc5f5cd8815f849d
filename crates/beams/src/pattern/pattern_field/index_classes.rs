//! Classes of equal hubs along one repeat step.

/// Classes along a step: the first few and the last few indices one each, all between in one class; or every index its
/// own class.
#[derive(Clone, Copy, Debug)]
pub(super) struct IndexClasses {
    pub count: usize,
    /// Number of indices at either end with fewer neighbours; `None` if every index is its own class.
    pub ends: Option<usize>,
}

impl IndexClasses {
    pub(super) fn len(&self) -> usize {
        match self.ends {
            Some(m) if self.count > 2 * m + 1 => 2 * m + 1,
            _ => self.count,
        }
    }

    /// The class of an index.
    pub(super) fn of(&self, i: usize) -> usize {
        match self.ends {
            Some(m) if self.count > 2 * m + 1 => {
                if i < m {
                    i
                } else if i >= self.count - m {
                    i + 2 * m + 1 - self.count
                } else {
                    m
                }
            }
            _ => i,
        }
    }

    /// The first index of a class, and the number of its members.
    pub(super) fn members(&self, class: usize) -> (usize, usize) {
        match self.ends {
            Some(m) if self.count > 2 * m + 1 => {
                if class < m {
                    (class, 1)
                } else if class == m {
                    (m, self.count - 2 * m)
                } else {
                    (class + self.count - (2 * m + 1), 1)
                }
            }
            _ => (class, 1),
        }
    }
}
