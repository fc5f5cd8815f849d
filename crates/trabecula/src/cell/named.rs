//! The named surfaces: each a short Fourier series, with its formula, symmetry and source.

use std::sync::{Arc, OnceLock};

use super::Cell;
use super::series::{Series, Term};
use geometry::fault::Fault;

/// A named surface.
#[derive(Clone, Copy, Debug)]
pub struct NamedCell {
    /// Name in designs.
    pub name: &'static str,
    /// The usual long name.
    pub title: &'static str,
    /// f in the field's notation: sx = sin 2πx, c2y = cos 4πy, x y z in turns.
    pub formula: &'static str,
    /// Space group of the function f, Hermann–Mauguin symbol and number.
    pub group: &'static str,
    /// Where the form comes from.
    pub source: &'static str,
    /// f as a sum of products: (coefficient, one factor per axis).
    products: &'static [(f64, [Factor; 3])],
}

/// A factor of a product along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Factor {
    /// 1.
    One,
    /// cos 2πn·.
    C(i32),
    /// sin 2πn·.
    S(i32),
}

use Factor::{C, One, S};

/// The three products made from `(coefficient, [a, b, c])` by turning the axes cyclically.
const fn cyclic(k: f64, f: [Factor; 3]) -> [(f64, [Factor; 3]); 3] {
    [(k, f), (k, [f[2], f[0], f[1]]), (k, [f[1], f[2], f[0]])]
}

/// Joins cyclic triples and single products into one table at compile time.
macro_rules! products {
    ($n:expr; $($triple:expr),+ $(; $($single:expr),+)?) => {{
        const TABLE: [(f64, [Factor; 3]); $n] = {
            let triples = [$($triple),+];
            let singles: &[(f64, [Factor; 3])] = &[$($($single),+)?];
            let mut out = [(0.0, [One; 3]); $n];
            let mut i = 0;
            while i < 3 * triples.len() {
                out[i] = triples[i / 3][i % 3];
                i += 1;
            }
            while i < $n {
                out[i] = singles[i - 3 * triples.len()];
                i += 1;
            }
            out
        };
        &TABLE
    }};
}

const SCHOEN: &str =
    "Schoen, NASA TN D-5541 (1970); nodal form after von Schnering and Nesper, Z. Phys. B 83 (1991) 407";
const SCHWARZ: &str = "Schwarz, Gesammelte Mathematische Abhandlungen (1890); nodal form after von Schnering and Nesper, Z. Phys. B 83 (1991) 407";

