//! Small multiples: one panel for each label of the axes that a figure is faceted by.

use ivx_op::{Dim, Labels};

use super::arrange::texts;

/// The names of panels and how many stand side by side: the labels of the last of several axes; for
/// one axis or none, as many as look well.
pub(super) fn panels(dims: &[Dim]) -> (Vec<String>, usize) {
    let columns = if let [_, .., last] = dims { last.len() } else { 0 };
    (spelled(dims), columns)
}

/// One text a coordinate of the product of dimensions, last fastest, where numbers say what they are of; one empty
/// text for none.
pub(super) fn spelled(dims: &[Dim]) -> Vec<String> {
    texts(dims, |dim, i| match dim.labels {
        Labels::Numbers(_) => format!("{} = {}", dim.name, dim.labels.text(i)),
        Labels::Names(_) => dim.labels.text(i),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_say_what_they_are_of() {
        let kind = Dim::new("kind", Labels::Names(vec!["IVE".into(), "EVE".into()]));
        let n = Dim::new("n", Labels::Numbers(vec![1.0, 5.0, 20.0]));
        let (names, columns) = panels(&[kind.clone(), n]);
        assert_eq!(names[..4], ["IVE, n = 1", "IVE, n = 5", "IVE, n = 20", "EVE, n = 1"]);
        assert_eq!(columns, 3);
        assert_eq!(panels(&[kind]), (vec!["IVE".into(), "EVE".into()], 0));
        assert_eq!(panels(&[]), (vec![String::new()], 0));
    }
}
