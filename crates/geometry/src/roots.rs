//! Roots of functions of one variable, kept between two positions at which the signs differ.
//!
//! A [`Bracket`] gives the next position to evaluate and takes what was found there: by halves, by the chord or by Newton's method. So
//! many roots can be evaluated in one call, and an evaluation may fail. For a single function, [`bisect`], [`Bracket::newton`] and
//! [`Bracket::false_position`] do all steps. None evaluates the function outside the bracket, none gives a position outside it, and each
//! ends after a number of evaluations that is known beforehand, whatever the function: NaN counts as positive, a slope of zero or NaN
//! leads to a halving. A function of one sign, which has no bracket, leads to the end of the other sign.

use core::convert::Infallible;

/// Two finite positions, in either order: at the first a function is zero or negative, at the second zero or positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// Position and value where the function is not positive.
    pub below: [f64; 2],
    /// Position and value where it is not negative.
    pub above: [f64; 2],
}

/// How near a root is enough: a step no longer than `absolute + relative · |x|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// In the unit of the positions.
    pub absolute: f64,
    /// As a share of the root.
    pub relative: f64,
}

impl Tolerance {
    /// The last bits.
    pub const ROUNDING: Tolerance = Tolerance { absolute: 0.0, relative: 4.0 * f64::EPSILON };

    /// A length, whatever the root.
    pub fn absolute(absolute: f64) -> Tolerance {
        Tolerance { absolute, relative: 0.0 }
    }
}

/// Steps in which Newton's method may be used, and after which the bracket is halved; 2⁻⁵² of it is left then.
const NEWTON: [usize; 2] = [48, 52];
/// One step in this number halves the bracket where the method of false position is used.
const HALVE: u32 = 8;
/// Most steps of false position: fifty are halvings.
const CHORDS: usize = 50 * HALVE as usize;

impl Bracket {
    /// The bracket of two positions with their values, in either order; `None` unless the positions are finite and the signs differ.
    /// Zero has either sign, NaN none.
    pub fn new(a: [f64; 2], b: [f64; 2]) -> Option<Bracket> {
        let [below, above] = if a[1] <= 0.0 && b[1] >= 0.0 { [a, b] } else { [b, a] };
        (below[1] <= 0.0 && above[1] >= 0.0 && a[0].is_finite() && b[0].is_finite()).then_some(Bracket { below, above })
    }

    /// The bracket of positions at which the signs alone are known. Until both have moved the chord says nothing.
    pub fn of_signs(below: f64, above: f64) -> Bracket {
        debug_assert!(below.is_finite() && above.is_finite(), "{below} {above}");
        Bracket { below: [below, -1.0], above: [above, 1.0] }
    }

    /// Its length.
    pub fn width(&self) -> f64 {
        (self.above[0] - self.below[0]).abs()
    }

    /// Its middle.
    #[inline]
    pub fn middle(&self) -> f64 {
        0.5 * (self.below[0] + self.above[0])
    }

    /// Where the chord of the values at its ends is zero; the middle if they are both zero.
    #[inline]
    pub fn chord(&self) -> f64 {
        let ([lo, v], [hi, w]) = (self.below, self.above);
        let at = lo - (hi - lo) * v / (w - v);
        if at.is_finite() { at.clamp(lo.min(hi), lo.max(hi)) } else { self.middle() }
    }

    /// Whether a position is strictly between the ends.
    #[inline]
    pub fn holds(&self, x: f64) -> bool {
        let ([lo, _], [hi, _]) = (self.below, self.above);
        if lo < hi { x > lo && x < hi } else { x > hi && x < lo }
    }

    /// Replaces the end at which the value has the sign of that at `x`.
    #[inline]
    pub fn narrow(&mut self, x: f64, value: f64) {
        *(if value <= 0.0 { &mut self.below } else { &mut self.above }) = [x, value];
    }

    /// Newton's next position after `x`, or the middle if that is not between the ends.
    #[inline]
    pub fn newton_step(&self, x: f64, value: f64, slope: f64) -> f64 {
        let next = x - value / slope;
        if self.holds(next) { next } else { self.middle() }
    }

    /// The root by Newton's method from `x`, which is in the bracket; `f` gives value and slope. At most 100 evaluations. It ends where
    /// the value is zero or a step is within the tolerance: near a simple root of a smooth function the error is of the order of the
    /// square of that step, and never more than what is left of the bracket.
    pub fn newton(mut self, mut x: f64, near: Tolerance, mut f: impl FnMut(f64) -> [f64; 2]) -> f64 {
        for step in 0..NEWTON[0] + NEWTON[1] {
            let [value, slope] = f(x);
            if value == 0.0 {
                break;
            }
            self.narrow(x, value);
            let next = if step < NEWTON[0] { self.newton_step(x, value, slope) } else { self.middle() };
            let is_near = (next - x).abs() <= near.absolute + near.relative * x.abs();
            x = next;
            if is_near {
                break;
            }
        }
        x
    }

