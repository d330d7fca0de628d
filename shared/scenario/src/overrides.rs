//! Overrides: `key.path=value`, from the command line or from a variant. Array elements are numbered
//! from 0; elements that have a `name` may be called by it (`segment.free.mass_kg`).

use crate::error::Problem;
use toml::{Table, Value};

/// Sets `key` in the tree; tables on the way are created, array elements must exist.
pub fn set(root: &mut Table, key: &str, value: Value) -> Result<(), Problem> {
    let parts: Vec<&str> = key.split('.').collect();
    let (last, way) = match parts.split_last() {
        Some((last, way)) if parts.iter().all(|part| !part.is_empty()) => (*last, way),
        _ => return Err(Problem::new(key, "expected a key path such as controller.kp")),
    };
    let mut first = true;
    let mut place: &mut Value = &mut Value::Boolean(false);
    for part in way {
        place = if first {
            root.entry(*part).or_insert_with(|| Value::Table(Table::new()))
        } else {
            child(place, part).ok_or_else(|| Problem::new(key, format!("there is no `{part}` on the way; array elements are numbered from 0 or called by name")))?
        };
        first = false;
    }
    if first {
        root.insert(last.to_owned(), value);
        return Ok(());
    }
    match place {
        Value::Table(table) => {
            table.insert(last.to_owned(), value);
            Ok(())
        }
        Value::Array(_) => match child(place, last) {
            Some(element) => {
                *element = value;
                Ok(())
            }
            None => Err(Problem::new(key, format!("there is no element `{last}`"))),
        },
        other => Err(Problem::new(key, format!("`{}` is a {} and has no keys", way.join("."), other.type_str()))),
    }
}

/// As [`set`]; a whole number takes the place of an integer as one.
pub fn vary(root: &mut Table, key: &str, value: Value) -> Result<(), Problem> {
    let mut place = Some(&*root).and_then(|root| root.get(key.split('.').next()?));
    for part in key.split('.').skip(1) {
        place = place.and_then(|place| match place {
            Value::Array(array) => array.get(index(array, part)?),
            other => other.get(part),
        });
    }
    let value = match (place, value) {
        (Some(Value::Integer(_)), Value::Float(number)) if number.fract() == 0.0 => Value::Integer(number as i64),
        (_, value) => value,
    };
    set(root, key, value)
}

/// An element by number or by name.
fn index(array: &[Value], part: &str) -> Option<usize> {
    let named = || array.iter().position(|element| element.get("name").and_then(Value::as_str) == Some(part));
    part.parse().ok().or_else(named)
}

fn child<'a>(value: &'a mut Value, part: &str) -> Option<&'a mut Value> {
    match value {
        Value::Table(table) => Some(table.entry(part).or_insert_with(|| Value::Table(Table::new()))),
        Value::Array(array) => {
            let index = index(array, part)?;
            array.get_mut(index)
        }
        _ => None,
    }
}

/// `key=value` of the command line; the value is read as TOML, or as text where it is none.
pub fn parse(text: &str) -> Result<(String, Value), Problem> {
    let (key, value) =
        text.split_once('=').ok_or_else(|| Problem::new(text, "expected key.path=value, for example controller.kp=400"))?;
    let parsed = format!("v = {value}").parse::<Table>().ok().and_then(|mut table| table.remove("v"));
    Ok((key.trim().to_owned(), parsed.unwrap_or_else(|| Value::String(value.to_owned()))))
}

/// Key paths (dotted) and values of a variant's `[set]`, whether written as dotted strings or nested.
pub fn flatten(table: &Table) -> Vec<(String, Value)> {
    table.iter().map(|(key, value)| (key.clone(), value.clone())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_reaches_into_tables_and_arrays_by_number_or_name() {
        let mut root: Table = "[controller]\nkp = 1.0\n[[segment]]\nname = 'a'\nforce_n = [0, 0, 1]".parse().expect("toml");
        for (text, path) in [("controller.kp=400", "kp"), ("segment.a.force_n.2=5", "force"), ("plant.rate_hz=1e4", "rate")] {
            let (key, value) = parse(text).expect(path);
            set(&mut root, &key, value).expect(path);
        }
        assert_eq!(root["controller"]["kp"].as_integer(), Some(400));
        assert_eq!(root["segment"][0]["force_n"][2].as_integer(), Some(5));
        assert_eq!(root["plant"]["rate_hz"].as_float(), Some(1e4));
    }

    #[test]
    fn a_value_that_is_varied_stays_an_integer() {
        let mut root: Table = "[[card]]\nname = 'a'\nperiod_ns = 5".parse().expect("toml");
        vary(&mut root, "card.a.period_ns", Value::Float(7.0)).expect("in place");
        vary(&mut root, "card.a.ratio", Value::Float(2.0)).expect("new");
        assert_eq!((root["card"][0]["period_ns"].as_integer(), root["card"][0]["ratio"].as_float()), (Some(7), Some(2.0)));
    }

    #[test]
    fn a_path_into_nothing_is_refused_with_its_key() {
        let mut root: Table = "[[segment]]\nname = 'a'".parse().expect("toml");
        let problem = set(&mut root, "segment.b.until_s", Value::Integer(1)).expect_err("no such segment");
        assert!(problem.message.contains("`b`"), "{problem:?}");
    }
}
