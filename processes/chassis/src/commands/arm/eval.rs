//! `vmerack arm eval`: every algorithm on every state of a file, as text or one JSON object per line.

use std::io::Write;
use std::path::Path;

use arm::{ArmModel, ArmState, JointVector, Spatial, TipMotion};
use serde::Serialize;

use super::Failure;
use super::states::{State, States};

/// The answer to one state, under the names and in the shapes that the command promises.
#[derive(Debug, Serialize)]
struct Answer {
    pose: [[f64; 4]; 4],
    jacobian: [[f64; 7]; 6],
    jdot_qd: [f64; 6],
    mass_matrix: [[f64; 7]; 7],
    bias: [f64; 7],
    rnea: [f64; 7],
    fd: [f64; 7],
}

pub fn run(model: &ArmModel, file: &Path, json: bool, out: &mut impl Write) -> Result<(), Failure> {
    let mut states = States::open(file)?;
    let mut count = 0_u64;
    while let Some(state) = states.next()? {
        count += 1;
        let answer = evaluate(model, &state);
        if !answer
            .rows()
            .all(|(_, row)| row.iter().all(|v| v.is_finite()))
        {
            return Err(states
                .error("the values are so large that a result is not finite".to_owned())
                .into());
        }
        let written = if json {
            serde_json::to_writer(&mut *out, &answer)
                .map_err(std::io::Error::from)
                .and_then(|()| writeln!(out))
        } else {
            write_text(&answer, count, out)
        };
        written.map_err(Failure::Output)?;
    }
    Ok(())
}

fn evaluate(model: &ArmModel, state: &State) -> Answer {
    let at = ArmState::new(model, &state.q, &state.qd);
    let TipMotion {
        pose,
        jacobian,
        jdot_qd,
        ..
    } = at.tip_motion();
    let (mass_matrix, bias) = at.dynamics();
    let fd = at.aba(&state.tau, &JointVector::zeros(), &Spatial::zeros());
    let (p, r) = (pose.p, pose.r);
    Answer {
        pose: [
            [r.m11, r.m12, r.m13, p.x],
            [r.m21, r.m22, r.m23, p.y],
            [r.m31, r.m32, r.m33, p.z],
            [0.0, 0.0, 0.0, 1.0],
        ],
        jacobian: std::array::from_fn(|i| std::array::from_fn(|k| jacobian[(i, k)])),
        jdot_qd: jdot_qd.into(),
        mass_matrix: std::array::from_fn(|i| std::array::from_fn(|k| mass_matrix[(i, k)])),
        bias: bias.into(),
        rnea: at.rnea(&state.qdd).into(),
        fd: fd.into(),
    }
}

impl Answer {
    /// Every row of every quantity, with the quantity's name.
    fn rows(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        let pose = self.pose.iter().map(|row| ("pose", row.as_slice()));
        let jacobian = self.jacobian.iter().map(|row| ("jacobian", row.as_slice()));
        let mass_matrix = self
            .mass_matrix
            .iter()
            .map(|row| ("mass_matrix", row.as_slice()));
        let jdot_qd = std::iter::once(("jdot_qd", self.jdot_qd.as_slice()));
        let joints = [("bias", &self.bias), ("rnea", &self.rnea), ("fd", &self.fd)];
        let joints = joints.into_iter().map(|(name, row)| (name, row.as_slice()));
        pose.chain(jacobian)
            .chain(jdot_qd)
            .chain(mass_matrix)
            .chain(joints)
    }
}

fn write_text(answer: &Answer, count: u64, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "state {count}")?;
    let mut last = "";
    for (name, row) in answer.rows() {
        let label = if name == last { "" } else { name };
        last = name;
        write!(out, "  {label:<12}")?;
        for value in row {
            write!(out, " {value:>12.6}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(lines: &str) -> (Result<(), Failure>, String) {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        std::fs::write(file.path(), lines).expect("it can be written");
        let mut out = Vec::new();
        let done = run(&ArmModel::rediestro(), file.path(), true, &mut out);
        (done, String::from_utf8(out).expect("text"))
    }

    const ZERO: &str =
        r#"{"q":[0,0,0,0,0,0,0],"qd":[1,0,0,0,0,0,0],"qdd":[0,0,0,0,0,0,0],"tau":[0,0,0,0,0,0,0]}"#;

    #[test]
    fn each_line_gets_one_object_with_the_promised_shapes_and_consistent_dynamics() {
        let (done, text) = answers(&format!("{ZERO}\n{ZERO}\n"));
        assert!(done.is_ok());
        assert_eq!(text.lines().count(), 2);
        let answer: serde_json::Value =
            serde_json::from_str(text.lines().next().expect("a line")).expect("JSON");
        let shape = |key: &str| {
            (
                answer[key].as_array().map(Vec::len),
                answer[key][0].as_array().map(Vec::len),
            )
        };
        assert_eq!(shape("pose"), (Some(4), Some(4)));
        assert_eq!(shape("jacobian"), (Some(6), Some(7)));
        assert_eq!(shape("mass_matrix"), (Some(7), Some(7)));
        assert_eq!(shape("jdot_qd"), (Some(6), None));
        // q̈ = 0: torques are the bias; τ = 0: M q̈ = −bias
        assert_eq!(answer["rnea"], answer["bias"]);
        let number = |v: &serde_json::Value| v.as_f64().expect("a number");
        for i in 0..7 {
            let row: f64 = (0..7)
                .map(|k| number(&answer["mass_matrix"][i][k]) * number(&answer["fd"][k]))
                .sum();
            assert!((row + number(&answer["bias"][i])).abs() < 1e-9, "row {i}");
        }
        assert_eq!(number(&answer["pose"][3][3]), 1.0);
        assert_eq!(
            number(&answer["jacobian"][5][0]),
            1.0,
            "joint 1 turns about base z"
        );
    }

    #[test]
    fn speeds_that_overflow_are_an_error_with_the_line() {
        let (done, _) = answers(&format!(
            "{ZERO}\n{}\n",
            ZERO.replace("\"qd\":[1", "\"qd\":[1e200")
        ));
        assert!(
            done.expect_err("too fast")
                .to_string()
                .contains("line 2: the values are so large")
        );
    }
}
