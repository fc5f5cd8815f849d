//! Formulas: parsed to a short stack program, never evaluated as code.

use super::{BuildGrade, Grade, Quantity, VaryingNumber};
use crate::field::Field;
use crate::kind::{DesignError, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3};

mod combined;
mod operation;
mod parse;
pub use combined::{Combined, CombinedKind};
use operation::Operation;
use parse::{AXES, parse};

/// Points that an instruction is done for at once.
const LANES: usize = 16;

/// A formula in x, y, z (mm), such as "0.3 + 0.1*sin(x/5)"; parsed, never run as code.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Formula")]
pub struct FormulaKind(pub String);

impl BuildGrade for FormulaKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let parse = |text: &str| Formula::parse(text).map_err(|f| DesignError::fault(&of.path, f).found(&self.0));
        let made = parse(&self.0)?;
        let made = if of.complement { parse(&format!("1 - ({})", self.0))? } else { made };
        of.checked(made)
    }
}

/// A parsed formula in x, y, z (mm). Angles of its functions are in radians.
///
/// Operators `+ - * / ^`; constants `pi`, `e`; functions `sin cos tan asin acos atan atan2(y, x) sinh cosh tanh exp
/// log` (natural) `log10 sqrt abs min max clamp(v, low, high) floor ceil mod(a, b)` (with the sign of b) `hypot
/// sign step(edge, v) smoothstep(a, b, v)`.
#[derive(Clone, Debug)]
pub struct Formula {
    program: Vec<Instruction>,
}

#[derive(Clone, Copy, Debug)]
enum Instruction {
    Number(f64),
    Variable(usize),
    Apply(Operation),
}

/// What a program can be run on: numbers, numbers with gradients, intervals.
trait Operand: Copy {
    fn constant(v: f64) -> Self;
    fn apply(op: Operation, args: [Self; 3]) -> Self;
}

impl Operand for f64 {
    fn constant(v: f64) -> f64 {
        v
    }
    #[inline(always)]
    fn apply(op: Operation, args: [f64; 3]) -> f64 {
        op.value(args)
    }
}

impl Operand for Interval {
    fn constant(v: f64) -> Interval {
        Interval::new(v, v)
    }
    fn apply(op: Operation, args: [Interval; 3]) -> Interval {
        op.range(args)
    }
}

/// A value and its slopes along some axes (forward differentiation).
#[derive(Clone, Copy)]
struct DualNumber<const N: usize>(f64, [f64; N]);

impl<const N: usize> Operand for DualNumber<N> {
    fn constant(v: f64) -> DualNumber<N> {
        DualNumber(v, [0.0; N])
    }
    #[inline(always)]
    fn apply(op: Operation, args: [DualNumber<N>; 3]) -> DualNumber<N> {
        let at = args.map(|d| d.0);
        let partials = op.partials(at);
        let mut slopes = [0.0; N];
        for (d, partial) in args.iter().zip(partials) {
            for a in 0..N {
                // A constant argument adds nothing, even where the partial is infinite or undefined.
                if d.1[a] != 0.0 {
                    slopes[a] += partial * d.1[a];
                }
            }
        }
        DualNumber(op.value(at), slopes)
    }
}

impl Formula {
    /// Parses a formula.
    ///
    /// **Errors** name the column, what was found there and what is expected; an unknown word gets the nearest
    /// known one.
    pub fn parse(text: &str) -> Result<Formula, Fault> {
        Formula::with_names(text, &[])
    }

    /// The same with further variables, whose numbers are given with the position.
    fn with_names(text: &str, names: &[&str]) -> Result<Formula, Fault> {
        Ok(Formula { program: parse(text, names)? })
    }

    /// Whether it names a variable.
    fn has_variable(&self, n: usize) -> bool {
        self.program.iter().any(|i| matches!(i, Instruction::Variable(v) if *v == n))
    }

