//! The operations of a formula: value, partial derivatives and range of each.

use core::f64::consts::{LN_10, PI, TAU};

use geometry::math::Interval;

/// Everything: the range of a result that may be anything, or undefined.
pub(super) const ALL: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

/// An operation on one to three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operation {
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Log,
    Log10,
    Sqrt,
    Abs,
    Min,
    Max,
    Clamp,
    Floor,
    Ceil,
    Mod,
    Hypot,
    Sign,
    Step,
    Smoothstep,
}

use Operation::*;

/// The operations that are called by name.
pub(super) const FUNCTIONS: [(&str, Operation); 25] = [
    ("sin", Sin),
    ("cos", Cos),
    ("tan", Tan),
    ("asin", Asin),
    ("acos", Acos),
    ("atan", Atan),
    ("atan2", Atan2),
    ("sinh", Sinh),
    ("cosh", Cosh),
    ("tanh", Tanh),
    ("exp", Exp),
    ("log", Log),
    ("log10", Log10),
    ("sqrt", Sqrt),
    ("abs", Abs),
    ("min", Min),
    ("max", Max),
    ("clamp", Clamp),
    ("floor", Floor),
    ("ceil", Ceil),
    ("mod", Mod),
    ("hypot", Hypot),
    ("sign", Sign),
    ("step", Step),
    ("smoothstep", Smoothstep),
];

