//! Parses text into an expression.

use winnow::Parser;
use winnow::ascii::{float, multispace0};
use winnow::combinator::{Infix, Prefix, alt, delimited, eof, expression, opt, peek, preceded, terminated};
use winnow::error::ContextError;
use winnow::token::{any, take_till, take_while};

use super::error::{MOST_CHARACTERS, MOST_OPEN, ValueError};
use super::expression::{Function, Operator, Tree};

type Result<T> = winnow::Result<T, ContextError>;

/// What a name resolves to during parsing.
#[derive(Debug)]
enum Parsed {
    Number(f64),
    Name(String),
    Negative(Box<Parsed>),
    Binary(Operator, Box<[Parsed; 2]>),
    Call(String, Box<Parsed>),
}

/// Parses text into an expression, given what each name stands for; the error describes what is wrong.
pub(super) fn parse(
    text: &str,
    leaf_of: &mut impl FnMut(&str) -> std::result::Result<Tree, ValueError>,
) -> std::result::Result<Tree, ValueError> {
    let [open, closed] = ['(', ')'].map(|symbol| text.matches(symbol).count());
    if text.len() > MOST_CHARACTERS || open > MOST_OPEN {
        return Err(ValueError::TooLong { characters: text.len(), parentheses: open });
    }
    if open != closed {
        return Err(ValueError::Parentheses { opening: open, closing: closed });
    }
    let parsed = terminated(sum, (multispace0, eof)).parse(text).map_err(|error| {
        let (before, after) = text.split_at(error.offset());
        ValueError::Unexpected { before: before.trim().to_owned(), after: after.trim().to_owned() }
    })?;
    bind(parsed, leaf_of)
}

fn bind(
    parsed: Parsed,
    leaf_of: &mut impl FnMut(&str) -> std::result::Result<Tree, ValueError>,
) -> std::result::Result<Tree, ValueError> {
    Ok(match parsed {
        Parsed::Number(number) => Tree::Number(number),
        Parsed::Name(name) => leaf_of(&name)?,
        Parsed::Negative(of) => match bind(*of, leaf_of)? {
            Tree::Number(number) => Tree::Number(-number),
            of => Tree::Negative(Box::new(of)),
        },
        Parsed::Binary(operator, of) => {
            let [a, b] = *of;
            Tree::Binary(operator, Box::new([bind(a, leaf_of)?, bind(b, leaf_of)?]))
        }
        Parsed::Call(name, of) => {
            let known = Function::ALL.iter().find(|(known, _)| *known == name);
            let Some(&(_, function)) = known else {
                return Err(ValueError::UnknownFunction { name });
            };
            Tree::Function(function, Box::new(bind(*of, leaf_of)?))
        }
    })
}

/// Applies an operator to its two operands.
type Applied = fn(&mut &str, Parsed, Parsed) -> Result<Parsed>;

fn sum(input: &mut &str) -> Result<Parsed> {
    let symbol = |symbol: char| delimited(multispace0, symbol, multispace0);
    let apply = |operator: Operator| -> Applied {
        match operator {
            Operator::Add => |_, a, b| Ok(Parsed::Binary(Operator::Add, Box::new([a, b]))),
            Operator::Subtract => |_, a, b| Ok(Parsed::Binary(Operator::Subtract, Box::new([a, b]))),
            Operator::Multiply => |_, a, b| Ok(Parsed::Binary(Operator::Multiply, Box::new([a, b]))),
            Operator::Divide => |_, a, b| Ok(Parsed::Binary(Operator::Divide, Box::new([a, b]))),
            Operator::Power => |_, a, b| Ok(Parsed::Binary(Operator::Power, Box::new([a, b]))),
        }
    };
    // A power binds more tightly than the sign before its base.
    expression(preceded(multispace0, operand))
        .prefix(symbol('-').map(|_| Prefix(6, |_: &mut &str, of| Ok(Parsed::Negative(Box::new(of))))))
        .infix(alt((
            symbol('+').map(|_| Infix::Left(3, apply(Operator::Add))),
            symbol('-').map(|_| Infix::Left(3, apply(Operator::Subtract))),
            symbol('*').map(|_| Infix::Left(5, apply(Operator::Multiply))),
            symbol('/').map(|_| Infix::Left(5, apply(Operator::Divide))),
            symbol('^').map(|_| Infix::Right(8, apply(Operator::Power))),
        )))
        .parse_next(input)
}

fn operand(input: &mut &str) -> Result<Parsed> {
    let starts = |c: char| c.is_alphabetic() || c == '_';
    let goes_on = |c: char| c.is_alphanumeric() || "_.".contains(c);
    let word = (any.verify(move |&c: &char| starts(c)), take_while(0.., goes_on)).take();
    let closed = || (multispace0, ')');
    let call = preceded('(', terminated(sum, closed()));
    alt((
        delimited('(', sum, closed()),
        delimited('{', take_till(1.., '}'), '}').map(|name: &str| Parsed::Name(name.to_owned())),
        (word, opt(call)).map(|(name, of): (&str, Option<Parsed>)| match of {
            Some(of) => Parsed::Call(name.to_owned(), Box::new(of)),
            None => Parsed::Name(name.to_owned()),
        }),
        preceded(peek(any.verify(|c: &char| c.is_ascii_digit() || *c == '.')), float).map(Parsed::Number),
    ))
    .parse_next(input)
}
