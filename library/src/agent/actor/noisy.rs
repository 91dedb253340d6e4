//! Acting with slips.

use ivx_data::{Columns, Misfit};
use ivx_op::{OpError, declare};
use ivx_world::{Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::Acting;

declare! {
    /// Somebody who now and then draws an action evenly, and else acts as another: so that who goes in circles leaves
    /// them, as agents are measured whose policies are the best actions of values (Mnih et al., 2015).
    pub struct Noisy = "noisy" @ 1 {
        /// The other.
        actor: Box<dyn Actor>;
        /// How often.
        share: f64 = 0.05, in 0.0..=1.0;
    }
}

impl Actor for Noisy {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        spec.does.n_discrete()?;
        self.actor.fits(spec)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        let n_actions = spec.does.n_discrete()?;
        Ok(Box::new(Slipping { of: self.actor.open(spec)?, share: self.share, n_actions }))
    }

    fn tells(&self) -> &'static [&'static str] {
        self.actor.tells()
    }
}

struct Slipping<'a> {
    of: Box<dyn Acting + 'a>,
    share: f64,
    n_actions: usize,
}

impl Acting for Slipping<'_> {
    fn begin(&mut self) {
        self.of.begin();
    }

    fn rest(&mut self, lanes: &[usize]) {
        self.of.rest(lanes);
    }

    fn tell(&self, lane: usize, told: &mut Vec<f32>) {
        self.of.tell(lane, told);
    }

    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        self.of.act(seen, rng, acts)?;
        for place in &mut acts.places {
            if rng.random::<f64>() < self.share {
                *place = rng.random_range(0..self.n_actions);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Random;
    use super::*;
    use ivx_data::{Actions, Field, Kind};
    use rand::SeedableRng as _;

    /// Somebody who does the first.
    #[derive(Debug)]
    struct First;

    impl Actor for First {
        fn fits(&self, _: &Spec) -> Result<(), Misfit> {
            Ok(())
        }
        fn open(&self, _: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
            Ok(Box::new(Self))
        }
    }

    impl Acting for First {
        fn act(&mut self, _: &Columns, _: &mut ChaCha8Rng, acts: &mut Acts) -> Result<(), OpError> {
            acts.places.fill(0);
            Ok(())
        }
    }

    #[test]
    fn it_slips_as_often_as_it_is_told() {
        let (sees, does) = (vec![Field::new("x", &[], Kind::F32)], Actions::named(&["A", "B"]));
        let spec = Spec { sees: sees.clone(), does, tells: Vec::new(), limit: None };
        let others = |actor: Box<dyn Actor>, share| {
            let noisy = Noisy { actor, share };
            let mut acts = Acts::of(&spec.does, 10_000);
            let mut rng = ChaCha8Rng::seed_from_u64(2);
            let seen = Columns::zeros(sees.clone(), 10_000);
            noisy.open(&spec).unwrap().act(&seen, &mut rng, &mut acts).unwrap();
            acts.places.iter().sum::<usize>()
        };
        assert_eq!(others(Box::new(First), 0.0), 0);
        // Half of slips do the second.
        assert!((400..600).contains(&others(Box::new(First), 0.1)));
        assert!((4800..5200).contains(&others(Box::new(Random {}), 0.3)));
    }
}