impl Operation {
    /// Its name in formulas; of a sign `negate`.
    pub(super) fn name(self) -> &'static str {
        match self {
            Negate => "negate",
            Add => "+",
            Subtract => "-",
            Multiply => "*",
            Divide => "/",
            Power => "^",
            _ => FUNCTIONS.iter().find(|(_, op)| *op == self).map_or("", |(name, _)| name),
        }
    }

    /// How many numbers it takes.
    pub(super) fn arity(self) -> usize {
        match self {
            Add | Subtract | Multiply | Divide | Power | Atan2 | Min | Max | Mod | Hypot | Step => 2,
            Clamp | Smoothstep => 3,
            _ => 1,
        }
    }

    /// The value; NaN where undefined, and wherever an argument is NaN. Unused arguments are zero.
    #[inline(always)]
    pub(super) fn value(self, [a, b, c]: [f64; 3]) -> f64 {
        match self {
            Negate => -a,
            Add => a + b,
            Subtract => a - b,
            Multiply => a * b,
            Divide => a / b,
            Power => power(a, b),
            Sin => a.sin(),
            Cos => a.cos(),
            Tan => a.tan(),
            Asin => a.asin(),
            Acos => a.acos(),
            Atan => a.atan(),
            Atan2 => a.atan2(b),
            Sinh => a.sinh(),
            Cosh => a.cosh(),
            Tanh => a.tanh(),
            Exp => a.exp(),
            Log => a.ln(),
            Log10 => a.log10(),
            Sqrt => a.sqrt(),
            Abs => a.abs(),
            Min | Max | Clamp | Step | Smoothstep if a.is_nan() || b.is_nan() || c.is_nan() => f64::NAN,
            Min => a.min(b),
            Max => a.max(b),
            Clamp => a.max(b).min(c),
            Floor => a.floor(),
            Ceil => a.ceil(),
            Mod => {
                let r = a % b;
                if r != 0.0 && (r < 0.0) != (b < 0.0) { r + b } else { r }
            }
            Hypot => a.hypot(b),
            Sign if a == 0.0 => 0.0,
            Sign => a.signum(),
            Step => f64::from(b >= a),
            Smoothstep => {
                let t = ramp(a, b, c);
                t * t * (3.0 - 2.0 * t)
            }
        }
    }

    /// The partial derivatives by the arguments; one-sided at a crease, zero at a jump and where the slope is infinite, as that of a
    /// root at zero, or undefined, as that of an angle about its centre.
    #[inline(always)]
    pub(super) fn partials(self, arguments: [f64; 3]) -> [f64; 3] {
        self.slopes(arguments).map(|d| if d.is_finite() { d } else { 0.0 })
    }

    #[inline(always)]
    fn slopes(self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        let one = |d: f64| [d, 0.0, 0.0];
        let two = |d: f64, e: f64| [d, e, 0.0];
        match self {
            Negate => one(-1.0),
            Add => two(1.0, 1.0),
            Subtract => two(1.0, -1.0),
            Multiply => two(b, a),
            Divide => two(1.0 / b, -a / (b * b)),
            Power if b == 0.0 => two(0.0, a.ln()),
            Power => two(b * power(a, b - 1.0), power(a, b) * a.ln()),
            Sin => one(a.cos()),
            Cos => one(-a.sin()),
            Tan => one(1.0 + a.tan().powi(2)),
            Asin => one(1.0 / (1.0 - a * a).sqrt()),
            Acos => one(-1.0 / (1.0 - a * a).sqrt()),
            Atan => one(1.0 / (1.0 + a * a)),
            Atan2 => two(b / (a * a + b * b), -a / (a * a + b * b)),
            Sinh => one(a.cosh()),
            Cosh => one(a.sinh()),
            Tanh => one(1.0 - a.tanh().powi(2)),
            Exp => one(a.exp()),
            Log => one(1.0 / a),
            Log10 => one(1.0 / (a * LN_10)),
            Sqrt => one(0.5 / a.sqrt()),
            Abs => one(if a < 0.0 { -1.0 } else { 1.0 }),
            Min => {
                if a <= b {
                    two(1.0, 0.0)
                } else {
                    two(0.0, 1.0)
                }
            }
            Max => {
                if a >= b {
                    two(1.0, 0.0)
                } else {
                    two(0.0, 1.0)
                }
            }
            Clamp if a.max(b) > c => [0.0, 0.0, 1.0],
            Clamp => {
                if a >= b {
                    one(1.0)
                } else {
                    two(0.0, 1.0)
                }
            }
            Mod => two(1.0, -(a / b).floor()),
            Hypot => two(a / a.hypot(b), b / a.hypot(b)),
            Floor | Ceil | Sign | Step => [0.0; 3],
            Smoothstep => {
                let t = ramp(a, b, c);
                let d = if t > 0.0 && t < 1.0 { 6.0 * t * (1.0 - t) / (b - a) } else { 0.0 };
                [d * (t - 1.0), -d * t, d]
            }
        }
    }

    /// An interval that contains the value for all arguments in the intervals.
    pub(super) fn range(self, [a, b, c]: [Interval; 3]) -> Interval {
        let call = |p: f64| self.value([p, 0.0, 0.0]);
        let rising = || outward(Interval::new(call(a.lo), call(a.hi)));
        let corners =
            || hull([(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)].map(|(p, q)| self.value([p, q, 0.0])));
        match self {
            Negate => -a,
            Add => tidy(Interval::new(a.lo + b.lo, a.hi + b.hi)),
            Subtract => tidy(a - b),
            Multiply => {
                let product = a.times(b);
                hull([product.lo, product.hi, product.lo, product.hi])
            }
            Divide if has(b, 0.0) => ALL,
            Divide => corners(),
            Power => power_range(a, b),
            Sin => wave(a, 0.25),
            Cos => wave(a, 0.0),
            Tan => {
                let turn = |v: f64, slack: f64| (v / PI + 0.5 + slack).floor();
                if a.lo.abs().max(a.hi.abs()) < 1e8 && turn(a.lo, -1e-6) == turn(a.hi, 1e-6) { rising() } else { ALL }
            }
            Asin | Acos if a.lo < -1.0 || a.hi > 1.0 => ALL,
            Acos => outward(Interval::new(a.hi.acos(), a.lo.acos())),
            Log | Log10 if a.lo <= 0.0 => ALL,
            Sqrt if a.lo < 0.0 => ALL,
            Asin | Atan | Sinh | Tanh | Exp | Log | Log10 | Sqrt | Floor | Ceil | Sign => rising(),
            Atan2 if b.lo > 0.0 => outward(corners()),
            Atan2 => outward(Interval::new(-PI, PI)),
            Cosh => outward(Interval::new(a.abs().lo.cosh(), a.abs().hi.cosh())),
            Abs => a.abs(),
            Min => a.min(b),
            Max => a.max(b),
            Clamp => a.max(b).min(c),
            Mod if has(b, 0.0) => ALL,
            Mod => {
                let whole = |v: f64| (v / b.lo).floor();
                let one_piece = b.lo == b.hi && whole(a.lo) == whole(a.hi) && a.hi < (whole(a.lo) + 1.0) * b.lo;
                if b.lo > 0.0 && one_piece && a.lo >= whole(a.lo) * b.lo {
                    corners()
                } else {
                    Interval::new(b.lo.min(0.0), b.hi.max(0.0))
                }
            }
            Hypot => {
                let (p, q) = (a.abs(), b.abs());
                outward(Interval::new(p.lo.hypot(q.lo), p.hi.hypot(q.hi)))
            }
            Step => Interval::new(f64::from(b.lo >= a.hi), f64::from(b.hi >= a.lo)),
            Smoothstep if a.lo == a.hi && b.lo == b.hi && a.lo <= b.lo => {
                outward(Interval::new(self.value([a.lo, b.lo, c.lo]), self.value([a.lo, b.lo, c.hi])))
            }
            Smoothstep => outward(Interval::new(0.0, 1.0)),
        }
    }
}

