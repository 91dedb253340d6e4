//! What others were watched doing, for somebody to learn from.

use std::collections::BTreeMap;

use ivx_data::form::{failed, wrong};
use ivx_data::{
    Act, Columns, Demonstrations, End, Field, Misfit, Rollouts, Trajectories, Values, shown_by,
    told_by,
};
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, Wrong, declare};

declare! {
    /// What others saw and did while somebody who acted saw them (§4.1, §B.1.1): such as the nearest cars on a highway or a
    /// roundabout. A world tells it of each step as `1.car`, `1.act` and `1.saw.0` and on, then from `2.` on.
    ///
    /// What one of them saw and did in consecutive steps is an episode. Where it gets out of sight the episode is cut off,
    /// which is no end, and another begins when it is seen again. What it did last is left out, since nobody saw what came
    /// of it. What others were paid nobody knows, and what was paid to who acted stays behind.
    pub struct Watched = "watched" @ 1 -> Demonstrations {
        /// What somebody experienced in a world that tells of others.
        of: One<Rollouts>;
        /// What the world tells of others by which they are told apart: `"style"`, by which all who drive alike are one, or
        /// `"car"`, each on its own in each episode.
        whose: String = "style";
    }
    rule tells_of_others;
    shapes of_rollouts;
}

fn tells_of_others(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(shapes) = facts.shapes("of") else { return Ok(()) };
    let (Some((sees, does)), Some(tells)) = (shown_by(shapes), told_by(shapes)) else {
        return Ok(());
    };
    does.n_discrete().map_err(wrong("of"))?;
    others(&tells, CAR, &sees).map_err(wrong("of"))?;
    let whose = facts.arg::<String>("whose");
    whose.map_or(Ok(()), |whose| others(&tells, &whose, &sees).map(drop).map_err(wrong("whose")))
}

fn of_rollouts(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("of").cloned()
}

/// What tells who one of the others is: a number above 0, or 0 where there is none.
const CAR: &str = "car";

/// The places of what is told of one of the others.
struct Other {
    car: usize,
    whose: usize,
    act: usize,
    saw: Vec<usize>,
}

/// Where a world tells of others.
fn others(tells: &[String], whose: &str, sees: &[Field]) -> Result<Vec<Other>, Misfit> {
    let places: BTreeMap<&str, usize> =
        tells.iter().enumerate().map(|(i, tell)| (&tell[..], i)).collect();
    let place = |k: usize, what: &str| places.get(&format!("{k}.{what}")[..]).copied();
    let n = (1..=tells.len()).take_while(|k| place(*k, CAR).is_some()).count();
    if n == 0 {
        let message = "this world tells nothing of others who could be watched".to_owned();
        let help = "act in one that tells what others see and do, such as `highway(\"multi\")` or `roundabout()`";
        return Err(Misfit::new(message, help));
    }
    let width: usize = sees.iter().map(Field::width).sum();
    let missing = |what: &str| {
        let message = format!("this world tells of others, but not `1.{what}`");
        let help = match what {
            "act" => {
                "choose a task in which others do what the agent can do, other than `\"original\"`"
                    .to_owned()
            }
            _ if what == whose => {
                let told = tells.iter().filter_map(|tell| tell.strip_prefix("1."));
                let told = told.filter(|tell| *tell != "act" && !tell.starts_with("saw."));
                let told: Vec<String> = told.map(|tell| format!("`\"{tell}\"`")).collect();
                format!("say one of {}", told.join(", "))
            }
            _ => "others must see as who acts does".to_owned(),
        };
        Misfit { message, help }
    };
    let of = |k: usize, what: &str| place(k, what).ok_or_else(|| missing(what));
    let other = |k: usize| {
        let saw: Result<_, Misfit> = (0..width).map(|i| of(k, &format!("saw.{i}"))).collect();
        Ok(Other { car: of(k, CAR)?, whose: of(k, whose)?, act: of(k, "act")?, saw: saw? })
    };
    (1..=n).map(other).collect()
}

