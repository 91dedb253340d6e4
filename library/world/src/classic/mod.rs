//! Classic control: small systems that move by an equation.

mod acrobot;
mod cart_pole;
mod mountain_car;
mod mountain_car_continuous;
mod pendulum;

use std::fmt::Debug;
use std::marker::PhantomData;

use ivx_data::{Columns, Field, Kind, Misfit, Values};
use ivx_op::OpError;

pub use acrobot::Acrobot;
pub use cart_pole::CartPole;
pub use mountain_car::MountainCar;
pub use mountain_car_continuous::MountainCarContinuous;
pub use pendulum::Pendulum;

use crate::env::{Env, Row, Spec, World};
use crate::foresight::Foresight;
use crate::luck::Luck;
use ivx_data::{Act, Actions, End};

/// A system of classic control: where it starts, how it moves and what is seen of it.
///
/// It is reckoned in double precision and seen in single.
pub trait Control: Debug + Send + Sync + 'static {
    /// Its state, an array.
    type State: Copy + Default + Send + AsRef<[f64]> + AsMut<[f64]>;

    /// What is seen of a state, an array too.
    type Seen: AsRef<[f32]>;

    /// After how many steps an episode is cut off.
    const LIMIT: u64;

    /// What can be done.
    fn does() -> Actions;

    /// Where an episode starts.
    fn start(luck: &mut Luck) -> Self::State;

    /// The state that follows, what the step pays, and whether the episode is over.
    fn step(state: Self::State, act: Act<'_>) -> (Self::State, f64, bool);

    /// What is seen of a state.
    fn seen(state: Self::State) -> Self::Seen;

    /// The state of which that is seen, but for rounding and whole turns.
    fn known(seen: &[f32]) -> Self::State;
}

macro_rules! envs {
    ($($system:ty),+) => {$(
        impl Env for $system {
            fn spec(&self) -> Result<Spec, Misfit> {
                Ok(spec::<Self>())
            }

            fn open(&self) -> Result<Box<dyn World>, OpError> {
                Ok(Box::new(Moving::<Self> { state: Default::default() }))
            }

            fn foresight(&self) -> Result<Box<dyn Foresight>, Misfit> {
                Ok(Box::new(Foreseen::<Self>(PhantomData)))
            }
        }
    )+};
}

envs!(Acrobot, CartPole, MountainCar, MountainCarContinuous, Pendulum);

fn spec<C: Control>() -> Spec {
    let width = C::seen(C::State::default()).as_ref().len();
    Spec {
        sees: vec![Field::new("observation", &[width], Kind::F32)],
        does: C::does(),
        tells: Vec::new(),
        limit: Some(C::LIMIT),
    }
}

/// A system as it moves.
struct Moving<C: Control> {
    state: C::State,
}

impl<C: Control> World for Moving<C> {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.state = C::start(luck);
        show::<C>(self.state, row);
    }

    fn step(&mut self, act: Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let (state, reward, over) = C::step(self.state, act);
        self.state = state;
        show::<C>(state, row);
        (reward, if over { End::Terminal } else { End::No })
    }
}

/// How a system will move. All of its state is seen, and nothing but its start is drawn.
struct Foreseen<C: Control>(PhantomData<fn() -> C>);

impl<C: Control> Foresight for Foreseen<C> {
    fn width(&self) -> usize {
        C::State::default().as_ref().len()
    }

    fn place(&self, seen: &Columns, row: usize, state: &mut [f64]) {
        let Values::F32(numbers) = seen.values(0) else { panic!("a field of numbers") };
        let width = seen.fields()[0].width();
        state.copy_from_slice(C::known(&numbers[row * width..][..width]).as_ref());
    }

    fn step(&mut self, state: &mut [f64], act: Act<'_>) -> (f64, bool) {
        let mut own = C::State::default();
        own.as_mut().copy_from_slice(state);
        let (next, reward, over) = C::step(own, act);
        state.copy_from_slice(next.as_ref());
        (reward, over)
    }
}

fn show<C: Control>(state: C::State, row: &mut Row<'_>) {
    // So few that to copy them one by one is faster than a call that copies any number.
    for (shown, number) in row.numbers(0).iter_mut().zip(C::seen(state).as_ref()) {
        *shown = *number;
    }
}

