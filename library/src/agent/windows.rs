//! The plans that somebody followed, seen from where each begins.

use ivx_data::form::failed;
use ivx_data::{Dataset, Field, Form, Misfit, Rollouts, shown_by, told_by};
use ivx_math::moments::real;
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, Wrong, declare};

declare! {
    /// What was seen in some episodes, and where whoever acted went from there: data for models of plans (§3.1).
    ///
    /// The input is what was seen: the first field that is an image, and beside it all numbers of the others. The target is
    /// the plan that was followed, `[steps, places]`: where it led after so many steps, twice as many, and so on, seen from
    /// where it begins. With a `heading` the first number of a place is how far ahead it is, and the second how far aside,
    /// to where a growing angle turns. Plans that an episode does not finish are left out.
    pub struct Windows = "windows" @ 1 -> Dataset {
        /// The episodes, of a world that tells where one is.
        of: One<Rollouts>;
        /// What tells where one is: a name for each number of a place.
        places: Vec<String>;
        /// What tells where one heads, in radians; none if plans are not turned.
        heading: String = "";
        /// The fields that are seen; all by default.
        sees: Vec<String> = Vec::<i64>::new();
        /// How many places a plan has.
        steps: usize = 4, in 1.0..=1e6;
        /// How many steps of the world are between them.
        every: usize = 20, in 1.0..=1e9;
        /// How many steps of the world are between the beginnings of plans.
        stride: usize = 1, in 1.0..=1e9;
    }
    rule is_told;
    shapes of_plans;
}

fn is_told(facts: &Facts<'_>) -> Result<(), Wrong> {
    let places: Vec<String> = facts.arg("places").unwrap_or_default();
    let heading: String = facts.arg("heading").unwrap_or_default();
    let wrong =
        |arg: &'static str, message: String, help: String| Err(Wrong { arg, message, help });
    if places.is_empty() {
        let help = "name what tells it, such as `places: [\"x\", \"y\"]`".to_owned();
        return wrong("places", "nothing tells where one is".to_owned(), help);
    }
    if !heading.is_empty() && places.len() != 2 {
        let message = format!("a heading turns places of two numbers, not of {}", places.len());
        return wrong("heading", message, "leave `heading` out".to_owned());
    }
    let Some(shapes) = facts.shapes("of") else { return Ok(()) };
    if let Some(told) = told_by(shapes) {
        for (arg, name) in places.iter().map(|name| ("places", name)).chain([("heading", &heading)])
        {
            if (arg == "places" || !name.is_empty()) && !told.contains(name) {
                let message = format!("the world tells no `{name}`");
                return wrong(arg, message, format!("it tells {}", listed(&told)));
            }
        }
    }
    let Some((sees, _)) = shown_by(shapes) else { return Ok(()) };
    let wanted: Vec<String> = facts.arg("sees").unwrap_or_default();
    match chosen(&sees, &wanted) {
        Ok(_) => Ok(()),
        Err(Misfit { message, help }) => wrong("sees", message, help),
    }
}

fn of_plans(facts: &Facts<'_>) -> Option<Shapes> {
    let (sees, _) = shown_by(facts.shapes("of")?)?;
    let wanted: Vec<String> = facts.arg("sees").unwrap_or_default();
    let order = chosen(&sees, &wanted).ok()?;
    let places: Vec<String> = facts.arg("places")?;
    Some(form(&sees, &order, [facts.arg("steps")?, places.len()]).shapes())
}

pub(super) fn listed(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// The places of the fields that are seen, the first image before all others.
pub(super) fn chosen(fields: &[Field], wanted: &[String]) -> Result<Vec<usize>, Misfit> {
    let named = |name: &String| fields.iter().position(|field| field.name == *name);
    if let Some(name) = wanted.iter().find(|name| named(name).is_none()) {
        let all: Vec<String> = fields.iter().map(|field| field.name.clone()).collect();
        let message = format!("the world shows no `{name}`");
        return Err(Misfit::new(message, &format!("it shows {}", listed(&all))));
    }
    let mut order: Vec<usize> = match wanted {
        [] => (0..fields.len()).collect(),
        wanted => wanted.iter().filter_map(named).collect(),
    };
    if let Some(at) = order.iter().position(|i| fields[*i].shape.len() == 3) {
        order[..=at].rotate_right(1);
    }
    Ok(order)
}

/// What an observation is: an image and numbers beside it, or a vector of all.
pub(super) fn form(fields: &[Field], order: &[usize], [steps, dims]: [usize; 2]) -> Form {
    let all: usize = order.iter().map(|i| fields[*i].spread()).sum();
    let input = match order.first().map(|i| &fields[*i].shape[..]) {
        Some(shape @ [_, _, _]) => shape.to_vec(),
        _ => vec![all],
    };
    let beside = all - input.iter().product::<usize>();
    Form { input, beside, target: vec![steps, dims], ..Form::default() }
}

/// What tells where one is and heads, as columns of what is told.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    places: Vec<usize>,
    heading: Option<usize>,
}

impl Placed {
    /// Those of some names.
    pub(super) fn of(tells: &[String], places: &[String], heading: &str) -> Result<Self, String> {
        let column = |name: &str| {
            let why = || format!("the world tells no `{name}`, but {}", listed(tells));
            tells.iter().position(|told| told == name).ok_or_else(why)
        };
        let places = places.iter().map(|name| column(name)).collect::<Result<_, _>>()?;
        let heading = if heading.is_empty() { None } else { Some(column(heading)?) };
        Ok(Self { places, heading })
    }

