//! Advice on calls: what other languages and libraries call an argument or an operation.

use ivx_op::{ArgKind, Decl, Role, Ty};

use super::Checker;
use super::library::Library;
use crate::ast;
use crate::{Advice, suggest};

impl Library<'_> {
    /// How an argument that a call does not have is written here.
    pub(super) fn argument_help(&self, owner: &str, name: &str, names: &[&str]) -> Option<Advice> {
        let nearest = suggest(name, names.iter().copied());
        if nearest.as_ref().is_some_and(Advice::is_near) {
            return nearest;
        }
        if is_seed(name) && !names.contains(&name) {
            let help = "random numbers follow an axis: declare `axis seed = 0..5`; `stream` tells \
                        two draws on one seed apart";
            return Some(help.into());
        }
        let meant = synonyms(name);
        if let Some(own) = meant.iter().find(|meant| names.contains(meant)) {
            let instead = Some(Box::new((name.to_owned(), (*own).to_owned())));
            return Some(Advice { said: format!("it is called `{own}` here"), instead });
        }
        // The argument may be one of a part that the call takes.
        let decl = self.registry().decl(owner);
        let owners: Vec<String> = decl.map_or_else(Vec::new, |decl| {
            let parts = self.parts_of(decl);
            let wanted = [name].into_iter().chain(meant.iter().copied());
            wanted
                .flat_map(|wanted| {
                    let has = parts.iter().filter(move |part| part.arg(wanted).is_some());
                    has.map(move |part| format!("`{}({wanted}: ..)`", part.name))
                })
                .take(4)
                .collect()
        });
        if owners.is_empty() {
            return nearest;
        }
        Some(format!("write it as {}", owners.join(", ")).into())
    }

    /// The parts that a call can be given, however deep.
    fn parts_of(&self, decl: &Decl) -> Vec<&Decl> {
        let mut families: Vec<String> = Vec::new();
        let mut found: Vec<&Decl> = Vec::new();
        let mut todo: Vec<&Decl> = vec![decl];
        while let Some(decl) = todo.pop() {
            for arg in &decl.args {
                let ArgKind::Literal(ty) = &arg.kind else { continue };
                let Some(family) = family(ty).filter(|own| !families.iter().any(|f| f == own))
                else {
                    continue;
                };
                families.push(family.to_owned());
                let own = self.parts(family);
                found.extend(&own);
                todo.extend(own);
            }
        }
        found
    }
}

impl Checker<'_> {
    /// How a value of another type is written as the type asks for.
    pub(super) fn written_as(&self, ty: &Ty, found: &Ty, expr: &ast::Expr) -> Option<String> {
        let written = self.source.text(expr.span)?;
        let short = !written.contains('\n') && written.len() <= 40;
        match (ty, found) {
            (Ty::List(item), own) if **item == *own && short => {
                Some(format!("write a list: `[{written}]`"))
            }
            (Ty::Int | Ty::Float | Ty::Str | Ty::Bool, Ty::List(_)) => Some(
                "one value goes here; for each of several declare an axis, `axis a = [..]`, and \
                 write `a`"
                    .to_owned(),
            ),
            (Ty::Int, Ty::Float) => match &expr.kind {
                #[expect(clippy::cast_possible_truncation, reason = "whole and small")]
                ast::ExprKind::Float(x) if x.fract() == 0.0 && x.abs() < 1e15 => {
                    Some(format!("write it as a whole number: `{}`", *x as i64))
                }
                _ => None,
            },
            (Ty::Part(family), Ty::Str) => {
                let ast::ExprKind::Str(name) = &expr.kind else { return None };
                let decl = self.library.registry().decl(&name.to_ascii_lowercase())?;
                let is_own = matches!(decl.role, Role::Part(own) if own == family);
                is_own.then(|| format!("write it without quotes: `{}()`", decl.name))
            }
            (Ty::Bool, Ty::Int) => match &expr.kind {
                ast::ExprKind::Int(n) => Some(format!("write `{}`", *n != 0)),
                _ => None,
            },
            (Ty::Str, Ty::Int | Ty::Float) if short => Some(format!("write `\"{written}\"`")),
            _ => None,
        }
    }
}

/// The family of parts that a type names.
fn family(ty: &Ty) -> Option<&str> {
    match ty {
        Ty::Part(family) => Some(family),
        Ty::List(item) => family(item),
        _ => None,
    }
}

fn is_seed(name: &str) -> bool {
    matches!(name, "seed" | "seeds" | "random_state" | "random_seed" | "rng" | "key" | "generator")
}

