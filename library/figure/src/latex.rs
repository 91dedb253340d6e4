//! Tables for papers: LaTeX with the rules of `booktabs`.

use ivx_op::Dim;
use ivx_op::escape::{latex as escaped, latex_number};

use super::columns::{Column, is_best, row_labels};
use super::table::shown;

/// A `tabular` of the same cells as the Markdown table; the best of each column in bold.
pub(super) fn latex(rows: &[Dim], columns: &[Column], digits: usize) -> String {
    let kinds = "l".repeat(rows.len()) + &"r".repeat(columns.len());
    let heads = rows.iter().map(|dim| dim.name.as_str());
    let heads = heads.chain(columns.iter().map(|column| column.head.as_str())).map(escaped);
    let mut lines = vec![
        format!("\\begin{{tabular}}{{{kinds}}}"),
        "\\toprule".to_owned(),
        line(heads),
        "\\midrule".to_owned(),
    ];
    for (i, labels) in row_labels(rows).iter().enumerate() {
        let cells = columns.iter().map(|column| {
            let text = latex_number(&shown(column.cells[i], digits));
            if is_best(column, i) { format!("\\textbf{{{text}}}") } else { text }
        });
        lines.push(line(labels.iter().map(|label| escaped(label)).chain(cells)));
    }
    lines.extend(["\\bottomrule", "\\end{tabular}", ""].map(str::to_owned));
    lines.join("\n")
}

fn line(cells: impl Iterator<Item = String>) -> String {
    cells.collect::<Vec<_>>().join(" & ") + " \\\\"
}

#[cfg(test)]
mod tests {
    use ivx_op::Labels;

    use super::super::columns::Best;
    use super::super::interval::Estimate;
    use super::*;

    #[test]
    fn a_paper_can_take_it_as_it_is() {
        let rows = [Dim::new("ke_%", Labels::Names(vec!["a & b".into(), "x^2\\".into()]))];
        let cell = |mean: f64, half: Option<f64>| {
            let interval = half.map(|h| (mean - h, mean + h));
            Some(Estimate { mean, interval, ..Estimate::default() })
        };
        let columns = [
            Column {
                head: "gap − 1 < 1".into(),
                place: String::new(),
                over_seed: true,
                best: Best::Lowest,
                cells: vec![cell(1.5, Some(0.25)), cell(0.5, Some(0.5))],
            },
            Column {
                head: "n".into(),
                place: String::new(),
                over_seed: false,
                best: Best::None,
                cells: vec![cell(3.0, None), None],
            },
        ];
        let expected = "\\begin{tabular}{lrr}\n\\toprule\nke\\_\\% & gap $-$ 1 \\textless{} 1 & n \\\\\n\
                        \\midrule\na \\& b & 1.50 [1.25, 1.75] & 3.00 \\\\\n\
                        x\\textasciicircum{}2\\textbackslash{} & \\textbf{0.50 [0.00, 1.00]} &  \\\\\n\
                        \\bottomrule\n\\end{tabular}\n";
        assert_eq!(latex(&rows, &columns, 2), expected);
    }
}