    /// The program: words, after those of their arguments, and a number. `number` stands for it, `x`, `y`, `z` for the position, other words
    /// for functions and operators; `negate` is a sign.
    pub fn postfix(&self) -> Vec<(&'static str, f64)> {
        let word = |instruction: &Instruction| match *instruction {
            Instruction::Number(v) => ("number", v),
            Instruction::Variable(a) => (AXES[a], 0.0),
            Instruction::Apply(op) => (op.name(), 0.0),
        };
        self.program.iter().map(word).collect()
    }

    /// Values and gradients (per mm), where it varies along these axes alone.
    fn slopes<const N: usize>(&self, axes: [usize; N], points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut stack = Vec::new();
        let out = values.chunks_mut(LANES).zip(gradients.chunks_mut(LANES));
        for (points, (values, gradients)) in points.chunks(LANES).zip(out) {
            let variable = |lane: usize, axis: usize| {
                let slopes = axes.map(|a| f64::from(u8::from(a == axis)));
                DualNumber(points.get(lane).map_or(0.0, |p| p[axis]), slopes)
            };
            let found = self.run_lanes(variable, &mut stack);
            for ((v, g), d) in values.iter_mut().zip(gradients).zip(found) {
                (*v, *g) = (d.0, [0.0; 3]);
                for (a, slope) in axes.iter().zip(d.1) {
                    g[*a] = slope;
                }
            }
        }
    }

    /// Runs the program on some points at once, instruction by instruction.
    fn run_lanes<T: Operand>(&self, variable: impl Fn(usize, usize) -> T, stack: &mut Vec<[T; LANES]>) -> [T; LANES] {
        stack.clear();
        for instruction in &self.program {
            match *instruction {
                Instruction::Number(v) => stack.push([T::constant(v); LANES]),
                Instruction::Variable(a) => stack.push(core::array::from_fn(|l| variable(l, a))),
                Instruction::Apply(op) => {
                    let zero = [T::constant(0.0); LANES];
                    let rest = stack.len() + 1 - op.arity();
                    let (below, args) = stack.split_at_mut(rest);
                    if let Some(first) = below.last_mut() {
                        let [b, c] = [0, 1].map(|i| args.get(i).unwrap_or(&zero));
                        apply_lanes(op, first, b, c);
                    }
                    stack.truncate(rest);
                }
            }
        }
        // The parser leaves exactly one number.
        stack.pop().unwrap_or([T::constant(f64::NAN); LANES])
    }

    fn run<T: Operand>(&self, variables: &[T], stack: &mut Vec<T>) -> T {
        stack.clear();
        for instruction in &self.program {
            match *instruction {
                Instruction::Number(v) => stack.push(T::constant(v)),
                Instruction::Variable(a) => stack.push(variables[a]),
                Instruction::Apply(op) => {
                    let mut args = [T::constant(0.0); 3];
                    let first = stack.len() - op.arity();
                    args[..op.arity()].copy_from_slice(&stack[first..]);
                    stack.truncate(first);
                    stack.push(T::apply(op, args));
                }
            }
        }
        // The parser leaves exactly one number.
        stack.pop().unwrap_or(T::constant(f64::NAN))
    }
}

impl Field for Formula {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut stack = Vec::new();
        for (points, out) in points.chunks(LANES).zip(out.chunks_mut(LANES)) {
            let variable = |lane: usize, axis: usize| points.get(lane).map_or(0.0, |p| p[axis]);
            let values = self.run_lanes(variable, &mut stack);
            out.copy_from_slice(&values[..out.len()]);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        match self.varies() {
            [_, false, false] => self.slopes([0], points, values, gradients),
            [false, true, false] => self.slopes([1], points, values, gradients),
            [false, false, true] => self.slopes([2], points, values, gradients),
            _ => self.slopes([0, 1, 2], points, values, gradients),
        }
    }

    /// By interval arithmetic; everything where the formula may be undefined.
    fn bound(&self, b: &Aabb) -> Interval {
        let at = [0, 1, 2].map(|a| Interval::new(b.min[a], b.max[a]));
        self.run(&at, &mut Vec::new())
    }
}

