//! Overrides: `key.path=value`, from the command line or from a variant. Array elements are numbered
//! from 0; elements that have a `name` may be called by it (`segment.free.mass_kg`).

use crate::error::Problem;
use toml::{Table, Value};

/// Sets `key` in the tree; tables on the way are created, array elements must exist. The key with its elements numbered.
pub fn set(root: &mut Table, key: &str, value: Value) -> Result<String, Problem> {
    if key.split('.').any(str::is_empty) {
        return Err(Problem::new(key, "expected a key path such as controller.kp"));
    }
    let (first, rest) = key.split_once('.').map_or((key, None), |(first, rest)| (first, Some(rest)));
    let Some(rest) = rest else {
        root.insert(first.to_owned(), value);
        return Ok(first.to_owned());
    };
    let mut numbered = first.to_owned();
    let mut place = root.entry(first).or_insert_with(|| Value::Table(Table::new()));
    for part in rest.split('.') {
        let kind = place.type_str();
        let (part, next) = match place {
            Value::Table(table) => {
                // a value that is about to be set is a table only where the path goes on
                (part.to_owned(), table.entry(part).or_insert_with(|| Value::Table(Table::new())))
            }
            Value::Array(array) => match index(array, part) {
                Some(i) if i < array.len() => (i.to_string(), &mut array[i]),
                _ => {
                    return Err(Problem::new(key, format!("`{numbered}` has no element `{part}`; {}", elements(array))));
                }
            },
            _ => return Err(Problem::new(key, format!("`{numbered}` is a {kind} and has no keys"))),
        };
        numbered = format!("{numbered}.{part}");
        place = next;
    }
    *place = value;
    Ok(numbered)
}

/// What an array's elements may be called.
fn elements(array: &[Value]) -> String {
    let names: Vec<&str> = array.iter().filter_map(|element| element.get("name").and_then(Value::as_str)).collect();
    match (array.len(), names.as_slice()) {
        (0, _) => "it is empty".into(),
        (n, []) => format!("its elements are numbered from 0 to {}", n - 1),
        (n, names) => format!("its elements are numbered from 0 to {} or called {}", n - 1, names.join(", ")),
    }
}

/// As [`set`]; a whole number takes the place of an integer as one.
pub fn vary(root: &mut Table, key: &str, value: Value) -> Result<String, Problem> {
    let value = match (get(root, key), value) {
        (Some(Value::Integer(_)), Value::Float(number)) if number.fract() == 0.0 => Value::Integer(number as i64),
        (_, value) => value,
    };
    set(root, key, value)
}

/// What stands at a key.
pub fn get<'a>(root: &'a Table, key: &str) -> Option<&'a Value> {
    let mut parts = key.split('.');
    let first = root.get(parts.next()?)?;
    parts.try_fold(first, |place, part| match place {
        Value::Array(array) => array.get(index(array, part)?),
        other => other.get(part),
    })
}

/// An element by number or by name.
fn index(array: &[Value], part: &str) -> Option<usize> {
    let named = || array.iter().position(|element| element.get("name").and_then(Value::as_str) == Some(part));
    part.parse().ok().or_else(named)
}

/// `key=value` of the command line; the value is read as TOML, or as text where it is none.
pub fn parse(text: &str) -> Result<(String, Value), Problem> {
    let (key, value) = text
        .split_once('=')
        .ok_or_else(|| Problem::new(text, "expected key.path=value, for example controller.kp=400"))?;
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
        let mut root: Table =
            "[controller]\nkp = 1.0\n[[segment]]\nname = 'a'\nforce_n = [0, 0, 1]".parse().expect("toml");
        for (text, path) in
            [("controller.kp=400", "kp"), ("segment.a.force_n.2=5", "force"), ("plant.rate_hz=1e4", "rate")]
        {
            let (key, value) = parse(text).expect(path);
            set(&mut root, &key, value).expect(path);
        }
        assert_eq!(set(&mut root, "segment.a.until_s", Value::Integer(3)), Ok("segment.0.until_s".into()));
        assert_eq!(root["controller"]["kp"].as_integer(), Some(400));
        assert_eq!(root["segment"][0]["force_n"][2].as_integer(), Some(5));
        assert_eq!(root["plant"]["rate_hz"].as_float(), Some(1e4));
    }

    #[test]
    fn a_value_that_is_varied_stays_an_integer() {
        let mut root: Table = "[[card]]\nname = 'a'\nperiod_ns = 5".parse().expect("toml");
        vary(&mut root, "card.a.period_ns", Value::Float(7.0)).expect("in place");
        vary(&mut root, "card.a.ratio", Value::Float(2.0)).expect("new");
        assert_eq!(
            (root["card"][0]["period_ns"].as_integer(), root["card"][0]["ratio"].as_float()),
            (Some(7), Some(2.0))
        );
    }

    #[test]
    fn a_path_into_nothing_is_refused_with_its_key() {
        let mut root: Table = "[[segment]]\nname = 'a'".parse().expect("toml");
        let problem = set(&mut root, "segment.b.until_s", Value::Integer(1)).expect_err("no such segment");
        assert_eq!(problem.message, "`segment` has no element `b`; its elements are numbered from 0 to 0 or called a");
        let problem = set(&mut root, "segment.a.name.first", Value::Integer(1)).expect_err("no table");
        assert_eq!(problem.message, "`segment.0.name` is a string and has no keys");
    }
}