/// What one of the others saw and did in a step.
struct Watch<'a> {
    car: f32,
    whose: f32,
    step: usize,
    told: &'a [f32],
    other: &'a Other,
}

impl Op for Watched {
    fn run(&self, _: &Ctx) -> Result<Demonstrations, OpError> {
        let Rollouts { paths, tells, told, .. } = &*self.of;
        let n_acts = paths.does.n_discrete().map_err(failed)?;
        let others = others(tells, &self.whose, paths.seen.fields()).map_err(failed)?;
        let mut all = Trajectories::new(paths.seen.fields().to_vec(), paths.does.clone());
        // Of each episode its own, and the number of that in which it was seen where each is on its own.
        let mut whose: Vec<(usize, f32)> = Vec::new();
        let steps: Vec<&[f32]> = told.chunks_exact(tells.len()).collect();
        for (i, (_, done, n, _)) in paths.each().enumerate() {
            let mut watched: Vec<Watch<'_>> = Vec::new();
            for (step, told) in steps[done..done + n].iter().enumerate() {
                let there = others.iter().filter(|other| told[other.car] > 0.0);
                watched.extend(there.map(|other| {
                    let (car, whose) = (told[other.car], told[other.whose]);
                    Watch { car, whose, step, told, other }
                }));
            }
            // Steps of one stay in order.
            watched.sort_by(|a, b| a.car.total_cmp(&b.car));
            let goes_on = |a: &Watch<'_>, b: &Watch<'_>| {
                (a.car, a.whose, a.step + 1) == (b.car, b.whose, b.step)
            };
            for seen in watched.chunk_by(goes_on).filter(|seen| seen.len() > 1) {
                for (at, watch) in seen.iter().enumerate() {
                    push(&mut all.seen, watch);
                    if at + 1 < seen.len() {
                        Act::Index(act(watch, n_acts)?).append(&mut all.acts);
                    }
                }
                all.episodes.push((seen.len() - 1, End::Limit));
                whose.push((if self.whose == CAR { i } else { 0 }, seen[0].whose));
            }
        }
        let mut each = whose.clone();
        each.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        each.dedup();
        let name = |(episode, whose): &(usize, f32)| {
            if self.whose == CAR { format!("{whose} of {episode}") } else { whose.to_string() }
        };
        let place = |one| each.iter().position(|other| *other == one).expect("it is among them");
        Ok(Demonstrations {
            paths: all,
            names: each.iter().map(name).collect(),
            whose: whose.into_iter().map(place).collect(),
        })
    }
}

/// What it did, by place among so many.
fn act(watch: &Watch<'_>, n: usize) -> Result<usize, OpError> {
    let told = watch.told[watch.other.act];
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place")]
    let act = told as usize;
    if act < n && told >= 0.0 {
        return Ok(act);
    }
    Err(OpError::Failed(format!(
        "somebody is told to have done {told}, which is none of {n} actions"
    )))
}

