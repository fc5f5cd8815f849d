//! Parser: text to a stack program.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = signed { ("*" | "/") signed }
//! signed  = ("-" | "+") signed | power
//! power   = atom [ "^" signed ]                       (so −x² is −(x²), and 2^3^2 is 2^9)
//! atom    = number | x | y | z | pi | e | name "(" sum { "," sum } ")" | "(" sum ")"
//! ```

use super::Instruction;
use super::operation::{FUNCTIONS, Operation};
use geometry::fault::{Fault, counted, nearest};

/// The longest formula, in bytes.
const LONGEST: usize = 4096;
/// The deepest nesting of brackets, signs and powers.
const DEEPEST: usize = 64;

/// The variables of every formula.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
const CONSTANTS: [(&str, f64); 2] = [("pi", core::f64::consts::PI), ("e", core::f64::consts::E)];

/// The words that have a meaning in every formula.
pub(super) fn reserved() -> impl Iterator<Item = &'static str> + Clone {
    AXES.into_iter().chain(CONSTANTS.iter().map(|c| c.0)).chain(FUNCTIONS.iter().map(|f| f.0))
}

/// The program of a formula whose variables are x, y, z and `names`. **Errors** as `Formula::parse` says.
pub(super) fn parse(text: &str, names: &[&str]) -> Result<Vec<Instruction>, Fault> {
    if text.len() > LONGEST {
        let n = text.len();
        return Err(Fault::new("", format!("the formula has {n} characters; at most {LONGEST} are read")));
    }
    let mut p = Parser { text, names, at: 0, depth: 0, program: Vec::new() };
    p.sum()?;
    match p.peek() {
        None => Ok(p.program),
        Some('*') => Err(p.fault("write a power as ^, not **")),
        Some(')') => Err(p.fault("this bracket was never opened")),
        Some(c) => Err(p.unexpected(c, "the end")),
    }
}

/// What to write where other languages compare.
const STEP: &str =
    "step(edge, v) is 1 where v is at least edge, 0 elsewhere: v1 + (v2 - v1)*step(3, x) is v2 from x = 3 on";

struct Parser<'a> {
    text: &'a str,
    names: &'a [&'a str],
    at: usize,
    depth: usize,
    program: Vec<Instruction>,
}

impl<'a> Parser<'a> {
    fn sum(&mut self) -> Result<(), Fault> {
        self.product()?;
        while let Some(sign @ ('+' | '-')) = self.peek() {
            self.at += 1;
            self.product()?;
            self.apply(if sign == '+' { Operation::Add } else { Operation::Subtract });
        }
        Ok(())
    }

    fn product(&mut self) -> Result<(), Fault> {
        self.signed()?;
        while let Some(sign @ ('*' | '/')) = self.peek() {
            if self.text[self.at..].starts_with("**") {
                break;
            }
            self.at += 1;
            self.signed()?;
            self.apply(if sign == '*' { Operation::Multiply } else { Operation::Divide });
        }
        Ok(())
    }

    /// The only rule by which nesting grows; it keeps the recursion, and so the call stack, bounded.
    fn signed(&mut self) -> Result<(), Fault> {
        if self.depth == DEEPEST {
            return Err(self.fault(&format!("nested more than {DEEPEST} deep")));
        }
        self.depth += 1;
        match self.peek() {
            Some('-') => {
                self.at += 1;
                self.signed()?;
                self.apply(Operation::Negate);
            }
            Some('+') => {
                self.at += 1;
                self.signed()?;
            }
            _ => {
                self.atom()?;
                if self.peek() == Some('^') {
                    self.at += 1;
                    self.signed()?;
                    self.apply(Operation::Power);
                }
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn atom(&mut self) -> Result<(), Fault> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                self.sum()?;
                self.expect(')')
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.word(),
            _ => Err(self.fault("expected a number, x, y, z, pi, e, a function or a bracket")),
        }
    }

    fn number(&mut self) -> Result<(), Fault> {
        let bytes = self.text.as_bytes();
        let digits = |mut i: usize| {
            while bytes.get(i).is_some_and(u8::is_ascii_digit) {
                i += 1;
            }
            i
        };
        let mut end = digits(self.at);
        if bytes.get(end) == Some(&b'.') {
            end = digits(end + 1);
        }
        if let Some(b'e' | b'E') = bytes.get(end) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            let last = digits(end + 1 + sign);
            if last > end + 1 + sign {
                end = last;
            }
        }
        match self.text[self.at..end].parse::<f64>() {
            Ok(v) if v.is_finite() => {
                self.program.push(Instruction::Number(v));
                self.at = end;
                Ok(())
            }
            _ => Err(self.fault("expected a finite number")),
        }
    }

