//! Which hubs of a repeat differ.

/// Which hubs along a step differ: the first and the last few, and one for all between; or every one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Classes {
    pub count: usize,
    /// How many at either end have less neighbours; none if every one differs.
    pub ends: Option<usize>,
}

impl Classes {
    pub fn len(&self) -> usize {
        match self.ends {
            Some(m) if self.count > 2 * m + 1 => 2 * m + 1,
            _ => self.count,
        }
    }

    /// The class of an index.
    pub fn of(&self, i: usize) -> usize {
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

    /// The first index of a class, and how many there are of it.
    pub fn members(&self, class: usize) -> (usize, usize) {
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
