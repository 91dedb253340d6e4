//! What others did, for somebody to learn from.

use ivx_data::form::{failed, wrong};
use ivx_data::{
    Dataset, Demonstrations, Form, Rollouts, Trajectories, Values, same_world, shown_by,
};
use ivx_op::{Ctx, Facts, Labelled, One, Op, OpError, Shapes, Wrong, declare};

use super::agent::sight;

declare! {
    /// What somebody saw and did in some episodes, without what they paid (§4.2): of one who acted, or of all whose
    /// episodes are collected over an axis, whose labels tell whose they are.
    pub struct Demonstrate = "demonstrations" @ 2 -> Demonstrations {
        /// The episodes.
        of: Labelled<Rollouts>;
        /// The axis whose labels tell whose they are, where they are collected.
        whose: String = "";
    }
    rule is_told;
    shapes of_rollouts;
}

fn is_told(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (axes, whose) = (facts.seen("of"), facts.arg::<String>("whose").unwrap_or_default());
    let told: Vec<&str> = (!whose.is_empty()).then_some(whose.as_str()).into_iter().collect();
    if axes == told {
        return Ok(());
    }
    let axes: Vec<String> = axes.iter().map(|axis| format!("`{axis}`")).collect();
    let (message, help) = match &axes[..] {
        [] => (
            format!("these episodes are not collected over `{whose}`, so that all are of one"),
            format!("write `collect(.., over: {whose})`, or leave `whose` out"),
        ),
        [axis] => (
            format!(
                "these episodes are collected over {axis}, which is not whose they are said to be"
            ),
            format!("write `whose: \"{}\"`", axis.trim_matches('`')),
        ),
        many => (
            format!("these episodes are collected over {}", many.join(" and ")),
            "collect them over one axis, that of those who acted".to_owned(),
        ),
    };
    Err(Wrong { arg: "whose", message, help })
}

fn of_rollouts(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("of").cloned()
}

impl Op for Demonstrate {
    fn run(&self, _: &Ctx) -> Result<Demonstrations, OpError> {
        let mut all: Option<Demonstrations> = None;
        for (labels, of) in self.of.each() {
            let all = all.get_or_insert_with(|| Demonstrations {
                paths: Trajectories::new(of.paths.seen.fields().to_vec(), of.paths.does.clone()),
                names: Vec::new(),
                whose: Vec::new(),
            });
            let own = (all.paths.seen.fields(), &all.paths.does);
            same_world("the first episodes show", own, (of.paths.seen.fields(), &of.paths.does))
                .map_err(failed)?;
            all.whose.extend(vec![all.names.len(); of.paths.episodes.len()]);
            all.names.push(labels.join(", "));
            all.paths.append(&of.paths);
        }
        all.ok_or_else(|| OpError::Failed("there are no episodes to show".to_owned()))
    }
}

declare! {
    /// What was done in each state that was seen (Eqn. 2.23), for a classifier to learn from: inputs are what was seen,
    /// with a 1 in the place of one of so many, and targets are actions.
    pub struct LabelledActions = "labelled_actions" @ 1 -> Dataset {
        /// What was seen and done.
        of: One<Demonstrations>;
    }
    rule are_discrete;
    shapes of_actions;
}

fn are_discrete(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some((_, does)) = facts.shapes("of").and_then(shown_by) else { return Ok(()) };
    does.n_discrete().map(drop).map_err(wrong("of"))
}

fn of_actions(facts: &Facts<'_>) -> Option<Shapes> {
    let (sees, does) = shown_by(facts.shapes("of")?)?;
    let (input, n) = (sight(&sees), does.n_discrete().ok()?);
    Some(Form { input, target: Vec::new(), classes: Some(n), ..Form::default() }.shapes())
}

impl Op for LabelledActions {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let paths = &self.of.paths;
        let n = paths.does.n_discrete().map_err(failed)?;
        let Values::Index(acts) = paths.acts.values(0) else { unreachable!("it is discrete") };
        let rows = seen_before(&self.of);
        let mut seen = vec![0.0_f32; rows.len() * paths.seen.width()];
        paths.seen.spread_rows(&rows, &mut seen);
        let input = sight(paths.seen.fields());
        Ok(Dataset {
            form: Form { input, target: Vec::new(), classes: Some(n), ..Form::default() },
            x: seen.into_iter().map(f64::from).collect(),
            y: acts.iter().map(|act| f64::from(*act)).collect(),
        })
    }
}

/// The row of what was seen before each step.
pub(super) fn seen_before(of: &Demonstrations) -> Vec<usize> {
    of.paths.each().flat_map(|(seen, _, steps, _)| seen..seen + steps).collect()
}

#[cfg(test)]
mod tests {
    use super::super::strolls;
    use super::*;
    use ivx_op::{Dim, Gathered, Labels};

    #[test]
    fn rewards_stay_behind_and_states_are_ones() {
        let ctx = Ctx::new("demonstrations", 0, None);
        let gathered = |dims: Vec<Dim>, n| Gathered {
            dims,
            values: vec![Rollouts::from(strolls(2)); n],
            name: String::new(),
        };
        let one = Labelled(gathered(Vec::new(), 1));
        let shown = Demonstrate { of: one, whose: String::new() }.run(&ctx).unwrap();
        assert_eq!((shown.whose.len(), seen_before(&shown)), (2, vec![0, 1, 2, 4, 5, 6]));
        let colours = Labels::Names(vec!["red".to_owned(), "green".to_owned()]);
        let two = Labelled(gathered(vec![Dim::new("colour", colours)], 2));
        let both = Demonstrate { of: two, whose: "colour".to_owned() }.run(&ctx).unwrap();
        assert_eq!(
            (both.whose, both.names),
            (vec![0, 0, 1, 1], vec!["red".to_owned(), "green".to_owned()])
        );
        assert_eq!(both.paths.n_steps(), 2 * shown.paths.n_steps());
        let data = LabelledActions { of: One(shown) }.run(&ctx).unwrap();
        assert_eq!(data.y, [0.0, 1.0, 1.0].repeat(2));
        assert_eq!(data.x, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].repeat(2));
        assert_eq!((data.form.input, data.form.classes), (vec![3], Some(2)));
    }
}