#[expect(clippy::cast_possible_truncation, reason = "what is seen has single precision")]
fn single(number: f64) -> f32 {
    number as f32
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Steps a world as whoever learns would: it shows and pays what its system says, in single precision.
    fn check<C: Control + Env>(env: &C, act: Act<'_>) {
        let spec = env.spec().unwrap();
        let mut seen = Columns::zeros(spec.sees, 2);
        let (mut world, mut luck) = (env.open().unwrap(), Luck::numpy(1));
        let mut state = C::start(&mut luck.clone());
        world.reset(&mut luck, &mut Row::of(&mut seen, 1, &mut []));
        for _ in 0..5 {
            let Values::F32(numbers) = seen.values(0) else { panic!("numbers") };
            let expected = C::seen(state);
            let (other, shown) = numbers.split_at(expected.as_ref().len());
            assert!(shown == expected.as_ref() && other.iter().all(|x| *x == 0.0));
            let (next, pays, over) = C::step(state, act);
            let found = world.step(act, &mut luck, &mut Row::of(&mut seen, 1, &mut []));
            assert_eq!(found, (pays, if over { End::Terminal } else { End::No }));
            state = next;
        }
    }

    #[test]
    fn worlds_show_and_pay_what_their_systems_say() {
        check(&CartPole {}, Act::Index(1));
        check(&MountainCar {}, Act::Index(0));
        check(&MountainCarContinuous {}, Act::Vector(&[0.5]));
        check(&Acrobot {}, Act::Index(2));
        check(&Pendulum {}, Act::Vector(&[-1.5]));
    }

    /// What is foreseen from what is seen at the start is what comes: rounding what is seen moves nothing by more than
    /// `apart` in so many steps. A step more or less does.
    fn foresees<C: Control + Env>(env: &C, act: Act<'_>, apart: f64) {
        let (mut world, mut luck) = (env.open().unwrap(), Luck::numpy(3));
        let mut seen = Columns::zeros(env.spec().unwrap().sees, 2);
        world.reset(&mut luck, &mut Row::of(&mut seen, 1, &mut []));
        let mut foresight = env.foresight().unwrap();
        let mut state = vec![0.0; foresight.width()];
        foresight.place(&seen, 1, &mut state);
        for _ in 0..10 {
            let (pays, end) = world.step(act, &mut luck, &mut Row::of(&mut seen, 1, &mut []));
            let (foreseen, over) = foresight.step(&mut state, act);
            assert!((pays - foreseen).abs() < apart, "{env:?}: {foreseen} is not {pays}");
            assert_eq!(over, end == End::Terminal);
        }
        let mut now = C::State::default();
        now.as_mut().copy_from_slice(&state);
        let far = |state| -> f64 {
            let Values::F32(numbers) = seen.values(0) else { panic!("numbers") };
            let (numbers, foreseen) = (numbers[numbers.len() / 2..].iter(), C::seen(state));
            let pairs = numbers.zip(foreseen.as_ref());
            pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
        };
        assert!(far(now) < apart, "{env:?} by {}", far(now));
        assert!(far(C::step(now, act).0) > 10.0 * apart, "{env:?}");
    }

    #[test]
    fn what_follows_is_foreseen_from_what_is_seen() {
        foresees(&CartPole {}, Act::Index(1), 1e-5);
        foresees(&MountainCar {}, Act::Index(2), 1e-5);
        foresees(&MountainCarContinuous {}, Act::Vector(&[0.5]), 1e-5);
        foresees(&Acrobot {}, Act::Index(2), 1e-5);
        foresees(&Pendulum {}, Act::Vector(&[-1.5]), 1e-4);
    }

    #[test]
    fn they_are_cut_off_as_in_gymnasium() {
        let told = |env: &dyn Env| {
            let spec = env.spec().unwrap();
            assert!(spec.sees.len() == 1 && spec.sees[0].name == "observation");
            (spec.sees[0].shape[0], spec.limit)
        };
        assert_eq!(told(&CartPole {}), (4, Some(500)));
        assert_eq!(told(&MountainCar {}), (2, Some(200)));
        assert_eq!(told(&MountainCarContinuous {}), (2, Some(999)));
        assert_eq!(told(&Acrobot {}), (6, Some(500)));
        assert_eq!(told(&Pendulum {}), (3, Some(200)));
    }

    /// Many starts lie within these bounds, and come near them.
    fn starts<C: Control>(low: &[f64], high: &[f64]) {
        let mut luck = Luck::numpy(0);
        let drawn: Vec<C::State> = (0..2_000).map(|_| C::start(&mut luck)).collect();
        for (i, (low, high)) in low.iter().zip(high).enumerate() {
            let numbers = drawn.iter().map(|state| state.as_ref()[i]);
            let (least, most) =
                numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            let near = (high - low) / 100.0;
            assert!(least >= *low && least <= low + near, "{least} is not {low}");
            assert!(most <= *high && most >= high - near, "{most} is not {high}");
        }
    }

    #[test]
    fn episodes_start_anywhere_between_bounds() {
        starts::<CartPole>(&[-0.05; 4], &[0.05; 4]);
        starts::<MountainCar>(&[-0.6, 0.0], &[-0.4, 0.0]);
        starts::<MountainCarContinuous>(&[-0.6, 0.0], &[-0.4, 0.0]);
        starts::<Acrobot>(&[-0.1; 4], &[0.1; 4]);
        starts::<Pendulum>(&[-PI, -1.0], &[PI, 1.0]);
    }
}
