//! What a teacher would have done.

use ivx_data::Dataset;
use ivx_data::form::{failed, form, same, told, wrong};
use ivx_nn::Model;
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, Wrong, declare};

declare! {
    /// Data whose targets are what a teacher predicts, who may see something else of the same moments: knowledge distillation,
    /// as from privileged to sensed views in learning by cheating (Chen et al., 2019).
    pub struct Distilled = "distilled" @ 1 -> Dataset {
        /// What the pupil sees.
        on: One<Dataset>;
        /// The teacher.
        teacher: One<Model>;
        /// What the teacher sees, observation by observation.
        seen: One<Dataset>;
    }
    rule fits;
    shapes as_on;
}

fn as_on(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("on").cloned()
}

fn fits(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (on, seen) = (form(facts, "on"), form(facts, "seen"));
    if let (Some(on), Some(seen)) = (&on, &seen)
        && (&on.target, on.classes) != (&seen.target, seen.classes)
    {
        let message =
            format!("the teacher sees data of {}, and the pupil of {}", told(seen), told(on));
        let help = "cut both from the same episodes".to_owned();
        return Err(Wrong { arg: "seen", message, help });
    }
    match (form(facts, "teacher"), seen) {
        (Some(model), Some(seen)) => same(&model, &seen).map_err(wrong("teacher")),
        _ => Ok(()),
    }
}

impl Op for Distilled {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        same(&self.teacher.form(), &self.seen.form).map_err(failed)?;
        let (n, m) = (self.on.len(), self.seen.len());
        if n != m {
            let why = format!("the pupil sees {n} moments, and the teacher {m}");
            return Err(OpError::Failed(why));
        }
        if self.on.form.classes.is_some() {
            let why = "a teacher of classes is none of numbers".to_owned();
            return Err(OpError::Failed(why));
        }
        let y = self.teacher.predict(&self.seen.x);
        Ok(Dataset { form: self.on.form.clone(), x: self.on.x.clone(), y })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_what_the_teacher_says_of_what_it_sees() {
        let teacher = || One(Model::Polynomial(vec![1.0, 2.0]));
        let on = || One(Dataset::pairs(vec![9.0, 8.0], vec![0.0, 0.0]));
        let ctx = Ctx::new("distilled", 0, None);
        let seen = One(Dataset::pairs(vec![0.0, 3.0], vec![0.0, 0.0]));
        let found = Distilled { on: on(), teacher: teacher(), seen }.run(&ctx).unwrap();
        assert_eq!((found.x, found.y), (vec![9.0, 8.0], vec![1.0, 7.0]));
        let seen = One(Dataset::pairs(vec![0.0], vec![0.0]));
        let why =
            Distilled { on: on(), teacher: teacher(), seen }.run(&ctx).unwrap_err().to_string();
        assert_eq!(why, "the pupil sees 2 moments, and the teacher 1");
    }
}
