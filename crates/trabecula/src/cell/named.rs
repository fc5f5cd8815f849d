//! Named surfaces.
use super::series::Term;

/// A named surface.
pub struct Named {
    /// Name in designs.
    pub name: &'static str,
    /// The usual long name.
    pub title: &'static str,
    /// f in the field's notation (s = sin 2πx, c2x = cos 4πx …).
    pub formula: &'static str,
    /// Space group of f (Hermann–Mauguin and number).
    pub group: &'static str,
    /// Where the form comes from.
    pub source: &'static str,
    /// The series.
    pub terms: fn() -> Vec<Term>,
}

/// All named surfaces.
pub fn catalogue() -> &'static [Named] {
    &[]
}

/// The named surface of this name.
pub fn named(name: &str) -> Option<&'static Named> {
    catalogue().iter().find(|n| n.name == name)
}
