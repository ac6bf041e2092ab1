//! Parameters of methods: described as data, so that flags, menus and benches come from one place.

use std::collections::BTreeMap;
use std::fmt;

use crate::error::{Error, Result};

/// A value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// One of the words of a [`ParamKind::Choice`].
    Choice(&'static str),
    /// A whole number.
    Integer(u32),
    /// A number.
    Number(f32),
}

impl fmt::Display for Value {
    /// As [`Params::set`] reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Choice(word) => f.write_str(word),
            Self::Integer(n) => write!(f, "{n}"),
            Self::Number(x) => write!(f, "{x}"),
        }
    }
}

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamKind {
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A whole number between these, inclusive.
    Integer(u32, u32),
    /// A number between these, inclusive.
    Number(f32, f32),
}

/// A parameter of a method.
#[derive(Clone, Copy, Debug)]
pub struct ParamInfo {
    /// Name, as after `--`.
    pub id: &'static str,
    /// One line for people.
    pub about: &'static str,
    /// Unit, or empty.
    pub unit: &'static str,
    /// What it takes.
    pub kind: ParamKind,
    /// What it is if nothing is said.
    pub default: Value,
    /// Whether it trades time for error.
    pub is_quality_knob: bool,
}

impl ParamInfo {
    /// What it takes and its default, for help texts.
    pub fn takes(&self) -> String {
        match (self.kind, self.default) {
            (ParamKind::Choice(words), Value::Choice(word)) => {
                format!("{}; default {word}", words.join(" | "))
            }
            (ParamKind::Integer(min, max), Value::Integer(n)) => {
                format!("{min} to {max}; default {n}")
            }
            (ParamKind::Number(min, max), Value::Number(x)) => {
                format!("{min} to {max}; default {x}")
            }
            (_, default) => format!("{default:?}"),
        }
    }

    /// What stands for its value in help texts.
    pub fn value_name(&self) -> &'static str {
        match self.kind {
            ParamKind::Choice(_) => "WORD",
            ParamKind::Integer(..) => "N",
            ParamKind::Number(..) => "X",
        }
    }
}

/// Values for all parameters of one method.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params(BTreeMap<&'static str, Value>);

impl Params {
    /// The defaults.
    pub fn defaults(infos: &[ParamInfo]) -> Self {
        Self(infos.iter().map(|i| (i.id, i.default)).collect())
    }

    /// Sets a parameter from text.
    ///
    /// # Errors
    /// Names the parameter and what it takes.
    pub fn set(&mut self, info: &ParamInfo, text: &str) -> Result<()> {
        let flag = format!("--{}", info.id);
        let value = match info.kind {
            ParamKind::Choice(words) => {
                let word = words.iter().find(|w| **w == text).ok_or_else(|| {
                    Error::input(
                        flag,
                        "",
                        format!("\"{text}\" is not a choice"),
                        format!("use one of {}", words.join(", ")),
                    )
                })?;
                Value::Choice(word)
            }
            ParamKind::Integer(min, max) => {
                let number = text.parse().ok().filter(|n| (min..=max).contains(n));
                Value::Integer(number.ok_or_else(|| {
                    Error::input(
                        flag,
                        "",
                        format!("\"{text}\" is not a whole number from {min} to {max}"),
                        "give such a number",
                    )
                })?)
            }
            ParamKind::Number(min, max) => {
                let number = text.parse().ok().filter(|x| (min..=max).contains(x));
                Value::Number(number.ok_or_else(|| {
                    Error::input(
                        flag,
                        "",
                        format!("\"{text}\" is not a number from {min} to {max}"),
                        "give such a number",
                    )
                })?)
            }
        };
        self.0.insert(info.id, value);
        Ok(())
    }

    /// The value of a parameter; `None` if the method has no such parameter.
    pub fn get(&self, id: &str) -> Option<Value> {
        self.0.get(id).copied()
    }

    /// The word of a choice.
    ///
    /// # Panics
    /// If the method has no such choice.
    pub fn choice(&self, id: &str) -> &'static str {
        match self.0.get(id) {
            Some(Value::Choice(word)) => word,
            other => panic!("parameter {id} is {other:?}, not a choice"),
        }
    }

    /// The number of a parameter that takes any.
    ///
    /// # Panics
    /// If the method has no such number.
    pub fn number(&self, id: &str) -> f32 {
        match self.0.get(id) {
            Some(Value::Number(x)) => *x,
            other => panic!("parameter {id} is {other:?}, not a number"),
        }
    }

    /// The number of an integer parameter.
    ///
    /// # Panics
    /// If the method has no such number.
    pub fn integer(&self, id: &str) -> u32 {
        match self.0.get(id) {
            Some(Value::Integer(n)) => *n,
            other => panic!("parameter {id} is {other:?}, not an integer"),
        }
    }
}
