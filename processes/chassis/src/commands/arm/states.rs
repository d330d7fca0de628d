//! States from a file, one JSON object per line; blank lines are skipped. A line that is too long, no such object, or
//! holds the wrong number of numbers is an error with its number.

use std::io::{BufRead, Read};
use std::path::Path;

use arm::JointVector;
use serde::Deserialize;

use super::BadInput;

/// What an input line holds (rad, rad/s, rad/s², Nm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    pub q: JointVector,
    pub qd: JointVector,
    pub qdd: JointVector,
    pub tau: JointVector,
}

/// Seven numbers four times need 700 characters; whoever writes with spaces and names needs a few more.
const LINE_LIMIT: u64 = 64 << 10;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
}

/// The states of a file, with their line numbers (from 1).
pub struct States<R> {
    reader: R,
    file: String,
    line: u64,
    text: Vec<u8>,
}

impl States<std::io::BufReader<std::fs::File>> {
    pub fn open(path: &Path) -> Result<Self, BadInput> {
        let name = path.display().to_string();
        match std::fs::File::open(path) {
            Ok(file) => Ok(States::new(std::io::BufReader::new(file), name)),
            Err(error) => Err(BadInput::Unreadable { file: name, error: error.to_string() }),
        }
    }
}

impl<R: BufRead> States<R> {
    pub fn new(reader: R, file: String) -> States<R> {
        States {
            reader,
            file,
            line: 0,
            text: Vec::new(),
        }
    }

    /// An error about the line that was read last.
    pub fn error(&self, what: String) -> BadInput {
        BadInput::State {
            file: self.file.clone(),
            line: self.line,
            what,
        }
    }

    /// The next state; None at the end of the file.
    pub fn next(&mut self) -> Result<Option<State>, BadInput> {
        loop {
            self.text.clear();
            self.line += 1;
            let read = self
                .reader
                .by_ref()
                .take(LINE_LIMIT)
                .read_until(b'\n', &mut self.text);
            let read = read.map_err(|error| BadInput::Unreadable {
                file: self.file.clone(),
                error: error.to_string(),
            })?;
            if read == 0 {
                return Ok(None);
            }
            if read as u64 == LINE_LIMIT && self.text.last() != Some(&b'\n') {
                return Err(
                    self.error(format!("longer than {LINE_LIMIT} bytes, which no state is"))
                );
            }
            if !self.text.trim_ascii().is_empty() {
                return parse(&self.text).map(Some).map_err(|what| self.error(what));
            }
        }
    }
}

fn parse(text: &[u8]) -> Result<State, String> {
    let line: Line = serde_json::from_slice(text).map_err(|error| {
        let message = error.to_string();
        // the parser counts lines of this one line
        let message = message.split(" at line ").next().unwrap_or_default();
        format!(
            "{message} (column {}), expected {{\"q\":[7],\"qd\":[7],\"qdd\":[7],\"tau\":[7]}}",
            error.column()
        )
    })?;
    let seven = |key: &str, values: Vec<f64>| match <[f64; 7]>::try_from(values) {
        Ok(values) => Ok(JointVector::from(values)),
        Err(values) => Err(format!("`{key}` has {} numbers, expected 7", values.len())),
    };
    Ok(State {
        q: seven("q", line.q)?,
        qd: seven("qd", line.qd)?,
        qdd: seven("qdd", line.qdd)?,
        tau: seven("tau", line.tau)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"q":[1,2,3,4,5,6,7],"qd":[0,0,0,0,0,0,0],"qdd":[0,0,0,0,0,0,0],"tau":[1e-3,0,0,0,0,0,-0.5]}"#;

    fn second_line(text: &str) -> String {
        let both = format!("{GOOD}\n{text}\n");
        let mut states = States::new(both.as_bytes(), "f".to_owned());
        assert!(matches!(states.next(), Ok(Some(_))));
        states.next().expect_err("this must be refused").to_string()
    }

    #[test]
    fn a_state_is_read_with_all_its_numbers_and_blank_lines_do_not_count() {
        let text = format!("\n{GOOD}\n   \n{GOOD}");
        let mut states = States::new(text.as_bytes(), "f".to_owned());
        for _ in 0..2 {
            let state = states.next().expect("a good line").expect("a state");
            assert_eq!((state.q[6], state.tau[0], state.tau[6]), (7.0, 1e-3, -0.5));
        }
        assert_eq!(states.next().expect("the end"), None);
    }

    #[test]
    fn a_wrong_number_of_numbers_is_told_with_line_and_key() {
        let six = GOOD.replace("\"qd\":[0,", "\"qd\":[");
        assert_eq!(
            second_line(&six),
            "f: line 2: `qd` has 6 numbers, expected 7"
        );
        let eight = GOOD.replace("\"qdd\":[0,", "\"qdd\":[0,0,");
        assert_eq!(
            second_line(&eight),
            "f: line 2: `qdd` has 8 numbers, expected 7"
        );
    }

    #[test]
    fn numbers_that_are_none_and_keys_that_are_none_are_told_with_their_line() {
        for bad in ["NaN", "Infinity", "null", "1e999", "\"1\""] {
            let error = second_line(&GOOD.replace("[1,", &format!("[{bad},")));
            assert!(
                error.starts_with("f: line 2: ") && error.contains("column"),
                "{error}"
            );
        }
        assert!(second_line(&GOOD.replace("\"qdd\"", "\"a\"")).contains("unknown field `a`"));
        assert!(second_line(r#"{"q":[1,2,3,4,5,6,7]}"#).contains("missing field `qd`"));
        assert!(second_line("\u{0}noise").contains("line 2"));
        assert!(second_line(&"[".repeat(70_000)).contains("line 2: longer than 65536 bytes"));
    }
}
