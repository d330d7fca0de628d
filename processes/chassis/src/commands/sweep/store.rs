//! The folder of a sweep: its plan, the points that are done, the table.
//!
//! Each part appends to a file of its own, one line per point. A line that a kill has cut short is no point. A folder that
//! holds another sweep is refused.

use super::Shard;
use super::plan::Plan;
use miette::{IntoDiagnostic, WrapErr, miette};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// One point that has been run.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Number of the point.
    pub index: usize,
    /// `completed`, or what went wrong.
    pub ended: String,
    /// One figure per column.
    pub values: Vec<Option<f64>>,
}

impl Row {
    /// A run that could not be measured.
    pub fn broken(index: usize, plan: &Plan, reason: &str) -> Row {
        Row { index, ended: reason.to_owned(), values: vec![None; plan.columns().len()] }
    }

    /// Fields: point, figures, end of the run, and a mark by which a whole line is known.
    fn line(&self) -> String {
        let figures: String = self.values.iter().map(|value| format!("{},", figure(*value))).collect();
        format!("{},{figures}{},.\n", self.index, plain(&self.ended))
    }

    fn parse(line: &str, columns: usize) -> Option<Row> {
        let fields: Vec<&str> = line.split(',').collect();
        if fields.len() != columns + 3 || fields[columns + 2] != "." {
            return None;
        }
        let value = |field: &&str| if field.is_empty() { Some(None) } else { field.parse().ok().map(Some) };
        Some(Row {
            index: fields[0].parse().ok()?,
            ended: fields[columns + 1].to_owned(),
            values: fields[1..=columns].iter().map(value).collect::<Option<_>>()?,
        })
    }
}

/// The shortest text that is read as the same number.
fn figure(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// Text without what has a meaning in a line.
fn plain(text: &str) -> String {
    text.replace([',', '\n', '\r', '"'], " ")
}

/// The folder.
pub struct Store {
    folder: PathBuf,
    part: PathBuf,
    columns: usize,
    points: usize,
}

impl Store {
    /// Opens the folder, or makes it, for this sweep.
    pub fn open(folder: &Path, plan: &Plan, shard: Shard) -> miette::Result<Store> {
        let failed = |what: &str| format!("cannot {what} the folder {}", folder.display());
        fs::create_dir_all(folder).into_diagnostic().wrap_err_with(|| failed("make"))?;
        let path = folder.join("sweep.json");
        let wanted = serde_json::to_string_pretty(plan).into_diagnostic()?;
        match fs::read_to_string(&path) {
            Ok(found) if found == wanted => {}
            Ok(_) => return Err(miette!("{} holds another sweep; take another folder", folder.display())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                fs::write(&path, wanted).into_diagnostic().wrap_err_with(|| failed("write into"))?;
            }
            Err(error) => return Err(error).into_diagnostic().wrap_err_with(|| failed("read")),
        }
        let part = folder.join(format!("part-{}-of-{}.csv", shard.part, shard.of));
        Ok(Store { folder: folder.to_owned(), part, columns: plan.columns().len(), points: plan.points().len() })
    }

    /// The file of this part, to append to.
    pub fn append(&self) -> miette::Result<File> {
        let opened = OpenOptions::new().create(true).append(true).open(&self.part).and_then(|mut file| {
            // ends a line that a kill has cut short
            file.write_all(b"\n").map(|()| file)
        });
        opened.into_diagnostic().wrap_err_with(|| format!("cannot write {}", self.part.display()))
    }

    /// Writes a point down.
    pub fn push(&self, part: &mut File, row: &Row) -> miette::Result<()> {
        part.write_all(row.line().as_bytes()).into_diagnostic().wrap_err_with(|| format!("cannot write {}", self.part.display()))
    }

    /// The points of every part, in their order.
    pub fn rows(&self) -> miette::Result<Vec<Row>> {
        let unreadable = || format!("cannot read {}", self.folder.display());
        let mut rows = Vec::new();
        for entry in fs::read_dir(&self.folder).into_diagnostic().wrap_err_with(unreadable)? {
            let path = entry.into_diagnostic()?.path();
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            if name.starts_with("part-") && name.ends_with(".csv") {
                let text = fs::read_to_string(&path).into_diagnostic().wrap_err_with(unreadable)?;
                rows.extend(text.lines().filter_map(|line| Row::parse(line, self.columns)).filter(|row| row.index < self.points));
            }
        }
        rows.sort_by_key(|row| row.index);
        rows.dedup_by_key(|row| row.index);
        Ok(rows)
    }
}

/// The table of a complete sweep as CSV.
pub fn table(plan: &Plan, rows: &[Row]) -> String {
    let keys = plan.vary().iter().map(|vary| vary.key.as_str());
    let mut text: Vec<String> = vec![keys.chain(["variant", "ended"]).chain(plan.columns()).map(plain).collect::<Vec<_>>().join(",")];
    let points = plan.points();
    for row in rows {
        let point = &points[row.index];
        let mut fields: Vec<String> = point.values.iter().map(|value| figure(Some(*value))).collect();
        fields.extend([point.variant.clone(), plain(&row.ended)]);
        fields.extend(row.values.iter().map(|value| figure(*value)));
        text.push(fields.join(","));
    }
    text.join("\n") + "\n"
}
