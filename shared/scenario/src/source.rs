//! A TOML text whose errors show file, line and key.

use crate::error::{Problem, ScenarioError};
use crate::file::read_text;
use miette::{NamedSource, SourceSpan};
use serde::de::DeserializeOwned;
use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// A longer file is no scenario.
const MAX_BYTES: u64 = 1 << 20;

/// A text and where it comes from.
#[derive(Clone, Debug)]
pub struct Source {
    file: String,
    text: String,
}

impl Source {
    /// A text that is part of the program.
    pub fn new(name: &str, text: &str) -> Source {
        Source { file: name.to_owned(), text: text.to_owned() }
    }

    /// Reads a file.
    pub fn read(path: &str) -> Result<Source, ScenarioError> {
        let text = read_text(path, MAX_BYTES)
            .map_err(|reason| ScenarioError::Read { name: path.to_owned(), reason })?;
        Ok(Source { file: path.to_owned(), text })
    }

    /// File or built-in name.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The text as a tree.
    pub(crate) fn tree(&self) -> Result<Table, ScenarioError> {
        self.text
            .parse()
            .map_err(|error: toml::de::Error| self.text_error("(file)", error.message(), error.span().unwrap_or(0..0)))
    }

    /// The text as a value of this type; every number in it is finite.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ScenarioError> {
        read_as(&self.tree()?).map_err(|problem| self.error(&problem))
    }

    /// Whether the key itself stands in the text.
    pub(crate) fn states(&self, key: &str) -> bool {
        DeTable::parse(&self.text).is_ok_and(|root| matches!(span_of(root.get_ref(), key), Found::Whole(_)))
    }

    /// An error with the line of its key, or of the closest key above it that stands in the text.
    pub fn error(&self, problem: &Problem) -> ScenarioError {
        let span = match DeTable::parse(&self.text).map(|root| span_of(root.get_ref(), &problem.key)) {
            Ok(Found::Whole(span) | Found::Parent(span)) => span,
            Err(_) => 0..0,
        };
        self.text_error(&problem.key, &problem.message, span)
    }

    fn text_error(&self, key: &str, message: &str, span: Range<usize>) -> ScenarioError {
        let start = span.start.min(self.text.len());
        let line = self.text.as_bytes()[..start].iter().filter(|byte| **byte == b'\n').count() + 1;
        ScenarioError::Text {
            file: self.file.clone(),
            line,
            key: key.to_owned(),
            message: message.trim_end().to_owned(),
            text: NamedSource::new(&self.file, self.text.clone()),
            span: SourceSpan::from(start..span.end.clamp(start, self.text.len())),
        }
    }
}

/// A tree as a value of this type; every number in it is finite.
pub(crate) fn read_as<T: DeserializeOwned>(tree: &Table) -> Result<T, Problem> {
    finite(&mut String::new(), &Value::Table(tree.clone()))?;
    serde_path_to_error::deserialize(tree.clone()).map_err(|error| {
        let path = error.path().to_string().replace('[', ".").replace(']', "");
        let message = error.into_inner();
        Problem::new(path.trim_start_matches('.'), message.message())
    })
}

/// TOML has `nan` and `inf`; no key of a scenario takes them.
fn finite(path: &mut String, value: &Value) -> Result<(), Problem> {
    let length = path.len();
    let mut visit = |part: &str, value: &Value| {
        if length > 0 {
            path.push('.');
        }
        path.push_str(part);
        finite(path, value)?;
        path.truncate(length);
        Ok(())
    };
    match value {
        Value::Float(number) if !number.is_finite() => {
            Err(Problem::new(path.clone(), format!("is {number}, expected a finite number")))
        }
        Value::Table(table) => table.iter().try_for_each(|(key, value)| visit(key, value)),
        Value::Array(array) => array.iter().enumerate().try_for_each(|(i, value)| visit(&i.to_string(), value)),
        _ => Ok(()),
    }
}

enum Found {
    /// The key itself stands in the text.
    Whole(Range<usize>),
    /// Only a table or array above it.
    Parent(Range<usize>),
}

fn span_of(root: &DeTable<'_>, key: &str) -> Found {
    let mut table = Some(root);
    let mut array = None;
    let mut span = 0..0;
    for part in key.split('.') {
        let next: Option<&toml::Spanned<DeValue<'_>>> = if let Some(table) = table {
            match table.get_key_value(part) {
                Some((name, value)) => {
                    // `[[segment]]` spans its header only through its key
                    span = if value.get_ref().is_table() || value.get_ref().is_array() {
                        name.span()
                    } else {
                        value.span()
                    };
                    Some(value)
                }
                None => None,
            }
        } else if let Some(array) = array {
            let array: &toml::de::DeArray<'_> = array;
            part.parse().ok().and_then(|i: usize| array.get(i)).inspect(|value| span = value.span())
        } else {
            None
        };
        match next.map(|value| value.get_ref()) {
            Some(DeValue::Table(inner)) => (table, array) = (Some(inner), None),
            Some(DeValue::Array(inner)) => (table, array) = (None, Some(inner)),
            Some(_) => (table, array) = (None, None),
            None => return Found::Parent(span),
        }
    }
    Found::Whole(span)
}