impl VaryingNumber for Formula {
    /// The axes that it names.
    fn varies(&self) -> [bool; 3] {
        [0, 1, 2].map(|a| self.has_variable(a))
    }
}

/// Applies an operation to each lane, overwriting its first argument. Each of the quick ones has a loop of its own.
fn apply_lanes<T: Operand>(op: Operation, a: &mut [T; LANES], b: &[T; LANES], c: &[T; LANES]) {
    macro_rules! lanes {
        ($($quick:ident)*) => {
            match op {
                $(Operation::$quick => (0..LANES).for_each(|l| {
                    a[l] = T::apply(Operation::$quick, [a[l], b[l], c[l]]);
                }),)*
                _ => (0..LANES).for_each(|l| a[l] = T::apply(op, [a[l], b[l], c[l]])),
            }
        };
    }
    lanes!(Negate Add Subtract Multiply Divide Sqrt Abs Min Max Clamp Smoothstep)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(f: &Formula, p: Vec3) -> (f64, Vec3) {
        let (mut v, mut g) = ([0.0], [[0.0; 3]]);
        f.gradients(&[p], &mut v, &mut g);
        (v[0], g[0])
    }

    fn at(text: &str, p: Vec3) -> f64 {
        Formula::parse(text).map_or(f64::NAN, |f| f.value(p))
    }

    #[test]
    fn many_points_are_each_what_they_are_alone() {
        let text = "max(0, min(1, x/8 + 1)) * sqrt(abs(y)) - z^2 / sin(x + y) + smoothstep(-1, 1, z) - atan2(x, y)";
        let f = Formula::parse(text).unwrap_or_else(|e| panic!("{e}"));
        let points: Vec<Vec3> = (0..3 * LANES + 5)
            .map(|i| [0.754877666, 0.569840291, 0.819172513].map(|a| (i as f64 * a).fract() * 8.0 - 4.0))
            .collect();
        let (mut v, mut w) = (vec![0.0; points.len()], vec![0.0; points.len()]);
        let mut g = vec![[0.0; 3]; points.len()];
        f.values(&points, &mut v);
        f.gradients(&points, &mut w, &mut g);
        for (i, p) in points.iter().enumerate() {
            let alone: f64 = f.run(p, &mut Vec::new());
            assert!(v[i] == alone && w[i] == alone, "{} {} {alone}", v[i], w[i]);
            assert_eq!(gradient(&f, *p), (w[i], g[i]));
        }
    }

    #[test]
    fn operators_bind_as_in_mathematics() {
        let p = [3.0, 2.0, 0.5];
        for (text, want) in [
            ("-x^2", -9.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("-2^-2", -0.25),
            ("1 - 2 - 3", -4.0),
            ("8 / 4 / 2", 1.0),
            ("2 + 3 * 4", 14.0),
            ("(2 + 3) * 4", 20.0),
            ("--x", 3.0),
            ("2*-x", -6.0),
            ("+1.5e1 - .5", 14.5),
            ("1e0 + 2e+1 + 1.", 22.0),
            ("x*y + z", 6.5),
            ("min(x, y) + max(x, y)", 5.0),
            ("clamp(x, 0, 1)", 1.0),
            ("mod(-1, 3)", 2.0),
            ("mod(7, -3)", -2.0),
            ("atan2(1, 1) * 4 - pi", 0.0),
            ("hypot(x, 4)", 5.0),
            ("log(e) + log10(100)", 3.0),
            ("smoothstep(0, 1, z)", 0.5),
            ("step(1, x) + sign(-x) + floor(z) + ceil(z)", 1.0),
        ] {
            assert!((at(text, p) - want).abs() < 1e-15, "{text} = {} not {want}", at(text, p));
        }
    }

    #[test]
    fn gradients_follow_the_chain_rule() {
        let f = Formula::parse("x^2*sin(y) + exp(z)/x").unwrap_or(Formula { program: vec![] });
        let [x, y, z] = [1.3, 0.7, 0.2f64];
        let (_, g) = gradient(&f, [x, y, z]);
        let want = [2.0 * x * y.sin() - z.exp() / (x * x), x * x * y.cos(), z.exp() / x];
        for a in 0..3 {
            assert!((g[a] - want[a]).abs() < 1e-14);
        }
        // A constant exponent gives no logarithm of a negative number, a standing argument no 0 · ∞.
        let (v, g) = Formula::parse("x^3 + sqrt(0*y)").map_or((0.0, [0.0; 3]), |f| gradient(&f, [-2.0, 1.0, 0.0]));
        assert_eq!((v, g[0]), (-8.0, 12.0));
    }

    #[test]
    fn bounds_hold_over_random_boxes() {
        let mut s = 3u64;
        let mut next = || (geometry::random::random(&mut s) + 1.0) / 2.0;
        for text in
            ["sin(x*y)/(2+cos(z))", "x^2 - y^3 + abs(z)^1.5", "mod(x, 0.7)*smoothstep(-1, 1, y)", "log(2+hypot(x,y))^2"]
        {
            let f = Formula::parse(text).unwrap_or_else(|e| panic!("{e}"));
            for _ in 0..500 {
                let min = [0; 3].map(|_| next() * 4.0 - 2.0);
                let max = min.map(|v| v + next() * next());
                let bound = f.bound(&Aabb { min, max });
                for _ in 0..8 {
                    let p = [0, 1, 2].map(|a| min[a] + (max[a] - min[a]) * next());
                    let v = f.value(p);
                    assert!(bound.lo <= v && v <= bound.hi, "{text} at {p:?}: {v} not in {bound:?}");
                }
            }
        }
    }

    #[test]
    fn faults_say_where_and_what() {
        for (text, words) in [
            ("", "column 1: the formula ends; expected a number"),
            ("1 +", "column 4: the formula ends"),
            ("sinn(x)", "column 1: found 'sinn'; did you mean sin? Known words: x, y, z, pi"),
            ("0.3 + COS(x)", "column 7: found 'COS'; did you mean cos?"),
            ("2 x", "column 3: found 'x'; expected an operator"),
            ("(2 x", "column 4: found 'x'; expected an operator (+ - * / ^) or )"),
            (
                "0.2*(x > 3)",
                "column 8: found '>'; there are no comparisons; step(edge, v) is 1 where v is at least edge",
            ),
            ("if(x, 1, 2)", "column 1: found 'if'; step(edge, v) is 1"),
            ("x(2)", "column 2: found '('; x is not a function"),
            ("(x", "column 3: the formula ends; expected an operator or )"),
            ("x)", "column 2: found ')'; this bracket was never opened"),
            ("x**2", "column 2: found '*'; write a power as ^, not **"),
            ("atan2(x)", "column 8: found ')'; atan2 takes 2 arguments, not 1"),
            ("sin(x, y)", "column 6: found ','; sin takes no more than 1 argument"),
            ("sin x", "column 5: found 'x'; sin takes its argument in brackets"),
            ("1e999", "column 1: found '1'; expected a finite number"),
            ("x ; y", "column 3: found ';'"),
            ("ü + 1", "column 1: found 'ü'; known words: x, y, z, pi"),
            (".", "column 1: found '.'; expected a finite number"),
            ("__import__('os')", "column 1: found '__import__'"),
        ] {
            let message = Formula::parse(text).err().map_or(String::new(), |f| f.message);
            assert!(message.contains(words), "{text}: {message}");
        }
    }

    #[test]
    fn hostile_nesting_is_refused_not_followed() {
        for text in ["(".repeat(4000), "-".repeat(4000), "x^".repeat(2000), "sin(".repeat(1000), "x".repeat(5000)] {
            assert!(Formula::parse(&text).is_err());
        }
        assert!(Formula::parse(&format!("{}x{}", "(".repeat(60), ")".repeat(60))).is_ok());
        assert!(Formula::parse(&vec!["x"; 2000].join("+")).is_ok());
    }
}