    fn word(&mut self) -> Result<(), Fault> {
        let rest = &self.text[self.at..];
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let word = &rest[..end];
        let variable = AXES.iter().chain(self.names).position(|name| *name == word);
        let instruction = match (variable, CONSTANTS.iter().find(|c| c.0 == word)) {
            (Some(n), _) => Instruction::Variable(n),
            (None, Some((_, v))) => Instruction::Number(*v),
            (None, None) => return self.call(word),
        };
        self.program.push(instruction);
        self.at += end;
        if self.peek() == Some('(') {
            return Err(self.fault(&format!("{word} is not a function; write * to multiply")));
        }
        Ok(())
    }

    fn call(&mut self, word: &str) -> Result<(), Fault> {
        let Some(&(_, op)) = FUNCTIONS.iter().find(|f| f.0 == word) else {
            if ["if", "where", "heaviside"].contains(&word) {
                return Err(self.fault(STEP));
            }
            let known = reserved().map(|word| -> &'a str { word });
            let names = known.clone().take(AXES.len()).chain(self.names.iter().copied()).chain(known.skip(AXES.len()));
            let meant = nearest(word, names.clone());
            let known = match meant {
                Some(name) => format!("did you mean {name}? Known words"),
                None => "known words".to_string(),
            };
            let list = names.collect::<Vec<_>>().join(", ");
            return Err(self.fault(&format!("{known}: {list}")));
        };
        self.at += word.len();
        if self.peek() != Some('(') {
            return Err(self.fault(&format!("{word} takes its argument in brackets: expected (")));
        }
        self.at += 1;
        self.sum()?;
        for k in 1..op.arity() {
            if self.peek() != Some(',') {
                return Err(self.fault(&format!("{word} takes {} arguments, not {k}: expected a comma", op.arity())));
            }
            self.at += 1;
            self.sum()?;
        }
        if self.peek() == Some(',') {
            return Err(self.fault(&format!("{word} takes no more than {}", counted(op.arity(), "argument"))));
        }
        self.expect(')')?;
        self.apply(op);
        Ok(())
    }

    fn apply(&mut self, op: Operation) {
        self.program.push(Instruction::Apply(op));
    }

    fn expect(&mut self, c: char) -> Result<(), Fault> {
        if self.peek() == Some(c) {
            self.at += 1;
            return Ok(());
        }
        let Some(found) = self.peek() else { return Err(self.fault(&format!("expected an operator or {c}"))) };
        Err(self.unexpected(found, &c.to_string()))
    }

    /// What to say of a character that stands where an operator or something else should.
    fn unexpected(&mut self, found: char, otherwise: &str) -> Fault {
        match found {
            '<' | '>' | '=' | '!' => self.fault(&format!("there are no comparisons; {STEP}")),
            _ => self.fault(&format!("expected an operator (+ - * / ^) or {otherwise}")),
        }
    }

    /// The next character that is not whitespace.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        let c = rest.chars().find(|c| !c.is_whitespace());
        self.at += rest.len() - rest.trim_start().len();
        c
    }

    /// A fault at the next character: column, what was found, what to do.
    fn fault(&mut self, message: &str) -> Fault {
        let next = self.peek();
        let column = self.text[..self.at].chars().count() + 1;
        let rest = &self.text[self.at..];
        let found = match next {
            None => "the formula ends".to_string(),
            Some(c) if c.is_alphabetic() || c == '_' => {
                let word = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').take(32);
                format!("found '{}'", word.collect::<String>())
            }
            Some(c) => format!("found '{}'", c.escape_debug()),
        };
        Fault::new("", format!("column {column}: {found}; {message}"))
    }
}
