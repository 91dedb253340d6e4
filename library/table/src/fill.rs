//! What becomes of gaps in a table.

use crate::classes::Classes;
use crate::missing::{Gaps, is_no_text};
use crate::table::{Column, Table, Values};

/// Makes empty what programs write where there is no text, unless it is the name of a class.
pub(crate) fn blank(table: &mut Table, classes: &Classes) {
    let is_class = |text: &String| match classes {
        Classes::Listed(labels) => labels.contains(text),
        _ => false,
    };
    for column in &mut table.columns {
        if let Values::Texts(texts, _) = &mut column.values {
            let gaps = texts.iter_mut().filter(|text| is_no_text(text) && !is_class(text));
            gaps.for_each(String::clear);
        }
    }
}

/// Does with gaps what is asked for.
///
/// - `targets`: the places of targets.
pub(crate) fn fill(table: &mut Table, targets: &[usize], gaps: Gaps) -> Result<(), String> {
    if gaps == Gaps::Dropped {
        drop_rows(table);
        return Ok(());
    }
    for (i, column) in table.columns.iter_mut().enumerate() {
        let width = column.item.iter().product::<usize>().max(1);
        let leave = "leave such rows out, or say what is done with them by `missing:`";
        match &mut column.values {
            Values::Texts(texts, at) => {
                let gap = at.iter().position(|place| texts[*place as usize].is_empty());
                if let Some(row) = gap {
                    let (row, name) = (row + 1, &column.name);
                    return Err(format!(
                        "observation {row} has no text in `{name}`: `missing: dropped()` leaves such rows out"
                    ));
                }
            }
            Values::Numbers(numbers) if all_finite(numbers) => {}
            Values::Numbers(numbers) => {
                let Some(gap) = numbers.iter().position(|x| x.is_nan()) else { continue };
                let (row, name) = (gap / width + 1, &column.name);
                match gaps {
                    Gaps::Filled(_) | Gaps::Means if targets.contains(&i) => {
                        return Err(format!(
                            "observation {row} has no number in `{name}`, which is a target: `missing: dropped()` leaves such rows out"
                        ));
                    }
                    Gaps::Filled(with) => {
                        numbers.iter_mut().filter(|x| x.is_nan()).for_each(|x| *x = with);
                    }
                    Gaps::Means => means(numbers, width)
                        .map_err(|()| format!("`{name}` has no number to take the mean of"))?,
                    Gaps::Refused | Gaps::Dropped => {
                        return Err(format!(
                            "observation {row} has NaN in `{name}`, which is no number: {leave}"
                        ));
                    }
                }
            }
        }
    }
    Ok(())
}

/// Whether all numbers are finite: without a branch each, since of many rows almost all are.
fn all_finite(numbers: &[f64]) -> bool {
    numbers.iter().fold(true, |all, x| all & x.is_finite())
}

/// Puts the mean of its place in the row in the place of each gap.
fn means(numbers: &mut [f64], width: usize) -> Result<(), ()> {
    for i in 0..width {
        let own = || numbers.iter().skip(i).step_by(width).filter(|x| !x.is_nan());
        #[expect(clippy::cast_precision_loss, reason = "rows are far below 2^53")]
        let n = own().count() as f64;
        let mean = own().sum::<f64>() / n;
        if mean.is_nan() {
            return Err(());
        }
        let own = numbers.iter_mut().skip(i).step_by(width);
        own.filter(|x| x.is_nan()).for_each(|x| *x = mean);
    }
    Ok(())
}

/// Leaves out the rows in which something is missing.
fn drop_rows(table: &mut Table) {
    let n = table.columns.first().and_then(|column| column.len).unwrap_or_default();
    let mut kept = vec![true; n];
    for column in &table.columns {
        let width = column.item.iter().product::<usize>().max(1);
        match &column.values {
            Values::Numbers(numbers) => {
                for (kept, row) in kept.iter_mut().zip(numbers.chunks(width)) {
                    *kept &= !row.iter().any(|x| x.is_nan());
                }
            }
            Values::Texts(texts, at) => {
                for (kept, place) in kept.iter_mut().zip(at) {
                    *kept &= !texts[*place as usize].is_empty();
                }
            }
        }
    }
    if kept.iter().all(|kept| *kept) {
        return;
    }
    let n = kept.iter().filter(|kept| **kept).count();
    for column in &mut table.columns {
        let width = column.item.iter().product::<usize>().max(1);
        column.len = Some(n);
        match &mut column.values {
            Values::Numbers(numbers) => {
                let rows = numbers.chunks(width).zip(&kept).filter(|(_, kept)| **kept);
                *numbers = rows.flat_map(|(row, _)| row.iter().copied()).collect();
            }
            Values::Texts(texts, at) => {
                let rows = at.iter().zip(&kept).filter(|(_, kept)| **kept);
                *at = rows.map(|(place, _)| *place).collect();
                forget(texts, at);
            }
        }
    }
}

/// Leaves out texts that no row has.
fn forget(texts: &mut Vec<String>, at: &mut [u32]) {
    let mut place = vec![None; texts.len()];
    let mut kept = Vec::new();
    for at in at {
        let own = *at as usize;
        *at = *place[own].get_or_insert_with(|| {
            kept.push(texts[own].clone());
            u32::try_from(kept.len() - 1).expect("there are fewer than before")
        });
    }
    *texts = kept;
}

/// Whether all numbers are finite.
pub(crate) fn finite(table: &Table) -> Result<(), String> {
    for Column { name, item, values, .. } in &table.columns {
        let Values::Numbers(numbers) = values else { continue };
        if all_finite(numbers) {
            continue;
        }
        if let Some(i) = numbers.iter().position(|x| !x.is_finite()) {
            let row = 1 + i / item.iter().product::<usize>().max(1);
            let x = numbers[i];
            return Err(format!(
                "observation {row} has {x} in `{name}`: a data set has finite numbers"
            ));
        }
    }
    Ok(())
}