/// (c − a)/(b − a) held within 0 and 1; a step at c = a where a = b.
fn ramp(a: f64, b: f64, c: f64) -> f64 {
    if a == b { f64::from(c >= a) } else { ((c - a) / (b - a)).clamp(0.0, 1.0) }
}

/// aᵇ; small whole powers by multiplication.
fn power(a: f64, b: f64) -> f64 {
    if b == b.trunc() && b.abs() <= 64.0 { a.powi(b as i32) } else { a.powf(b) }
}

fn power_range(a: Interval, b: Interval) -> Interval {
    let whole = b.lo == b.hi && b.lo == b.lo.trunc() && b.lo.abs() <= 64.0;
    let ends = |a: Interval, b: Interval| {
        outward(hull([power(a.lo, b.lo), power(a.lo, b.hi), power(a.hi, b.lo), power(a.hi, b.hi)]))
    };
    if a.lo > 0.0 || (a.lo == 0.0 && b.lo > 0.0) {
        ends(a, b)
    } else if !whole || (b.lo < 0.0 && has(a, 0.0)) {
        ALL
    } else if b.lo % 2.0 == 0.0 {
        ends(a.abs(), b)
    } else {
        ends(a, b)
    }
}

/// The range of cos(v − 2π·shift).
fn wave(v: Interval, shift: f64) -> Interval {
    let (lo, hi) = (v.lo / TAU - shift, v.hi / TAU - shift);
    let far = lo.abs().max(hi.abs());
    if far.is_nan() || far >= 1e8 {
        return Interval::new(-1.0, 1.0);
    }
    // A crest lies within when a whole number of turns does, a trough half a turn on; with slack for rounding.
    let holds = |at: f64| (hi + 1e-7 - at).floor() >= (lo - 1e-7 - at).ceil();
    let ends = [lo, hi].map(|t| ((t - t.floor()) * TAU).cos());
    // The slack of 1e-7 turns aside, the reduction above is good to 1e-8·2π at the largest argument.
    let slack = 1e-14 + 1e-15 * far;
    Interval::new(
        if holds(0.5) { -1.0 } else { (ends[0].min(ends[1]) - slack).max(-1.0) },
        if holds(0.0) { 1.0 } else { (ends[0].max(ends[1]) + slack).min(1.0) },
    )
}

/// Whether v lies in the interval.
fn has(i: Interval, v: f64) -> bool {
    i.lo <= v && v <= i.hi
}

/// The hull of four numbers; everything if one is undefined.
fn hull(v: [f64; 4]) -> Interval {
    if v.iter().any(|v| v.is_nan()) {
        return ALL;
    }
    v.iter().fold(Interval::new(f64::INFINITY, f64::NEG_INFINITY), |i, v| i.union(Interval::new(*v, *v)))
}

