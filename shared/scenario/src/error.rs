//! What can be wrong with a scenario, shown with file, line and key.

use miette::{Diagnostic, NamedSource, SourceSpan};
use thiserror::Error;

/// A scenario that cannot be run.
#[derive(Debug, Error, Diagnostic)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("cannot read scenario {name}: {reason}")]
    #[diagnostic(help("give the name of a built-in scenario (`vmerack scenarios` lists them) or the path of a TOML file"))]
    Read {
        /// Name or path given.
        name: String,
        /// What the operating system says.
        reason: String,
    },
    /// Something in the text.
    #[error("{file}:{line}: {key}: {message}")]
    Text {
        /// File or built-in name.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Key path, for example `segment.2.mass_kg`; `(file)` where the text is no TOML.
        key: String,
        /// What is wrong and what was expected.
        message: String,
        /// The text.
        #[source_code]
        text: NamedSource<String>,
        /// Where in it.
        #[label("here")]
        span: SourceSpan,
    },
    /// An override of the command line or of a variant.
    #[error("{origin}: {key}: {message}")]
    Override {
        /// `--set` or `variant NAME`.
        origin: String,
        /// Key path.
        key: String,
        /// What is wrong and what was expected.
        message: String,
    },
}

/// A key and what is wrong with it, before its place in the text is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Key path, array indices as numbers from 0.
    pub key: String,
    /// What is wrong and what was expected.
    pub message: String,
}

impl Problem {
    /// At this key, this.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Problem {
        Problem { key: key.into(), message: message.into() }
    }
}
