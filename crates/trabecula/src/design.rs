//! The design: the data, and its one road to a solid.