/// The interval, or everything where an end is undefined.
fn tidy(i: Interval) -> Interval {
    Interval::new(if i.lo.is_nan() { ALL.lo } else { i.lo }, if i.hi.is_nan() { ALL.hi } else { i.hi })
}

/// The interval widened by the error of library functions (a few ulps).
fn outward(i: Interval) -> Interval {
    let wide = |v: f64| {
        if v.is_finite() { v.abs() * 4.0 * f64::EPSILON + f64::MIN_POSITIVE } else { 0.0 }
    };
    tidy(Interval::new(i.lo - wide(i.lo), i.hi + wide(i.hi)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arguments at which every function is defined, by the kind of its domain.
    fn domain(op: Operation) -> (f64, f64) {
        match op {
            Asin | Acos => (-1.0, 1.0),
            Log | Log10 | Sqrt | Power => (0.05, 3.0),
            _ => (-3.0, 3.0),
        }
    }

    fn random(state: &mut u64) -> f64 {
        (geometry::random::random(state) + 1.0) / 2.0
    }

    #[test]
    fn ranges_hold_and_partials_agree_with_differences() {
        let s = &mut 7u64;
        let operators = [Negate, Add, Subtract, Multiply, Divide, Power];
        for op in FUNCTIONS.map(|f| f.1).into_iter().chain(operators) {
            let (lo, hi) = domain(op);
            for _ in 0..300 {
                let mut part = || {
                    let (p, q) = (lo + (hi - lo) * random(s), lo + (hi - lo) * random(s) * random(s));
                    Interval::new(p.min(q), p.max(q))
                };
                let box_ = [part(), part(), part()];
                let range = op.range(box_);
                for _ in 0..10 {
                    let args = box_.map(|i| i.lo + (i.hi - i.lo) * random(s));
                    let v = op.value(args);
                    assert!(v.is_nan() || (range.lo <= v && v <= range.hi), "{op:?}{args:?} = {v} not in {range:?}");
                    let partials = op.partials(args);
                    for k in 0..op.arity() {
                        let h = 1e-6;
                        let (mut l, mut r) = (args, args);
                        l[k] -= h;
                        r[k] += h;
                        let d = (op.value(r) - op.value(l)) / (2.0 * h);
                        let smooth = (op.partials(l)[k] - op.partials(r)[k]).abs() < 1e-3 && d.abs() < 1e3;
                        if smooth {
                            assert!(
                                (d - partials[k]).abs() < 1e-4 * (1.0 + d.abs()),
                                "{op:?}{args:?} by {k}: {d} {partials:?}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn ranges_are_tight_where_they_can_be() {
        let i = Interval::new;
        let none = i(0.0, 0.0);
        let near = |a: Interval, b: Interval| (a.lo - b.lo).abs() < 1e-12 && (a.hi - b.hi).abs() < 1e-12;
        assert!(near(Sin.range([i(0.0, core::f64::consts::FRAC_PI_2), none, none]), i(0.0, 1.0)));
        assert!(near(Cos.range([i(0.5, 0.6), none, none]), i(0.6f64.cos(), 0.5f64.cos())));
        assert!(near(Power.range([i(-2.0, 1.0), i(2.0, 2.0), none]), i(0.0, 4.0)));
        assert!(near(Power.range([i(-2.0, 1.0), i(3.0, 3.0), none]), i(-8.0, 1.0)));
        assert_eq!(Divide.range([i(1.0, 2.0), i(-1.0, 1.0), none]), ALL);
        assert_eq!(Multiply.range([none, ALL, none]), none);
        assert_eq!(Power.range([i(-1.0, 1.0), i(0.5, 0.5), none]), ALL);
        assert_eq!(Log.range([i(0.0, 1.0), none, none]), ALL);
        assert!(near(Mod.range([i(2.25, 2.5), i(1.0, 1.0), none]), i(0.25, 0.5)));
    }
}
