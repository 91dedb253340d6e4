//! Measures as a table.

use ivx_op::escape::{csv as quoted, markdown_cell as escaped};
use ivx_op::{
    Array, AxisNames, Ctx, Dim, Everything, Facts, Many, Op, OpError, Table, Wrong, declare,
    is_missing, shown_to_decimals,
};

use super::arrange::{Arranged, arrange};
use super::columns::{
    Best, Column, columns, columns_beside, difference, is_best, name_each, row_labels, same_rows,
    tell_apart,
};
use super::interval::Estimate;
use super::latex::latex;

declare! {
    /// Measures as Markdown, CSV and LaTeX (with `booktabs`), one row for each label of `rows`.
    ///
    /// There is a column for each value and each label of what it varies over but `rows`. Over
    /// `seed`, Markdown and LaTeX show the mean [low, high], the ends of its 95 % interval (the one of claims); CSV has the same
    /// in full precision. A column is called by its value's name and labels; values without a name
    /// are `value 1`, `value 2`, and of columns that would be called alike the second has ` (2)` behind.
    ///
    /// The LaTeX is UTF-8, the default of LaTeX, and needs `booktabs` alone: Greek letters and signs of mathematics
    /// are set in math, other letters that pdfLaTeX's font lacks need `XeLaTeX` or `LuaLaTeX`.
    pub struct Tabulate = "table" @ 10 -> Table {
        /// What to show.
        values: Many<Everything<Array>>;
        /// Axes that have a row for each label.
        rows: AxisNames;
        /// Axes that have a column for each label, innermost; others come before them.
        columns: AxisNames = Vec::<&str>::new();
        /// A value to show in columns behind, such as published numbers: those that have the labels
        /// of a row. It need not have every label.
        beside: Option<Everything<Array>>;
        /// Whether each of those columns is followed by how much higher ours is, where one of ours is of the
        /// same labels.
        difference: bool = false;
        /// Digits after the point, in Markdown and LaTeX.
        digits: u64 = 3, in 0.0..=17.0;
        /// Which number of each column of `values` is the best and in bold there: `highest`, `lowest` or
        /// `none`.
        best: String = "none";
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
    rule known_best;
}

impl Op for Tabulate {
    fn run(&self, _: &Ctx) -> Result<Table, OpError> {
        let arranged = |value| arrange(value, (&self.rows.0, &self.columns.0), self.skip_missing);
        let mut values: Vec<Arranged> =
            self.values.0.iter().map(arranged).collect::<Result<_, _>>()?;
        let beside = self
            .beside
            .as_ref()
            .map(|value| arrange(value, (&self.rows.0, &[]), self.skip_missing));
        let mut beside: Option<Arranged> = beside.transpose()?;
        let best = Best::named(&self.best).map_err(OpError::Failed)?;
        name_each(values.iter_mut().chain(&mut beside));
        let rows = same_rows(&values)?;
        let mut columns = columns(&values, best);
        let n_ours = columns.len();
        if let Some(beside) = beside {
            for column in columns_beside(beside, rows) {
                let difference =
                    if self.difference { difference(&columns[..n_ours], &column) } else { None };
                columns.push(column);
                columns.extend(difference);
            }
        }
        tell_apart(&mut columns, rows);
        let digits = usize::try_from(self.digits).unwrap_or(usize::MAX).min(17);
        let files = [
            ("csv".to_owned(), csv(rows, &columns)),
            ("md".to_owned(), markdown(rows, &columns, digits)),
            ("tex".to_owned(), latex(rows, &columns, digits)),
        ];
        Ok(Table { files: files.into() })
    }
}

fn known_best(facts: &Facts<'_>) -> Result<(), Wrong> {
    let named = facts.arg::<String>("best").map_or(Ok(Best::None), |best| Best::named(&best));
    let help = || "say `best: \"highest\"`, `\"lowest\"` or `\"none\"`".to_owned();
    named.map(drop).map_err(|message| Wrong { arg: "best", message, help: help() })
}

fn csv(rows: &[Dim], columns: &[Column]) -> String {
    let mut head: Vec<String> = rows.iter().map(|dim| quoted(&dim.name)).collect();
    head.extend(columns.iter().flat_map(Column::fields).map(|field| quoted(&field)));
    let mut lines = vec![head.join(",")];
    for (i, labels) in row_labels(rows).iter().enumerate() {
        let mut line: Vec<String> = labels.iter().map(|label| quoted(label)).collect();
        for column in columns {
            let cell = column.cells[i];
            let there = cell.filter(|cell| !is_missing(cell.mean));
            line.push(there.map_or_else(String::new, |cell| exact(cell.mean)));
            if column.over_seed {
                let interval = cell.and_then(|cell| cell.interval);
                line.extend(
                    interval.map_or_else(Default::default, |(low, high)| [exact(low), exact(high)]),
                );
            }
            if column.lacks() {
                line.push(cell.map_or(0, |cell| cell.lacks.missing).to_string());
            }
        }
        lines.push(line.join(","));
    }
    lines.join("\n") + "\n"
}

/// The shortest text that reads back as the same number.
fn exact(x: f64) -> String {
    format!("{:?}", x + 0.0)
}

fn markdown(rows: &[Dim], columns: &[Column], digits: usize) -> String {
    let heads = rows.iter().map(|dim| dim.name.as_str());
    let mut lines: Vec<Vec<String>> =
        vec![heads.chain(columns.iter().map(|column| column.head.as_str())).map(escaped).collect()];
    for (i, labels) in row_labels(rows).iter().enumerate() {
        let labels = labels.iter().map(|label| escaped(label));
        lines.push(
            labels
                .chain(columns.iter().map(|column| {
                    let text = shown(column.cells[i], digits);
                    if is_best(column, i) { format!("**{text}**") } else { text }
                }))
                .collect(),
        );
    }
    let n_columns = rows.len() + columns.len();
    let width =
        |c: usize| lines.iter().map(|line| line[c].chars().count()).max().unwrap_or(0).max(3);
    let widths: Vec<usize> = (0..n_columns).map(width).collect();

    let rule = widths.iter().enumerate().map(|(c, width)| {
        if c < rows.len() { "-".repeat(*width) } else { format!("{}:", "-".repeat(width - 1)) }
    });
    let rule: Vec<String> = rule.collect();
    let mut out = String::new();
    for line in lines[..1].iter().chain([&rule]).chain(&lines[1..]) {
        for (c, (cell, width)) in line.iter().zip(&widths).enumerate() {
            let pad = " ".repeat(width - cell.chars().count());
            let (before, after) =
                if c < rows.len() { ("", pad.as_str()) } else { (pad.as_str(), "") };
            out.extend(["| ", before, cell, after, " "]);
        }
        out.push_str("|\n");
    }
    out
}

pub(super) fn shown(cell: Option<Estimate>, digits: usize) -> String {
    let Some(Estimate { mean, interval, lacks }) = cell else { return String::new() };
    let mean_text = match lacks.missing {
        n if is_missing(mean) && lacks.of > 1 => return format!("missing ({n} of {})", lacks.of),
        _ if is_missing(mean) => return "missing".to_owned(),
        _ => shown_to_decimals(digits, mean),
    };
    let of_rest = match lacks.missing {
        0 => String::new(),
        n => format!(" ({} of {})", lacks.of - n, lacks.of),
    };
    let text = match interval {
        Some((low, high)) => {
            // As many more digits as tell the ends from each other.
            let ends = |digits| [low, high].map(|end| shown_to_decimals(digits, end));
            let told = (digits..=17).map(ends).find(|[a, b]| a != b || low == high);
            let [from, to] = told.unwrap_or_else(|| ends(17));
            let from = if low.is_finite() { format!("[{from}") } else { "(-∞".to_owned() };
            let to = if high.is_finite() { format!("{to}]") } else { "∞)".to_owned() };
            format!("{mean_text} {from}, {to}")
        }
        None => mean_text,
    };
    text + &of_rest
}

#[cfg(test)]
mod tests {
    use ivx_op::MISSING;

    use super::super::arrange::tests::{axes, value};
    use super::*;

    fn table(values: Vec<(&str, Everything<Array>)>, columns: &[&str]) -> Result<Table, OpError> {
        table_beside(values, columns, None)
    }

    fn table_beside(
        values: Vec<(&str, Everything<Array>)>,
        columns: &[&str],
        beside: Option<(&str, Everything<Array>)>,
    ) -> Result<Table, OpError> {
        let named = |(name, mut value): (&str, Everything<Array>)| {
            value.0.name = name.to_owned();
            value
        };
        let values = Many(values.into_iter().map(named).collect());
        let beside = beside.map(named);
        let (rows, columns) = (axes(&["ke"]), axes(columns));
        let (best, skip_missing) = ("none".to_owned(), false);
        let table = Tabulate {
            values,
            rows,
            columns,
            beside,
            difference: false,
            digits: 2,
            best,
            skip_missing,
        };
        table.run(&Ctx::new("table", 0, None))
    }

    fn check(found: &Table, md: &str, csv: &str) {
        assert_eq!(found.files["md"], md);
        assert_eq!(found.files["csv"], csv);
    }

    #[test]
    fn seeds_become_a_mean_and_an_interval() {
        // WCM: 2 ± 2.484138 as in `interval`; MA: no spread.
        let seeds: (&str, &[&str]) = ("seed", &["0", "1", "2"]);
        let gap = value(&[("ke", &["WCM", "MA|x"]), seeds], &[1.0, 2.0, 3.0, 0.5, 0.5, 0.5]);
        let n = value(&[("ke", &["WCM", "MA|x"])], &[7.0, -0.001]);
        let found = table(vec![("gap", gap), ("n", n)], &[]).unwrap();
        let csv = found.files["csv"].clone();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines[0], "ke,gap mean,gap low,gap high,n");
        assert!(lines[1].starts_with("WCM,2.0,-0.48413") && lines[1].ends_with(",7.0"), "{csv}");
        assert_eq!(lines[2], "MA|x,0.5,0.5,0.5,-0.001");
        let md = "\
| ke    |                gap |        n |
| ----- | -----------------: | -------: |
| WCM   | 2.00 [-0.48, 4.48] |     7.00 |
| MA\\|x |  0.50 [0.50, 0.50] | -1.00e-3 |
";
        check(&found, md, &csv);
    }

    #[test]
    fn what_is_missing_is_counted_and_left_out_where_that_is_said() {
        let seeds: (&str, &[&str]) = ("seed", &["0", "1", "2"]);
        let values = [1.0, MISSING, 2.0, MISSING, MISSING, MISSING, 4.0, 4.0, 4.0];
        let lines = |skip_missing| {
            let gap = value(&[("ke", &["WCM", "MA", "BCM"]), seeds], &values);
            let (rows, columns, best) = (axes(&["ke"]), axes(&[]), "lowest".to_owned());
            let (values, beside, difference) = (Many(vec![gap]), None, false);
            let table = Tabulate {
                values,
                rows,
                columns,
                beside,
                difference,
                digits: 1,
                best,
                skip_missing,
            };
            let files = table.run(&Ctx::new("table", 0, None)).unwrap().files;
            let cells = |text: &str| -> Vec<String> { text.lines().map(str::to_owned).collect() };
            (cells(&files["md"])[2..].join("\n").replace("  ", ""), cells(&files["csv"]))
        };
        let (md, csv) = lines(false);
        assert!(md.contains("missing (1 of 3) |") && md.contains("missing (3 of 3) |"), "{md}");
        assert!(md.contains("**4.0 [4.0, 4.0]** |"), "{md}");
        assert_eq!(csv[0], "ke,y mean,y low,y high,y missing");
        assert_eq!(csv[1..], ["WCM,,,,1", "MA,,,,3", "BCM,4.0,4.0,4.0,0"]);
        let (md, csv) = lines(true);
        assert!(md.contains("**1.5 [-4.9, 7.9] (2 of 3)** |"), "{md}");
        assert!(md.contains("missing (3 of 3) |"), "{md}");
        assert!(csv[1].starts_with("WCM,1.5,") && csv[1].ends_with(",1"), "{csv:?}");
    }

    #[test]
    fn an_axis_becomes_columns() {
        let gap = value(
            &[("task", &["a,b", "c\"d"]), ("ke", &["WCM", "MA"])],
            &[1.0, 2.0, 3.0, f64::NAN],
        );
        let md = "\
| ke  | gap, task = a,b | gap, task = c\"d |
| --- | --------------: | --------------: |
| WCM |            1.00 |            3.00 |
| MA  |            2.00 |             NaN |
";
        let csv = "ke,\"gap, task = a,b\",\"gap, task = c\"\"d\"\nWCM,1.0,3.0\nMA,2.0,NaN\n";
        check(&table(vec![("gap", gap)], &["task"]).unwrap(), md, csv);
    }

    #[test]
    fn published_numbers_stand_beside_by_their_labels() {
        let ours = value(&[("task", &["a"]), ("ke", &["WCM", "MA", "new"])], &[1.0, 2.0, 3.0]);
        let dims: [(&str, &[&str]); 2] = [("ke", &["MA", "CVaR", "WCM"]), ("task", &["a", "b"])];
        let theirs = value(&dims, &[21.0, 22.0, 9.0, 9.0, f64::NAN, 12.0]);
        let md = "\
| ke  | gap, task = a | paper, task = a | paper, task = b |
| --- | ------------: | --------------: | --------------: |
| WCM |          1.00 |                 |           12.00 |
| MA  |          2.00 |           21.00 |           22.00 |
| new |          3.00 |                 |                 |
";
        let csv = "ke,\"gap, task = a\",\"paper, task = a\",\"paper, task = b\"\nWCM,1.0,,12.0\nMA,2.0,21.0,22.0\nnew,3.0,,\n";
        check(&table_beside(vec![("gap", ours)], &[], Some(("paper", theirs))).unwrap(), md, csv);
    }

    #[test]
    fn values_without_a_name_have_a_column_each() {
        let one = value(&[("ke", &["WCM"])], &[1.0]);
        let two = value(&[("ke", &["WCM"])], &[2.0]);
        let three = value(&[("ke", &["WCM"])], &[3.0]);
        let csv = |values| table(values, &[]).unwrap().files["csv"].clone();
        assert_eq!(csv(vec![("", one.clone())]), "ke,value\nWCM,1.0\n");
        let found = csv(vec![("", one), ("gap", two.clone()), ("", three.clone())]);
        assert_eq!(found, "ke,value 1,gap,value 2\nWCM,1.0,2.0,3.0\n");
        assert_eq!(csv(vec![("gap", two), ("gap", three)]), "ke,gap,gap (2)\nWCM,2.0,3.0\n");
    }

    #[test]
    fn one_seed_has_no_interval() {
        let gap = value(&[("ke", &["WCM"]), ("seed", &["0"])], &[1.0]);
        let md = "\
| ke  |  gap |
| --- | ---: |
| WCM | 1.00 |
";
        check(
            &table(vec![("gap", gap)], &[]).unwrap(),
            md,
            "ke,gap mean,gap low,gap high\nWCM,1.0,,\n",
        );
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        let check = |values, expected: &str| {
            assert_eq!(table(values, &[]).unwrap_err().to_string(), expected);
        };
        let ke = value(&[("ke", &["WCM"])], &[1.0]);
        let other = value(&[("ke", &["MA"])], &[1.0]);
        check(vec![("a", ke), ("b", other)], "`a` and `b` differ in the labels of `ke`");
        check(vec![], "a table needs a value");
    }

    #[test]
    fn small_intervals_are_seen() {
        let text = |mean: f64, half: f64| {
            shown(
                Some(Estimate {
                    mean,
                    interval: Some((mean - half, mean + half)),
                    ..Estimate::default()
                }),
                2,
            )
        };
        assert_eq!(text(0.67, 0.0), "0.67 [0.67, 0.67]");
        assert_eq!(text(0.67, 1e-4), "0.67 [0.6699, 0.6701]");
        assert_eq!(text(0.67, f64::INFINITY), "0.67 (-∞, ∞)");
    }
}
