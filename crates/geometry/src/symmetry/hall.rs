//! Hall symbols: a space group in a few letters, origin and axes included.
//!
//! Source: S. R. Hall, Space-group notation with an explicit origin, Acta Cryst. A37 (1981) 517; International Tables for
//! Crystallography B (2010), appendix A1.4.2.

use std::collections::HashSet;

use super::{Operation, Rotation, WHOLE};

const NONE: Rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const INVERSE: Rotation = [[-1, 0, 0], [0, -1, 0], [0, 0, -1]];

/// All operations of the group, centring translations included, the identity first.
///
/// # Errors
/// What in the symbol cannot be read.
pub(super) fn operations(symbol: &str) -> Result<Vec<Operation>, String> {
    let (symbol, shift) = origin(symbol)?;
    let mut words = symbol.split_whitespace();
    let lattice = words.next().ok_or("it is empty")?;
    let (inverse, letter) = match lattice.strip_prefix('-') {
        Some(letter) => (true, letter),
        None => (false, lattice),
    };
    let mut generators: Vec<Operation> =
        centring(letter)?.iter().map(|t| Operation { rotation: NONE, translation: t.map(|t| t * 2) }).collect();
    if inverse {
        generators.push(Operation { rotation: INVERSE, translation: [0; 3] });
    }
    let mut previous = PreviousRotation::default();
    for word in words {
        generators.push(generator(word, &mut previous)?);
    }
    if previous.count == 0 {
        return Err("no rotation follows the lattice's letter".into());
    }
    for g in &mut generators {
        *g = g.about(shift);
    }
    closed(&generators)
}

/// Splits off the shift of the origin, "(x y z)" in twelfths; gives it in parts of `WHOLE`.
fn origin(symbol: &str) -> Result<(&str, [i32; 3]), String> {
    let Some((symbol, rest)) = symbol.split_once('(') else {
        return Ok((symbol, [0; 3]));
    };
    let inside = rest.trim_end().strip_suffix(')');
    let numbers: Option<Vec<i32>> = inside.and_then(|s| s.split_whitespace().map(|n| n.parse().ok()).collect());
    match numbers.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|v| v.abs() < 12) => Ok((symbol, [x, y, z].map(|v| v * 2))),
        _ => Err(format!(
            "\"({rest}\" is no shift of the origin; it is three whole numbers of twelfths, such as (0 0 1)"
        )),
    }
}

/// The centring translations of a lattice, in twelfths.
fn centring(letter: &str) -> Result<&'static [[i32; 3]], String> {
    Ok(match letter {
        "P" => &[],
        "A" => &[[0, 6, 6]],
        "B" => &[[6, 0, 6]],
        "C" => &[[6, 6, 0]],
        "I" => &[[6, 6, 6]],
        "R" => &[[8, 4, 4], [4, 8, 8]],
        "S" => &[[4, 4, 8], [8, 8, 4]],
        "T" => &[[4, 8, 4], [8, 4, 8]],
        "F" => &[[0, 6, 6], [6, 0, 6], [6, 6, 0]],
        _ => {
            return Err(format!(
                "\"{letter}\" is no lattice; there are P, A, B, C, I, R, S, T and F, with or without a minus"
            ));
        }
    })
}

/// The rotation read before, which decides the axis of the next if none is written.
#[derive(Default)]
struct PreviousRotation {
    count: usize,
    order: u32,
    axis: usize,
}

/// Reads one word: a rotation's order, its axis, its screw and its translations.
fn generator(word: &str, previous: &mut PreviousRotation) -> Result<Operation, String> {
    let wrong = |why: &str| Err(format!("\"{word}\": {why}"));
    let (negative, rest) = match word.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, word),
    };
    let mut letters = rest.chars().peekable();
    let Some(order @ (1 | 2 | 3 | 4 | 6)) = letters.next().and_then(|c| c.to_digit(10)) else {
        return wrong("a rotation begins with its order, 1, 2, 3, 4 or 6");
    };
    let written = letters.next_if(|c| "xyz'\"*".contains(*c));
    let axis = written.unwrap_or(match (previous.count, order, previous.order) {
        (1, 2, 2 | 4) => 'x',
        (1, 2, 3 | 6) => '\'',
        (1 | 2, 3, _) => '*',
        _ => 'z',
    });
    let (rotation, along) = match axis {
        '*' if order == 3 => ([[0, 0, 1], [1, 0, 0], [0, 1, 0]], 2),
        '\'' | '"' if order == 2 => (diagonal(previous.axis, axis == '"'), previous.axis),
        '*' | '\'' | '"' => return wrong("no rotation of this order has such an axis"),
        _ => {
            let along = ['x', 'y', 'z'].iter().position(|a| *a == axis);
            let along = along.unwrap_or(2);
            (principal(order, along), along)
        }
    };
    let mut translation = [0; 3];
    for c in letters {
        let half = WHOLE / 2;
        let add = match c {
            'a' => [half, 0, 0],
            'b' => [0, half, 0],
            'c' => [0, 0, half],
            'n' => [half; 3],
            'u' => [half / 2, 0, 0],
            'v' => [0, half / 2, 0],
            'w' => [0, 0, half / 2],
            'd' => [half / 2; 3],
            _ => match c.to_digit(10) {
                Some(n) if n > 0 && n < order => {
                    let mut add = [0; 3];
                    add[along] = WHOLE * n as i32 / order as i32;
                    add
                }
                _ => {
                    return wrong("what follows the axis is a screw or the letters a b c n u v w d");
                }
            },
        };
        translation = [0, 1, 2].map(|i| translation[i] + add[i]);
    }
    *previous = PreviousRotation { count: previous.count + 1, order, axis: along };
    Ok(Operation { rotation: if negative { rotation.map(|r| r.map(|v| -v)) } else { rotation }, translation })
}

/// A rotation about a principal axis, in a basis in which it is one of whole numbers.
fn principal(order: u32, axis: usize) -> Rotation {
    // About z: how x and y turn.
    let [[a, b], [c, d]] = match order {
        1 => [[1, 0], [0, 1]],
        2 => [[-1, 0], [0, -1]],
        3 => [[0, -1], [1, -1]],
        4 => [[0, -1], [1, 0]],
        _ => [[1, -1], [1, 0]],
    };
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut r = [[0; 3]; 3];
    r[axis][axis] = 1;
    (r[i][i], r[i][j], r[j][i], r[j][j]) = (a, b, c, d);
    r
}

/// The rotation by half a turn about a diagonal of the plane across an axis: the difference of the two others (′) or
/// their sum (″).
fn diagonal(axis: usize, sum: bool) -> Rotation {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let s = if sum { 1 } else { -1 };
    let mut r = [[0; 3]; 3];
    r[axis][axis] = -1;
    (r[i][j], r[j][i]) = (s, s);
    r
}

/// All products of the generators.
fn closed(generators: &[Operation]) -> Result<Vec<Operation>, String> {
    /// No space group has more operations in a cell.
    const MOST: usize = 192;
    let one = Operation { rotation: NONE, translation: [0; 3] };
    let mut all = vec![one];
    let mut known: HashSet<Operation> = all.iter().copied().collect();
    let mut at = 0;
    while at < all.len() {
        for g in generators {
            let new = all[at].after(g);
            if known.insert(new) {
                all.push(new);
            }
        }
        if all.len() > MOST {
            return Err("its rotations make no space group".into());
        }
        at += 1;
    }
    Ok(all)
}
