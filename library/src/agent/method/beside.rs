//! Cloning beside another method (§4.1).

use ivx_data::Misfit;
use ivx_data::form::failed;
use ivx_nn::{Live, Module, Net, Networks, Var, headed};
use ivx_op::{Ctx, Facts, Lit, OpError, Part, Wrong, declare};
use ivx_world::Spec;

use super::super::agent::{TORSO, sight};
use super::bc::{Bc, Examples, shown_in};
use super::{Learning, Method, Setting};

declare! {
    /// A method with the loss of cloning others beside its own (Eqn. 4.3; Hernandez-Leal et al., 2019): `L + λ L_BC`, of
    /// as many steps of demonstrations in each update as `bc` looks at.
    ///
    /// A linear map of its own says what others do, of what the layers before the last make of what is seen. These it
    /// shares with the method, so that cloning shapes what that learns by: with the action values of `dqn`, and with the
    /// policy of `ppo` and `a2c`, and their values if those share layers. All else is as in the method, whose optimiser
    /// lowers the sum.
    pub struct Beside = "beside" @ 1 {
        /// How it learns by acting: `dqn(..)`, `ppo(..)` or `a2c(..)`.
        method: Box<dyn Method>;
        /// Whom it clones, `bc(..)`, and in which batches. Layers and optimiser are those of the method.
        cloning: Box<dyn Method>;
        /// The weight `λ` of the loss of cloning.
        weight: f64 = 1.0, in 0.0..;
    }
    rule nothing_is_ignored;
}

/// What is said of cloning that the method decides.
fn nothing_is_ignored(facts: &Facts<'_>) -> Result<(), Wrong> {
    let part = |name: &str| match facts.args.get(name) {
        Some(Lit::Part(part)) => Some(part),
        _ => None,
    };
    let (Some(method), Some(cloning)) = (part("method"), part("cloning")) else { return Ok(()) };
    let usual = crate::registry().complete(&Part::new("bc"));
    for name in ["net", "optimiser", "greedy"] {
        let said = cloning.args.get(name);
        let is_known = [&usual, method].iter().any(|part| part.args.get(name) == said);
        if cloning.name == usual.name && !is_known {
            let message = format!("cloning beside `{}` has no `{name}` of its own", method.name);
            let help = format!("leave `{name}` of `bc` out, or write that of `{}`", method.name);
            return Err(Wrong { arg: "cloning", message, help });
        }
    }
    Ok(())
}

/// A method whose layers others can learn by beside it.
pub trait Shares {
    /// The layers up to the last linear map.
    fn net(&self) -> &dyn Net;

    /// An agent that has learned nothing yet, and learns by this too.
    ///
    /// # Errors
    /// If there can be none.
    fn begin_beside<'a>(
        &'a self,
        cloning: Option<Cloning<'a>>,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError>;
}

impl Beside {
    fn parts(&self) -> Result<(&dyn Shares, &Bc), Misfit> {
        let misfit = |message: &str, help| Misfit::new(message.to_owned(), help);
        let shares = self.method.shares().ok_or_else(|| {
            misfit("the method has no layers to share", "use `dqn(..)`, `ppo(..)` or `a2c(..)`")
        })?;
        let cloned = self.cloning.cloned().ok_or_else(|| {
            misfit("what is beside a method is cloning", "write `beside(.., bc(shown))`")
        })?;
        Ok((shares, cloned))
    }
}

impl Method for Beside {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        let (shares, cloned) = self.parts()?;
        shown_in(&cloned.shown, setting.spec)?;
        head(shares.net(), setting.spec)?;
        self.method.fits(setting)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        self.method.memory(setting) + self.cloning.memory(setting)
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let (shares, cloned) = self.parts().map_err(failed)?;
        let examples = Examples::new(&cloned.shown, cloned.batch, ctx)?;
        let cloning = Cloning { examples, weight: self.weight };
        shares.begin_beside(Some(cloning), setting, ctx)
    }
}

/// What the network is called that says what others do.
pub(super) const CLONE: &str = "clone";

/// Cloning as part of a loss.
#[derive(Debug)]
pub struct Cloning<'a> {
    examples: Examples<'a>,
    weight: f64,
}

/// The linear map that says what others do.
fn head(net: &dyn Net, spec: &Spec) -> Result<Module, Misfit> {
    let module = headed(net, &sight(&spec.sees), &[spec.does.n_discrete()?])?;
    let Module::Sequence(mut layers) = module else { unreachable!("it has a head") };
    let head = layers.pop().expect("it has a head");
    if layers.iter().map(Module::n_params).sum::<u64>() == 0 {
        let message = "the method has no layers before the last to share".to_owned();
        return Err(Misfit::new(message, "give it such, as `net: mlp(hidden: [64])`"));
    }
    Ok(head)
}

/// Adds the network that says what others do to those of a method.
pub(super) fn join(
    nets: &mut Networks,
    net: &dyn Net,
    spec: &Spec,
    ctx: &Ctx,
) -> Result<(), OpError> {
    let modules = [(String::new(), head(net, spec).map_err(failed)?)].into();
    nets.add(CLONE, Networks::drawn(modules, &mut ctx.rng("init", &[CLONE])));
    Ok(())
}

impl Cloning<'_> {
    /// The loss of update `t` with that of cloning beside it, and that of cloning alone.
    ///
    /// - `net`: the network of which all layers but the last are shared, where networks share none as a whole.
    pub(super) fn beside(&mut self, t: u64, live: &Live, net: &str, loss: Var) -> [Var; 2] {
        let (x, acts) = self.examples.draw(t, &live.graph);
        let shared = match live.get(TORSO) {
            Some(_) => live.pass(TORSO, x),
            None => live.pass_to_last(net, x),
        };
        live.graph.with_cloning(loss, (live.pass(CLONE, shared), acts), self.weight)
    }
}
