//! `--with`: a method with its flags in one argument.

use catoptric::Error;
use catoptric::analysis::methods::Candidate;
use clap::{Args, Command, FromArgMatches};

use super::super::super::render::HowArgs;
use super::super::super::{chosen_method, with_method_flags};

/// What such an argument asks for: the candidate, and where it runs.
///
/// # Errors
/// As on `render`'s command line, with the argument named.
pub(super) fn candidate(text: &str) -> anyhow::Result<(Candidate, HowArgs)> {
    let words = text.split_whitespace().filter(|word| *word != "--method");
    let mut words = words.peekable();
    let command = with_method_flags(HowArgs::augment_args(Command::new("with")));
    let refused = |problem: String| {
        let remedy = "give a method and its flags, as in \"estalella --grid 0.1\"";
        Error::input(format!("--with \"{text}\""), "", problem, remedy)
    };
    let method = words.next().ok_or_else(|| refused("is empty".into()))?;
    let line = ["with", "--method", method].into_iter().chain(words);
    let first = |error: clap::Error| {
        let text = error.to_string();
        let line = text.lines().next().unwrap_or_default();
        refused(line.trim_start_matches("error: ").to_owned())
    };
    let matches = command.try_get_matches_from(line).map_err(first)?;
    let how = HowArgs::from_arg_matches(&matches).map_err(first)?;
    let (method, params, _) = chosen_method(&how, &matches)?;
    let label = text.split_whitespace().collect::<Vec<_>>().join(" ");
    Ok((Candidate { label, method, params, knobs: false }, how))
}

/// A label as a file's name: what is no letter, digit or dot becomes a dash.
pub(super) fn file_name(label: &str) -> String {
    let letters = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    let dashed: String = label.chars().map(letters).collect();
    let parts: Vec<&str> = dashed.split('-').filter(|part| !part.is_empty()).collect();
    format!("{}.png", parts.join("-"))
}