static CATALOGUE: [NamedCell; 10] = [
    NamedCell {
        name: "gyroid",
        title: "Schoen gyroid",
        formula: "sx cy + sy cz + sz cx",
        group: "I 41 3 2 (214)",
        source: SCHOEN,
        products: products!(3; cyclic(1.0, [S(1), C(1), One])),
    },
    NamedCell {
        name: "gyroid_mirrored",
        title: "Schoen gyroid, the other hand",
        formula: "cx sy + cy sz + cz sx",
        group: "I 41 3 2 (214)",
        source: "SPARTAN equations, section 3; the mirror image of the usual form",
        products: products!(3; cyclic(1.0, [C(1), S(1), One])),
    },
    NamedCell {
        name: "diamond",
        title: "Schwarz diamond, four-term form",
        formula: "sx sy sz + sx cy cz + cx sy cz + cx cy sz",
        group: "F d -3 m (227)",
        source: SCHWARZ,
        products: products!(4; cyclic(1.0, [S(1), C(1), C(1)]); (1.0, [S(1), S(1), S(1)])),
    },
    NamedCell {
        name: "primitive",
        title: "Schwarz primitive",
        formula: "cx + cy + cz",
        group: "P m -3 m (221)",
        source: SCHWARZ,
        products: products!(3; cyclic(1.0, [C(1), One, One])),
    },
    NamedCell {
        name: "iwp",
        title: "Schoen I-WP, two-shell form",
        formula: "2(cx cy + cy cz + cz cx) - (c2x + c2y + c2z)",
        group: "I m -3 m (229)",
        source: SCHOEN,
        products: products!(6; cyclic(2.0, [C(1), C(1), One]), cyclic(-1.0, [C(2), One, One])),
    },
    NamedCell {
        name: "neovius",
        title: "Neovius, C(P)",
        formula: "3(cx + cy + cz) + 4 cx cy cz",
        group: "P m -3 m (221)",
        source: "Neovius, dissertation, Helsinki (1883); nodal form after von Schnering and Nesper, Z. Phys. B 83 (1991) 407",
        products: products!(4; cyclic(3.0, [C(1), One, One]); (4.0, [C(1), C(1), C(1)])),
    },
    NamedCell {
        name: "frd",
        title: "Schoen F-RD",
        formula: "4 cx cy cz - (c2x c2y + c2y c2z + c2z c2x)",
        group: "F m -3 m (225)",
        source: SCHOEN,
        products: products!(4; cyclic(-1.0, [C(2), C(2), One]); (4.0, [C(1), C(1), C(1)])),
    },
    NamedCell {
        name: "fischer_koch_s",
        title: "Fischer-Koch S",
        formula: "c2x sy cz + cx c2y sz + sx cy c2z",
        group: "I -4 3 d (220)",
        source: "Fischer and Koch, Z. Kristallogr. 179 (1987) 31; nodal form after von Schnering and Nesper, Z. Phys. B 83 (1991) 407",
        products: products!(3; cyclic(1.0, [C(2), S(1), C(1)])),
    },
    NamedCell {
        name: "lidinoid",
        title: "Lidinoid",
        formula: "0.5(s2x cy sz + s2y cz sx + s2z cx sy) - 0.5(c2x c2y + c2y c2z + c2z c2x) + 0.15",
        group: "I a -3 d (230)",
        source: "Lidin and Larsson, J. Chem. Soc. Faraday Trans. 86 (1990) 769; the usual level-set form",
        products: products!(7; cyclic(0.5, [S(2), C(1), S(1)]), cyclic(-0.5, [C(2), C(2), One]); (0.15, [One, One, One])),
    },
    NamedCell {
        name: "split_p",
        title: "Split P",
        formula: "1.1(s2x sz cy + s2y sx cz + s2z sy cx) - 0.2(c2x c2y + c2y c2z + c2z c2x) - 0.4(c2x + c2y + c2z)",
        group: "I a -3 (206)",
        source: "Fogden and Hyde, Eur. Phys. J. B 7 (1999) 91 for the family; the usual level-set form",
        products: products!(9; cyclic(1.1, [S(2), C(1), S(1)]), cyclic(-0.2, [C(2), C(2), One]), cyclic(-0.4, [C(2), One, One])),
    },
];

impl NamedCell {
    /// The number of its space group.
    pub fn number(&self) -> &'static str {
        let (_, number) = self.group.rsplit_once('(').unwrap_or(("", self.group));
        number.trim_end_matches(')')
    }

    /// f as plane waves.
    pub fn terms(&self) -> Vec<Term> {
        let mut terms = Vec::new();
        for (k, factors) in self.products {
            // cos a = ½(e^{ia} + e^{−ia}) and sin a = cos(a − ¼ turn): a product is a mean over the signs of its waves.
            let mut waves = vec![([0i32; 3], 0.0)];
            for (a, f) in factors.iter().enumerate() {
                let (n, phase) = match *f {
                    One => continue,
                    C(n) => (n, 0.0),
                    S(n) => (n, -0.25),
                };
                waves = waves
                    .into_iter()
                    .flat_map(|(h, p)| {
                        let (mut up, mut down) = (h, h);
                        up[a] += n;
                        down[a] -= n;
                        [(up, p + phase), (down, p - phase)]
                    })
                    .collect();
            }
            let amplitude = k / waves.len() as f64;
            terms.extend(waves.into_iter().map(|(hkl, phase)| Term { hkl, amplitude, phase }));
        }
        terms
    }

    /// The cell, one for all designs of a process: what takes time to find of it (levels, connectivity, necks) is found once.
    pub fn cell(&self) -> Result<Arc<Cell>, Fault> {
        static CELLS: [OnceLock<Arc<Cell>>; CATALOGUE.len()] = [const { OnceLock::new() }; CATALOGUE.len()];
        let series = Series::new(self.terms())?;
        let made = || Arc::new(Cell::new(series));
        Ok(match CATALOGUE.iter().position(|n| n.name == self.name) {
            Some(i) => CELLS[i].get_or_init(made).clone(),
            None => made(),
        })
    }
}

