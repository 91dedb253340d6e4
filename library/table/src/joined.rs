//! Several data sets as one.

use ivx_data::form::{failed, told, wrong};
use ivx_data::{Dataset, Form, Misfit};
use ivx_op::{Ctx, Facts, Many, One, Op, OpError, Shapes, Wrong, declare};

declare! {
    /// The observations of several data sets of one form, one set after the other.
    pub struct Joined = "joined" @ 1 -> Dataset {
        /// The data sets.
        data: Many<One<Dataset>>;
    }
    rule are_of_one_form;
    shapes as_first;
}

fn forms<'a>(facts: &Facts<'a>) -> impl Iterator<Item = Form> + use<'a> {
    let facts = *facts;
    let all = facts.shapes.get("data").map_or(0, Vec::len);
    (0..all).filter_map(move |i| facts.shapes_at("data", i).and_then(Form::of))
}

fn are_of_one_form(facts: &Facts<'_>) -> Result<(), Wrong> {
    let mut all = forms(facts);
    let Some(first) = all.next() else { return Ok(()) };
    all.try_for_each(|other| alike(&first, &other)).map_err(wrong("data"))
}

fn alike(first: &Form, other: &Form) -> Result<(), Misfit> {
    if first == other {
        return Ok(());
    }
    let message = match (told(first), told(other)) {
        (one, another) if one == another => {
            format!("the data sets are of {one}, whose numbers or classes have other names")
        }
        (one, another) => format!("one data set is of {one}, and another of {another}"),
    };
    Err(Misfit::new(message, "join what is of one form"))
}

fn as_first(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("data").cloned()
}

impl Op for Joined {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let Some((first, rest)) = self.data.0.split_first() else {
            return Err(OpError::Failed("there are no data sets to join".to_owned()));
        };
        let mut all = first.0.clone();
        for One(other) in rest {
            alike(&all.form, &other.form).map_err(failed)?;
            all.x.extend(&other.x);
            all.y.extend(&other.y);
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_comes_after_the_other() {
        let pair = |x: f64| One(Dataset::pairs(vec![x], vec![-x]));
        let joined = |data| Joined { data: Many(data) }.run(&Ctx::new("joined", 0, None));
        let found = joined(vec![pair(2.0), pair(1.0)]).unwrap();
        assert_eq!((found.x, found.y), (vec![2.0, 1.0], vec![-2.0, -1.0]));
        let form = Form { input: vec![1], ..Form::default() };
        let other = One(Dataset { form, x: vec![0.0], y: vec![0.0] });
        assert!(joined(vec![pair(2.0), other]).is_err());
        assert!(joined(Vec::new()).is_err());
    }
}