/// What arguments of other libraries are called here, the likeliest first.
fn synonyms(name: &str) -> &'static [&'static str] {
    match name {
        "learning_rate" | "step_size" | "eta" | "alpha" | "lr" => &["lr", "rate"],
        "epochs" | "epoch" | "n_steps" | "num_steps" | "iterations" | "n_iter" | "max_iter"
        | "iters" | "updates" | "n_epochs" | "num_epochs" | "max_steps" | "steps" => {
            &["steps", "epochs", "passes"]
        }
        "n_samples" | "num_samples" | "samples" | "size" | "count" | "number" | "num" => {
            &["n", "points", "size"]
        }
        "n_points" | "num_points" => &["points", "n"],
        "batch_size" | "minibatch" | "minibatch_size" => &["batch"],
        "optimizer" | "optim" | "opt" => &["optimiser"],
        "hidden_sizes" | "hidden_layers" | "layers" | "units" | "width" | "hidden_dim"
        | "hidden_units" | "n_hidden" | "sizes" => &["hidden", "units", "layers"],
        "activation_fn" | "nonlinearity" | "act" => &["activation"],
        "gamma" | "discount_factor" => &["discount"],
        "n_episodes" | "num_episodes" | "total_timesteps" | "timesteps" => &["episodes"],
        "horizon" | "max_episode_steps" | "max_length" => &["limit", "n"],
        "eps" | "exploration" => &["epsilon", "eps"],
        "n_members" | "n_models" | "ensemble_size" | "n_estimators" | "num_models" | "k" => {
            &["members"]
        }
        "data" | "dataset" | "x" | "train_data" | "inputs" => &["on", "from", "at"],
        "axis" | "dim" | "axes" | "dims" | "across" => &["over", "by"],
        "env" | "environment" | "world" => &["in", "of"],
        "hue" | "color" | "colour" | "group" | "groupby" | "series" => &["by"],
        "col" | "row" | "panel" | "panels" | "facets" => &["facet", "columns", "rows"],
        "xlabel" => &["x_label"],
        "ylabel" => &["y_label"],
        "std" | "sigma" | "scale" | "noise_std" | "sd" => &["noise", "std", "scale"],
        "loss_fn" | "criterion" | "objective" => &["loss"],
        "network" | "architecture" => &["net"],
        "dropout" | "p" => &["rate"],
        "l2" | "weight_decay" | "decay" => &["weight_decay", "prior"],
        "ndigits" | "precision" | "decimals" => &["digits"],
        "low" | "start" | "minimum" => &["low", "from"],
        "high" | "stop" | "maximum" => &["high", "to"],
        _ => &[],
    }
}

/// What a function of other languages is here.
pub(super) fn call_help(name: &str) -> Option<&'static str> {
    Some(match name {
        "range" | "arange" | "xrange" | "seq" => {
            "an axis is `axis x = 0..5`, places are `grid(0.0, 1.0, points: 11)`"
        }
        "linspace" => "write `grid(0.0, 1.0, points: 11)`",
        "square" => "write `pow(x, 2)`",
        "ln" | "log1p" => "the natural logarithm is `log(x)`",
        "log10" | "log2" => "write `log(x) / log(10.0)`",
        "power" => "write `pow(x, y)`",
        "clamp" => "write `clip(x, low, high)`",
        "tan" => "write `sin(x) / cos(x)`",
        "logspace" | "geomspace" => "write `pow(10.0, [-3, -2, -1])`",
        "len" | "length" | "count" | "shape" => {
            "sums over a dimension count it: `sum(x * 0.0 + 1.0, over: n)`"
        }
        "print" | "println" | "show" | "display" => {
            "what is to be seen is a `measure`, `figure` or `table`"
        }
        "int" | "float" | "str" | "bool" | "Int" | "Float" | "Str" => {
            "values are not converted; an Int serves where a Float is asked for"
        }
        "list" | "array" | "tensor" | "zeros" | "ones" => "a list is written `[1, 2]`",
        "dict" | "tuple" | "zip" | "enumerate" | "map" | "filter" | "apply" => {
            "an expression has a value for each label of the axes that it mentions"
        }
        "average" | "avg" | "nanmean" => "write `mean(x, over: seed)`",
        "stdev" | "sd" | "var" | "variance" => {
            "write `std(x, over: seed)`; a variance is `std(..) * std(..)`"
        }
        "fit" | "learn" | "optimize" | "optimise" => {
            "write `train(learner, on: data, steps: 1_000)`"
        }
        "mse" | "mae" | "loss" | "score" | "error" => {
            "write `rmse(model, on: data)` or `nll(model, on: data)`"
        }
        "line" | "lineplot" | "chart" => "write `lines(x, x: n)`",
        "barplot" | "bar" => "write `bars(x, by: method)`",
        "hist" => "write `histogram(x)`",
        "imshow" | "matrix" => "write `heatmap(x, x: a, y: b)`",
        "randn" | "normal_sample" | "rand" | "random" | "uniform" => {
            "random numbers are drawn by `sample(..)`, `examples(..)` or `act(..)`"
        }
        "linear_regression" | "LinearRegression" | "ols" => {
            "write `train(linear_mle(features: polynomial(degree: 1)), on: data)`"
        }
        "MLP" | "nn" | "neural_network" | "network" => "write `mlp(hidden: [64, 64])`",
        "if" | "ifelse" | "cond" => {
            "write `where(condition, a, b)`, or choose along an axis: `match method { \"a\": 1, \"b\": 2 }`"
        }
        _ => return None,
    })
}
