//! The one error type of the library.

use std::path::Path;

/// Why something could not be done, in one clear message.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Bad input: names the source (a file or an option), the place in it, what is wrong and what to do.
    #[error("{name}: {place}{problem}; {remedy}", place = Place(.place))]
    Input {
        /// The file, built-in name or option that was given.
        name: String,
        /// Where in it ("vertex 12", "line 3"); empty if it is the whole.
        place: String,
        /// What is wrong.
        problem: String,
        /// What the user can do.
        remedy: String,
    },
    /// An output could not be written.
    #[error("{name}: cannot be written: {problem}; {remedy}", remedy = remedy(.problem))]
    Output {
        /// The file to be written.
        name: String,
        /// What the system said.
        problem: String,
    },
    /// The work was cancelled; nothing was written.
    #[error("cancelled")]
    Cancelled,
}

/// `Ok` or [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// Bad input: see [`Error::Input`].
    pub fn input(
        name: impl Into<String>,
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Input {
            name: name.into(),
            place: place.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// Bad input that is a file: see [`Error::Input`].
    pub fn file(
        path: &Path,
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::input(path.display().to_string(), place, problem, remedy)
    }
}

fn remedy(problem: &str) -> &'static str {
    if problem.contains("folder does not exist") {
        "create the folder, or choose another place"
    } else {
        "choose another place or free some space"
    }
}

struct Place<'a>(&'a str);

impl std::fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, "{}: ", self.0) }
    }
}