    /// Appends where one is by one row of what is told, seen from another.
    pub(super) fn moved(&self, from: &[f32], to: &[f32], plan: &mut Vec<f64>) {
        let mut moved = self.places.iter().map(|i| f64::from(to[*i]) - f64::from(from[*i]));
        match self.heading.map(|heading| f64::from(from[heading]).sin_cos()) {
            None => plan.extend(moved),
            Some((sin, cos)) => {
                let (dx, dy) = (moved.next(), moved.next());
                let (dx, dy) = (dx.unwrap_or_default(), dy.unwrap_or_default());
                plan.extend([cos * dx + sin * dy, cos * dy - sin * dx]);
            }
        }
    }
}

impl Op for Windows {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let (of, seen) = (&*self.of, &self.of.paths.seen);
        let order = chosen(seen.fields(), &self.sees).map_err(failed)?;
        let form = form(seen.fields(), &order, [self.steps, self.places.len()]);
        if form.input_len() == 0 {
            let why = "of what was seen in these episodes nothing was kept".to_owned();
            return Err(OpError::Failed(why));
        }
        let place = Placed::of(&of.tells, &self.places, &self.heading).map_err(OpError::Failed)?;
        let told = |step: usize| &of.told[step * of.tells.len()..][..of.tells.len()];
        let (mut x, mut y) = (Vec::new(), Vec::new());
        let mut row = vec![0.0; form.input_len()];
        for (from, done, steps, _) in of.paths.each() {
            // What is told of a step is true of what is seen after it.
            let last = steps.saturating_sub(self.steps * self.every);
            for t in (1..=last).step_by(self.stride) {
                let mut rest = &mut row[..];
                for &i in &order {
                    let (own, others) = rest.split_at_mut(seen.fields()[i].spread());
                    seen.spread(i, from + t, own);
                    rest = others;
                }
                x.extend(row.iter().map(|x| f64::from(*x)));
                let now = done + t - 1;
                for k in 1..=self.steps {
                    place.moved(told(now), told(now + k * self.every), &mut y);
                }
            }
        }
        if y.is_empty() {
            let long = real(self.steps * self.every + 1);
            let why = format!("no episode has the {long} steps that a plan takes");
            return Err(OpError::Failed(why));
        }
        Ok(Dataset { form, x, y })
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::{Actions, Columns, End, Kind, Trajectories, Values};

    use super::*;

    /// Two episodes of 5 and 2 steps: north first, and on to the east; a picture and a speed are seen.
    fn driven() -> Rollouts {
        let sees =
            vec![Field::new("speed", &[], Kind::F32), Field::new("view", &[1, 1, 2], Kind::U8)];
        let does = Actions::Discrete(vec!["go".to_owned()]);
        let mut paths = Trajectories::new(sees.clone(), does);
        paths.episodes = vec![(5, End::Limit), (2, End::Terminal)];
        paths.seen = Columns::zeros(sees, 9);
        paths.acts.resize(7);
        let (Values::F32(speed), _) = paths.seen.values_mut(0) else { panic!("numbers") };
        (0..9_u8).for_each(|i| speed[usize::from(i)] = f32::from(i));
        let (Values::U8(view), _) = paths.seen.values_mut(1) else { panic!("bytes") };
        (0..18_u8).for_each(|i| view[usize::from(i)] = i);
        let names = ["x", "y", "yaw"].map(str::to_owned).to_vec();
        let mut all = Rollouts::new(paths, names);
        all.rewards = vec![0.0; 7];
        let quarter = std::f32::consts::FRAC_PI_2;
        let places =
            [(0.0, 1.0), (0.0, 2.0), (1.0, 2.0), (2.0, 2.0), (3.0, 2.0), (9.0, 9.0), (9.0, 9.0)];
        all.told = places.iter().flat_map(|(x, y)| [*x, *y, quarter]).collect();
        all
    }

    fn windows(heading: &str, sees: &[&str], every: usize) -> Result<Dataset, OpError> {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let (places, sees) = (names(&["x", "y"]), names(sees));
        let op = Windows {
            of: One(driven()),
            places,
            heading: heading.to_owned(),
            sees,
            steps: 2,
            every,
            stride: 1,
        };
        op.run(&Ctx::new("windows", 0, None))
    }

    #[test]
    fn a_plan_is_seen_from_where_it_begins() {
        let data = windows("", &[], 1).unwrap();
        assert_eq!((&data.form.input[..], data.form.beside), (&[1, 1, 2][..], 1));
        assert_eq!(data.form.target, [2, 2]);
        // After the first step at (0, 1), and after the third at (1, 2); the fourth and fifth have no two after them.
        assert_eq!(data.len(), 3);
        assert_eq!(data.x[..3], [2.0, 3.0, 1.0]);
        assert_eq!(data.y[..4], [0.0, 1.0, 1.0, 1.0]);
        assert_eq!(data.y[8..], [1.0, 0.0, 2.0, 0.0]);
        // Heading north, east is to the right: against a growing angle.
        let turned = windows("yaw", &["speed"], 2).unwrap();
        assert_eq!((&turned.form.input[..], turned.form.beside), (&[1][..], 0));
        let expected = [1.0, -1.0, 1.0, -3.0];
        assert!(turned.y.iter().zip(expected).all(|(y, e)| (y - e).abs() < 1e-6), "{:?}", turned.y);
        let why = windows("", &["lidar"], 1).unwrap_err().to_string();
        assert_eq!(why, "the world shows no `lidar`");
        assert_eq!(
            windows("nose", &[], 1).unwrap_err().to_string(),
            "the world tells no `nose`, but `x`, `y`, `yaw`"
        );
        let why = windows("", &[], 9).unwrap_err().to_string();
        assert_eq!(why, "no episode has the 19 steps that a plan takes");
    }
}