    /// A position where the value is at most `value` in magnitude or that is within `width` of a root, by false position: at most 400
    /// evaluations, a tenth of that or less for a smooth function.
    pub fn false_position(self, width: f64, value: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        let mut chords = FalsePosition::new(self);
        let mut x = chords.guess();
        for _ in 0..CHORDS {
            let v = f(x);
            chords.narrow(x, v);
            if v.abs() <= value || chords.bracket.width() <= width {
                break;
            }
            x = chords.guess();
        }
        x
    }
}

/// False position by the method of Illinois: the zero of the chord, for which the value at an end that stays twice in turn is halved.
/// The order is 1.44 at simple roots, and each eighth step halves the bracket.
#[derive(Clone, Copy, Debug)]
pub struct FalsePosition {
    /// The bracket, whose values are those of the chord.
    bracket: Bracket,
    steps: u32,
    /// Whether the last value was negative.
    last: Option<bool>,
}

impl FalsePosition {
    /// Starts from a bracket.
    pub fn new(bracket: Bracket) -> FalsePosition {
        FalsePosition { bracket, steps: 0, last: None }
    }

    /// The ends as they are. The value of one that stayed has been halved, so that no value is larger in magnitude than the function's.
    pub fn bracket(&self) -> &Bracket {
        &self.bracket
    }

    /// The position to evaluate next.
    pub fn guess(&self) -> f64 {
        if self.steps % HALVE == HALVE - 1 { self.bracket.middle() } else { self.bracket.chord() }
    }

    /// Takes the value at `x`.
    pub fn narrow(&mut self, x: f64, value: f64) {
        let below = value <= 0.0;
        self.bracket.narrow(x, value);
        if self.last == Some(below) {
            (if below { &mut self.bracket.above } else { &mut self.bracket.below })[1] *= 0.5;
        }
        (self.last, self.steps) = (Some(below), self.steps + 1);
    }
}

/// The interval of two positions, at the first of which something holds and at the second not, halved a number of times: so again at the
/// ends given. It is 2⁻ⁿ as long, or its ends are neighbouring numbers.
pub fn bisect(ends: [f64; 2], halvings: usize, mut holds: impl FnMut(f64) -> bool) -> [f64; 2] {
    let Ok(ends) = try_bisect(ends, halvings, |x| Ok::<bool, Infallible>(holds(x)));
    ends
}