/// Adds what it saw as a row.
fn push(to: &mut Columns, watch: &Watch<'_>) {
    let at = to.len();
    to.resize(at + 1);
    let mut saw = watch.other.saw.iter().map(|place| watch.told[*place]);
    for column in 0..to.fields().len() {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "they were such"
        )]
        match to.values_mut(column) {
            (Values::F32(numbers), width) => {
                numbers[at * width..].iter_mut().zip(&mut saw).for_each(|(to, x)| *to = x);
            }
            (Values::U8(bytes), width) => {
                bytes[at * width..].iter_mut().zip(&mut saw).for_each(|(to, x)| *to = x as u8);
            }
            (Values::Index(places), width) => {
                places[at * width..].iter_mut().zip(&mut saw).for_each(|(to, x)| *to = x as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::{Actions, Kind, same_world, world_shapes};
    use ivx_op::{Artifact as _, Gathered, Held, Lit, Literal as _, Part};
    use ivx_world::{Acts, Env, Highway, Roundabout};

    use super::super::demonstrate::seen_before;
    use super::super::{Learn, Method, Random, Span};
    use super::*;

    fn tells(n: usize) -> Vec<String> {
        let of = |k| ["car", "style", "saw.0", "saw.1", "act"].map(|what| format!("{k}.{what}"));
        std::iter::once("speed".to_owned()).chain((1..=n).flat_map(of)).collect()
    }

    /// Two episodes of five and two steps in which two of three cars are told of; a car sees its number and the step.
    fn by_hand() -> Rollouts {
        let sees = vec![Field::new("at", &[], Kind::F32), Field::new("step", &[], Kind::Index(9))];
        let mut paths = Trajectories::new(sees, Actions::named(&["slow", "fast", "turn"]));
        paths.seen.resize(9);
        (0..7).for_each(|_| ivx_data::Act::Index(0).append(&mut paths.acts));
        paths.episodes = vec![(5, End::Terminal), (2, End::Limit)];
        let mut all = Rollouts::new(paths, tells(2));
        all.rewards = vec![1.0; 7];
        // Which cars are told of: they change places, leave and come back.
        let there = [[2, 3], [3, 2], [2, 0], [3, 2], [1, 3], [2, 0], [2, 0_u8]];
        for (t, cars) in there.map(|cars| cars.map(f32::from)).into_iter().enumerate() {
            let step = [0.0_f32, 1.0, 2.0, 3.0, 4.0, 0.0, 1.0][t];
            all.told.push(25.0);
            for car in cars {
                let style = if car == 3.0 { 4.0 } else { 1.0 };
                let did = if car == 3.0 { 2.0 } else { 1.0 };
                let told = [car, style, 10.0 * car, step, did];
                all.told.extend(if car == 0.0 { [0.0; 5] } else { told });
            }
        }
        all
    }

    fn watched(of: &Rollouts, whose: &str) -> Demonstrations {
        Watched { of: One(of.clone()), whose: whose.to_owned() }
            .run(&Ctx::new("watched", 0, None))
            .unwrap()
    }

    #[test]
    fn what_each_saw_and_did_is_chained_and_cut_off_where_it_left() {
        let by_style = watched(&by_hand(), "style");
        // Car 2 in steps 0 to 3; car 3 in 0 and 1, and again in 3 and 4; car 2 of the other episode. Car 1 was seen once.
        let cut = |n| (n, End::Limit);
        assert_eq!(by_style.paths.episodes, [cut(3), cut(1), cut(1), cut(1)]);
        assert_eq!(by_style.names, ["1", "4"]);
        assert_eq!(by_style.whose, [0, 1, 1, 0]);
        let saw = [20.0, 20.0, 20.0, 20.0, 30.0, 30.0, 30.0, 30.0, 20.0, 20.0];
        assert_eq!(by_style.paths.seen.values(0), &Values::F32(saw.to_vec()));
        let steps = vec![0, 1, 2, 3, 0, 1, 3, 4, 0, 1];
        assert_eq!(by_style.paths.seen.values(1), &Values::Index(steps));
        assert_eq!(by_style.paths.acts.values(0), &Values::Index(vec![1, 1, 1, 2, 2, 1]));
        let by_car = watched(&by_hand(), "car");
        assert_eq!(by_car.paths, by_style.paths);
        assert_eq!(by_car.names, ["2 of 0", "3 of 0", "2 of 1"]);
        assert_eq!(by_car.whose, [0, 1, 1, 2]);
    }

    #[test]
    fn what_is_none_of_the_actions_fails() {
        let mut strange = by_hand();
        strange.told[5] = 3.0;
        let op = Watched { of: One(strange), whose: "style".to_owned() };
        assert!(op.run(&Ctx::new("watched", 0, None)).is_err());
    }

    #[test]
    fn worlds_that_tell_nothing_of_others_are_refused() {
        let sees = [Field::new("at", &[2], Kind::F32)];
        let why = |tells: &[String], whose| others(tells, whose, &sees).err().expect("refused");
        assert!(why(&["speed".to_owned()], CAR).help.contains("highway"));
        let without = |what: &str| -> Vec<String> {
            tells(2).into_iter().filter(|tell| !tell.ends_with(what)).collect()
        };
        assert!(why(&without("act"), CAR).help.contains("original"));
        assert!(why(&without("saw.1"), CAR).message.ends_with("`1.saw.1`"));
        assert_eq!(why(&tells(2), "colour").help, "say one of `\"car\"`, `\"style\"`");
        assert_eq!(others(&tells(2), "style", &sees).unwrap().len(), 2);
        let mut shapes = world_shapes(&sees, &Actions::named(&["go"]));
        assert_eq!(told_by(&shapes), None);
        ivx_data::tell(&mut shapes, &tells(1));
        let mut told = told_by(&shapes).unwrap();
        told.sort();
        let mut all = tells(1);
        all.sort();
        assert_eq!(told, all);
    }

    fn highway() -> Box<dyn Env> {
        let (task, release) = ("multi".to_owned(), "1.1".to_owned());
        let actions = None;
        Box::new(Highway {
            task,
            actions,
            cars: 30,
            lanes: 4,
            lane: 3,
            frames: 3,
            seconds: 20,
            release,
        })
    }

    fn roundabout() -> Box<dyn Env> {
        let (task, release) = ("exit".to_owned(), "1.1".to_owned());
        Box::new(Roundabout { task, exit: 3, actions: None, frames: 3, seconds: 20, release })
    }

    fn drove(r#in: Box<dyn Env>, episodes: usize, stream: &str) -> Rollouts {
        let (actor, stream) = (Box::new(Random {}), stream.to_owned());
        let act = super::super::Act { actor, r#in, episodes, limit: 0, stream, keeps: Vec::new() };
        act.run(&Ctx::new("act", 0, None)).unwrap()
    }

    /// How often an agent that cloned these, with so many updates, says what others did; and how often that is what is
    /// done most in what it learned from.
    fn right(shown: &Demonstrations, updates: i64, others: &Demonstrations) -> (f64, f64) {
        let registry = crate::registry();
        let lit = |part: Part| Lit::Part(registry.complete(&part));
        let values = vec![shown.encode().into()];
        let held = Gathered { dims: Vec::new(), values, name: String::new() };
        let how = Part::new("bc").with("shown", Lit::Held(Held::Value(held)));
        let span = Part::new("updates").with("n", updates);
        let learn = Learn {
            how: Box::<dyn Method>::from_lit(&lit(how)).unwrap(),
            r#in: multi(),
            r#for: Box::<dyn Span>::from_lit(&lit(span)).unwrap(),
            every: 0,
            trials: 1,
            lanes: 1,
        };
        let agent = learn.run(&Ctx::new("learn", 0, None)).unwrap().agent;
        let acts = |of: &Demonstrations| -> Vec<usize> {
            let Values::Index(acts) = of.paths.acts.values(0) else { panic!("places") };
            acts.iter().map(|act| *act as usize).collect()
        };
        let (known, asked) = (acts(shown), acts(others));
        let count = |act: usize| known.iter().filter(|did| **did == act).count();
        let most = (0..9).max_by_key(|act| count(*act)).unwrap();
        let mut seen = Columns::zeros(others.paths.seen.fields().to_vec(), 0);
        for row in seen_before(others) {
            seen.push(&others.paths.seen, row);
        }
        let mut says = Acts::of(&others.paths.does, seen.len());
        let mut rng = Ctx::new("act", 0, None).rng("act", &[]);
        agent.open().act(&seen, &mut rng, &mut says).unwrap();
        #[expect(clippy::cast_precision_loss, reason = "a few thousand")]
        let share = |right: usize| right as f64 / asked.len() as f64;
        let right = says.places.iter().zip(&asked).filter(|(a, b)| a == b).count();
        (share(right), share(asked.iter().filter(|act| **act == most).count()))
    }

    fn multi() -> Box<dyn Env> {
        let world = Part::new("highway").with("task", "multi");
        Box::<dyn Env>::from_lit(&Lit::Part(crate::registry().complete(&world))).unwrap()
    }

    /// Who clones the drivers that a random one watched in 200 episodes says what they do in others more often than who
    /// always says what is done most: 0.05 more at least. It was 0.12 in other episodes, by which the 4 000 updates were
    /// chosen; of 20 episodes nothing is learnt that others do.
    #[test]
    fn a_clone_of_who_was_watched_knows_what_others_do() {
        let of = |episodes, stream: &str| watched(&drove(multi(), episodes, stream), "style");
        let (clone, most) = right(&of(200, "main"), 4_000, &of(100, "held out"));
        assert!(clone > most + 0.05, "{clone:.3} and {most:.3}");
    }

    /// Each row is one that a car saw, in order; and each step of a car that has a next one is there once.
    #[test]
    fn all_that_was_told_is_watched() {
        for (r#in, stream) in [(highway(), "main"), (highway(), "other"), (roundabout(), "main")] {
            let spec = r#in.spec().unwrap();
            let all = drove(r#in, 6, stream);
            let shown = watched(&all, "style");
            let own = (shown.paths.seen.fields(), &shown.paths.does);
            same_world("they show", own, (&spec.sees, &spec.does)).unwrap();
            assert_eq!(shown.paths.seen.len(), shown.paths.n_steps() + shown.paths.episodes.len());
            assert!(shown.names.len() > 1);

            let width = spec.sees[0].width();
            let place = |name: String| all.tells.iter().position(|tell| *tell == name).unwrap();
            let n = all.tells.iter().filter(|tell| tell.strip_suffix(".car").is_some()).count();
            // Of each step, who is there, what it did and what it saw.
            let entries = |t: usize| -> Vec<(f32, f32, f32, Vec<f32>)> {
                let told = &all.told[t * all.tells.len()..][..all.tells.len()];
                let of = |k: usize, what: &str| told[place(format!("{k}.{what}"))];
                let saw = |k| &told[place(format!("{k}.saw.0"))..][..width];
                (1..=n)
                    .filter(|k| of(*k, "car") > 0.0)
                    .map(|k| (of(k, "car"), of(k, "style"), of(k, "act"), saw(k).to_vec()))
                    .collect()
            };
            let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            let mut expected = Vec::new();
            for (_, done, steps, _) in all.paths.each() {
                for t in done..(done + steps).saturating_sub(1) {
                    for (car, style, did, saw) in entries(t) {
                        let next = entries(t + 1).into_iter().find(|entry| entry.0 == car);
                        let Some((.., next)) = next else { continue };
                        expected.push((bits(&saw), style.to_string(), did, bits(&next)));
                    }
                }
            }
            let (Values::F32(seen), Values::Index(acts)) =
                (shown.paths.seen.values(0), shown.paths.acts.values(0))
            else {
                panic!("numbers and places")
            };
            let row = |i: usize| bits(&seen[i * width..][..width]);
            let mut found = Vec::new();
            for ((first, done, steps, end), whose) in shown.paths.each().zip(&shown.whose) {
                assert!(steps > 0 && end == End::Limit);
                for t in 0..steps {
                    #[expect(clippy::cast_precision_loss, reason = "a few")]
                    let did = acts[done + t] as f32;
                    let name = shown.names[*whose].clone();
                    found.push((row(first + t), name, did, row(first + t + 1)));
                }
            }
            assert!(found.len() > 100, "{}", found.len());
            let order = |a: &(Vec<u32>, String, f32, Vec<u32>),
                         b: &(Vec<u32>, String, f32, Vec<u32>)| {
                (&a.0, &a.3, &a.1).cmp(&(&b.0, &b.3, &b.1)).then(a.2.total_cmp(&b.2))
            };
            expected.sort_by(order);
            found.sort_by(order);
            assert!(found == expected);
        }
    }
}
