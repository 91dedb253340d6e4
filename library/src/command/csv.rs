//! Columns of numbers as text.

use std::collections::BTreeMap;

use ivx_op::{is_rounded, too_large};

use super::read::Columns;

/// Columns of equal length under their names.
pub(super) fn write(columns: &[(&str, &[f64])]) -> Vec<u8> {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        let row: Vec<String> =
            columns.iter().map(|(_, values)| format!("{:?}", values[row])).collect();
        text += &row.join(",");
        text.push('\n');
    }
    text.into_bytes()
}

/// The columns of a file whose first line has their names.
///
/// # Errors
/// What is wrong with it, with the line.
pub(super) fn read(bytes: &[u8]) -> Result<Columns, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_owned())?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // Some programs end lines by one, some by the other, most by both.
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let mut lines = text.lines();
    let header = lines.next().filter(|line| !line.trim().is_empty());
    let header = header.ok_or("its first line has no names of columns")?;
    let names = fields(header).map_err(|why| format!("line 1 {why}"))?;
    if let [one] = &names[..]
        && let Some(delimiter) = [';', '\t', '|'].into_iter().find(|c| one.contains(*c))
    {
        let name = if delimiter == '\t' { "tabs".to_owned() } else { format!("`{delimiter}`") };
        return Err(format!(
            "its columns are separated by {name}: write `,` between them, and `.` in numbers"
        ));
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for (number, line) in (2..).zip(lines) {
        let values = fields(line).map_err(|why| format!("line {number} {why}"))?;
        if values.len() != names.len() {
            let (n, columns) = (values.len(), names.len());
            let why = format!("line {number} has {n} values for {columns} columns");
            return Err(if line.trim().is_empty() { format!("{why}: it is empty") } else { why });
        }
        for ((column, value), name) in columns.iter_mut().zip(values).zip(&names) {
            let value = exact(&value);
            column.push(value.map_err(|why| format!("line {number}, column `{name}`: {why}"))?);
        }
    }
    let n = columns.first().map_or(0, Vec::len);
    let mut read = BTreeMap::new();
    for (name, column) in names.into_iter().zip(columns) {
        if read.insert(name.clone(), (vec![n], column)).is_some() {
            return Err(format!("two columns are called `{name}`"));
        }
    }
    Ok(read)
}

/// The number that a text is; a whole one that would be rounded is none.
fn exact(text: &str) -> Result<f64, String> {
    let value = text.parse().map_err(|_| no_number(text))?;
    if is_rounded(text) { Err(format!("it {}", too_large(text))) } else { Ok(value) }
}

fn no_number(text: &str) -> String {
    let (folded, point) = (text.to_ascii_lowercase(), text.replacen(',', ".", 1));
    match &*folded {
        "" => "there is none: leave such rows out".to_owned(),
        "na" | "n/a" | "null" | "none" | "-" | "." | "?" | "missing" => {
            format!("`{text}` is no number: leave such rows out")
        }
        "true" | "false" => format!("`{text}` is no number: write 1 for true and 0 for false"),
        _ if point.parse::<f64>().is_ok() => {
            let whole = text.replace(',', "");
            match text.rsplit_once(',') {
                Some((_, rest)) if rest.len() == 3 => {
                    format!("`{text}` is no number: write `{whole}` or `{point}`, whichever it is")
                }
                _ => format!("`{text}` is no number: write `{point}`, with a point"),
            }
        }
        _ => format!("`{}` is no number", text.chars().take(40).collect::<String>()),
    }
}

/// The fields of a line, without blanks and quotes around them (RFC 4180).
fn fields(line: &str) -> Result<Vec<String>, String> {
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        rest = rest.trim_start_matches([' ', '\t']);
        let field = match rest.strip_prefix('"') {
            None => {
                let end = rest.find(',').unwrap_or(rest.len());
                let field = rest[..end].trim().to_owned();
                rest = &rest[end..];
                field
            }
            Some(mut inside) => {
                let mut field = String::new();
                loop {
                    let end = inside.find('"').ok_or("has a quote that does not end")?;
                    field.push_str(&inside[..end]);
                    inside = &inside[end + 1..];
                    let Some(more) = inside.strip_prefix('"') else { break };
                    field.push('"');
                    inside = more;
                }
                rest = inside.trim_start();
                field.trim().to_owned()
            }
        };
        fields.push(field);
        match rest.strip_prefix(',') {
            Some(after) => rest = after,
            None if rest.is_empty() => return Ok(fields),
            None => return Err(format!("has `{rest}` behind a quote that ended")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let (x, y) = ([0.1, -0.0, 1e300], [f64::MIN_POSITIVE, f64::INFINITY, 1.0 / 3.0]);
        let read = read(&write(&[("x", &x), ("y", &y)])).unwrap();
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read["x"].1), bits(&x));
        assert_eq!(bits(&read["y"].1), bits(&y));
    }

    #[test]
    fn every_number_comes_back() {
        let numbers = super::super::npz::tests::random_numbers(20_000);
        let read = read(&write(&[("x", &numbers)])).unwrap();
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
        assert!(numbers.iter().zip(&read["x"].1).all(same));
    }

    #[test]
    fn other_writers_are_understood() {
        let expected = Columns::from([("a b".to_owned(), (vec![2], vec![1.0, 2.5]))]);
        assert_eq!(read(b"\xef\xbb\xbf\"a b\"\r\n1\r\n 2.5 \r\n"), Ok(expected.clone()));
        assert_eq!(read(b" a b \n \"1\" \n\"2.5\""), Ok(expected));
        assert!(read(b"\"a \"\"b\"\", c\",y\n1,2\n").unwrap().contains_key("a \"b\", c"));
    }

    #[test]
    fn what_is_wrong_is_told() {
        let check = |text: &str, expected: &str| {
            let why = read(text.as_bytes()).unwrap_err();
            assert!(why.contains(expected), "{why}");
        };
        check("", "no names of columns");
        check("x,y\n1\n", "line 2 has 1 values for 2 columns");
        check("x,y\n1,2\n1,two\n", "line 3, column `y`: `two` is no number");
        check("x,y\n1,NA\n", "line 2, column `y`: `NA` is no number: leave such rows out");
        check("x,y\n,1\n", "line 2, column `x`: there is none: leave such rows out");
        check(
            "x,y\n\"1,5\",2\n",
            "line 2, column `x`: `1,5` is no number: write `1.5`, with a point",
        );
        check(
            "x,y\n\"1,000\",2\n",
            "`1,000` is no number: write `1000` or `1.000`, whichever it is",
        );
        check("x\r1\ra", "line 3, column `x`: `a` is no number");
        check("x,y\nTrue,2\n", "column `x`: `True` is no number: write 1 for true");
        check("x;y\n1;2\n", "its columns are separated by `;`: write `,` between them");
        check("x\ty\n1\t2\n", "separated by tabs");
        check("x,y\n\"1,2\n", "line 2 has a quote that does not end");
        check("x,y\n\"1\"2,2\n", "line 2 has `2,2` behind a quote that ended");
        check("x,y\n1,2\n\n", "line 3 has 1 values for 2 columns: it is empty");
        check(
            "x\n9007199254740992\n-9007199254740993\n",
            "line 3, column `x`: it holds -9007199254740993, which is too large",
        );
        check("x\n100000000000000000000000\n", "too large to be exact");
        check("x,x\n1,2\n", "two columns are called `x`");
        assert!(read(b"x\n\xff\n").unwrap_err().contains("UTF-8"));
    }
}