/// As [`bisect`], of what may fail; it ends at the first failure.
pub fn try_bisect<E>(
    [mut yes, mut no]: [f64; 2],
    halvings: usize,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<[f64; 2], E> {
    for _ in 0..halvings {
        let middle = 0.5 * (yes + no);
        if middle == yes || middle == no {
            break;
        }
        *(if holds(middle)? { &mut yes } else { &mut no }) = middle;
    }
    Ok([yes, no])
}

/// The zero of a nearly linear function by at most eight secants from two positions. It is not bracketed: only for functions known to
/// be nearly linear. If the function is constant, the second position; never NaN for a finite function.
pub fn secant([a, b]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let (mut last, mut now) = ([a, f(a)], [b, f(b)]);
    for _ in 0..8 {
        let next = now[0] - now[1] * (now[0] - last[0]) / (now[1] - last[1]);
        if !next.is_finite() || next == now[0] {
            break;
        }
        (last, now) = (now, [next, f(next)]);
    }
    now[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Increasing functions with their slopes and roots: smooth, with a flat part, a vertical tangent, a jump, a triple root.
    type Case = (&'static str, fn(f64) -> [f64; 2], f64);
    const CASES: [Case; 6] = [
        ("line", |x| [x - 0.3, 1.0], 0.3),
        ("cubic", |x| [x * x * x - 0.2, 3.0 * x * x], 0.5848035476425733),
        ("exponential", |x| [(30.0 * x).exp() - 1e6, 30.0 * (30.0 * x).exp()], 0.46051701859880917),
        ("root", |x| [(x - 0.7).cbrt(), 1.0 / (3.0 * (x - 0.7).cbrt().powi(2))], 0.7),
        ("jump", |x| [if x < 0.9 { -1.0 } else { 1.0 }, 0.0], 0.9),
        ("triple", |x| [(x - 0.1).powi(3), 3.0 * (x - 0.1).powi(2)], 0.1),
    ];

    #[test]
    fn roots_are_found_from_either_order_and_never_outside() {
        for (name, f, root) in CASES {
            for falls in [false, true] {
                let sign = if falls { -1.0 } else { 1.0 };
                let count = Cell::new(0);
                let of = |x: f64| {
                    assert!((0.0..=1.0).contains(&x), "{name}: {x}");
                    count.set(count.get() + 1);
                    f(x).map(|v| sign * v)
                };
                let bracket = Bracket::new([0.0, of(0.0)[0]], [1.0, of(1.0)[0]]).expect("signs differ");
                assert_eq!(bracket.below[0], if falls { 1.0 } else { 0.0 }, "{name}");
                count.set(0);
                let newton = bracket.newton(0.5, Tolerance::absolute(1e-13), of);
                assert!((newton - root).abs() < 1e-12, "{name}: {newton}");
                assert!(count.replace(0) <= 100, "{name}");
                let chord = bracket.false_position(1e-12, 0.0, |x| of(x)[0]);
                assert!((chord - root).abs() < 2e-12, "{name}: {chord}");
                assert!(count.replace(0) <= 400, "{name}");
                let halved = bisect([bracket.below[0], bracket.above[0]], 40, |x| of(x)[0] <= 0.0);
                assert!((halved[1] - halved[0]).abs() == 0.5f64.powi(40) && count.get() == 40, "{name}: {halved:?}");
                assert!(halved[0].min(halved[1]) <= root && root <= halved[0].max(halved[1]), "{name}: {halved:?}");
            }
        }
    }

    #[test]
    fn a_bracket_has_finite_ends_of_different_signs() {
        let of = |a: f64, v: f64, b: f64, w: f64| Bracket::new([a, v], [b, w]);
        assert_eq!(of(0.0, 1.0, 1.0, 2.0), None);
        assert_eq!(of(0.0, -1.0, 1.0, -2.0), None);
        assert_eq!(of(0.0, f64::NAN, 1.0, 1.0), None);
        assert_eq!(of(0.0, -1.0, 1.0, f64::NAN), None);
        assert_eq!(of(0.0, -1.0, f64::INFINITY, 1.0), None);
        assert_eq!(of(f64::NAN, -1.0, 0.0, 1.0), None);
        for (v, w) in [(0.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (f64::NEG_INFINITY, f64::INFINITY)] {
            let forth = of(0.0, v, 1.0, w).expect("signs differ");
            assert_eq!((forth.below[1], forth.above[1]), (v, w));
            assert!((0.0..=1.0).contains(&forth.chord()), "{forth:?}");
            assert!(of(0.0, w, 1.0, v).is_some());
        }
    }

    /// Whatever a function gives, a search ends within its bracket.
    #[test]
    fn functions_without_a_root_end_in_the_bracket() {
        let functions: [fn(f64) -> [f64; 2]; 5] = [
            |_| [f64::NAN; 2],
            |_| [1.0, 0.0],
            |_| [-1.0, 0.0],
            |x| [x + 1.0, 1.0],
            |_| [f64::INFINITY, f64::NEG_INFINITY],
        ];
        for f in functions {
            for bracket in [Bracket::of_signs(2.0, 3.0), Bracket::of_signs(3.0, 2.0)] {
                let newton = bracket.newton(2.5, Tolerance::ROUNDING, f);
                let chord = bracket.false_position(1e-12, 0.0, |x| f(x)[0]);
                for x in [newton, chord].into_iter().chain(bisect([2.0, 3.0], 2000, |x| f(x)[0] <= 0.0)) {
                    assert!((2.0..=3.0).contains(&x), "{x}");
                }
            }
        }
    }

    #[test]
    fn a_failure_ends_a_bisection() {
        assert_eq!(try_bisect([0.0, 1.0], 50, |x| if x > 0.6 { Err(x) } else { Ok(true) }), Err(0.75));
        assert_eq!(try_bisect([0.0, 1.0], 2, |x| Ok::<bool, f64>(x < 0.6)), Ok([0.5, 0.75]));
    }

    #[test]
    fn a_nearly_linear_function_has_its_zero_found() {
        let cubic = |x: f64| x + 0.1 * x * x - 0.01 * x.powi(3) - 1.05;
        let x = secant([0.0, 0.01], cubic);
        assert!(cubic(x).abs() < 1e-15, "{x}");
        assert_eq!(secant([0.0, 1.0], |_| 1.0), 1.0);
    }
}