/// All named surfaces.
pub fn catalogue() -> &'static [NamedCell] {
    &CATALOGUE
}

/// The named surface of this name.
pub fn named(name: &str) -> Option<&'static NamedCell> {
    CATALOGUE.iter().find(|n| n.name == name)
}

#[cfg(test)]
mod tests {
    use super::super::series::Series;
    use super::*;
    use core::f64::consts::TAU;

    /// The formulas of the conventions, typed out a second time.
    fn formula(name: &str, [x, y, z]: [f64; 3]) -> f64 {
        let (s, c) = (|v: f64| (TAU * v).sin(), |v: f64| (TAU * v).cos());
        let (s2, c2) = (|v: f64| (2.0 * TAU * v).sin(), |v: f64| (2.0 * TAU * v).cos());
        match name {
            "gyroid" => s(x) * c(y) + s(y) * c(z) + s(z) * c(x),
            "gyroid_mirrored" => c(x) * s(y) + c(y) * s(z) + c(z) * s(x),
            "diamond" => s(x) * s(y) * s(z) + s(x) * c(y) * c(z) + c(x) * s(y) * c(z) + c(x) * c(y) * s(z),
            "primitive" => c(x) + c(y) + c(z),
            "iwp" => 2.0 * (c(x) * c(y) + c(y) * c(z) + c(z) * c(x)) - (c2(x) + c2(y) + c2(z)),
            "neovius" => 3.0 * (c(x) + c(y) + c(z)) + 4.0 * c(x) * c(y) * c(z),
            "frd" => 4.0 * c(x) * c(y) * c(z) - (c2(x) * c2(y) + c2(y) * c2(z) + c2(z) * c2(x)),
            "fischer_koch_s" => c2(x) * s(y) * c(z) + c(x) * c2(y) * s(z) + s(x) * c(y) * c2(z),
            "lidinoid" => {
                0.5 * (s2(x) * c(y) * s(z) + s2(y) * c(z) * s(x) + s2(z) * c(x) * s(y))
                    - 0.5 * (c2(x) * c2(y) + c2(y) * c2(z) + c2(z) * c2(x))
                    + 0.15
            }
            "split_p" => {
                1.1 * (s2(x) * s(z) * c(y) + s2(y) * s(x) * c(z) + s2(z) * s(y) * c(x))
                    - 0.2 * (c2(x) * c2(y) + c2(y) * c2(z) + c2(z) * c2(x))
                    - 0.4 * (c2(x) + c2(y) + c2(z))
            }
            _ => panic!("{name} has no formula in this test"),
        }
    }

    #[test]
    fn series_equal_their_formulas() {
        for n in catalogue() {
            let series = Series::new(n.terms()).expect(n.name);
            for i in 0..200 {
                let u = [0.618 * f64::from(i), 0.414 * f64::from(i) + 0.1, 0.732 * f64::from(i) - 0.3];
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                series.gradients(&[u], &mut v, &mut g);
                assert!((v[0] - formula(n.name, u)).abs() < 2e-12, "{} at {u:?}", n.name);
            }
        }
    }
}
