//! Bayesian regression on polynomials.

use ivx_data::{Dataset, Posterior};
use ivx_library::learner::{
    Inference, Learner, LinearBayes, LinearMap, LinearMle, Normal, Polynomial,
};
use ivx_math::linear_gaussian::{
    Regression, neg_log_likelihood, neg_log_posterior_gradient, neg_log_prior, powers,
};
use ivx_math::moments::mean;
use ivx_nn::Model;
use ivx_op::Ctx;
use ivx_world::{Reward, Sinusoids};
use nalgebra::DVector;
use serde_json::{Value, json};

use crate::harness::{Case, check, number, numbers, text};

#[test]
fn golden_bayes_poly_regression() {
    check("bayes_poly_regression", |case, path| {
        let [key] = path else { return None };
        match case.kind.as_str() {
            "bayes_poly" => bayes_poly(case, key),
            "rstar" => rstar(case, key),
            _ => None,
        }
    });
}

fn rstar(case: &Case, key: &str) -> Option<Value> {
    let rewards = numbers(&case.inputs["a"]).into_iter().map(|a| Sinusoids {}.mean(a));
    (key == "r").then(|| json!(rewards.collect::<Vec<_>>()))
}

fn bayes_poly(case: &Case, key: &str) -> Option<Value> {
    let inputs = &case.inputs;
    let data = Dataset::pairs(numbers(&inputs["a"]), numbers(&inputs["r"]));
    let half: Vec<usize> = (0..data.x.len() / 2).collect();
    let grid = numbers(&inputs["grid"]);
    let map = map(inputs, &data);
    let posterior = infer(inputs, &data);
    match key {
        "posterior_mean" => Some(json!(posterior.mean)),
        "posterior_mean_first_half" => Some(json!(infer(inputs, &data.pick(&half)).mean)),
        "predictive_mean" => Some(json!(posterior.mean_at(&grid))),
        "predictive_var_epistemic" => Some(json!(posterior.variance_at(&grid))),
        "predictive_var_total" => {
            let ignorance = posterior.variance_at(&grid).into_iter();
            Some(json!(ignorance.map(|v| v + posterior.noise.powi(2)).collect::<Vec<_>>()))
        }
        "map" => Some(json!(map)),
        "log_evidence" => Some(json!(posterior.log_evidence)),
        "posterior_cov" => {
            let rows = 0..map.len();
            Some(json!(rows.map(|i| covariance_row(&posterior, i)).collect::<Vec<_>>()))
        }
        "posterior_cov_diag" => {
            let places = 0..map.len();
            Some(json!(places.map(|i| posterior.covariance(i, i)).collect::<Vec<_>>()))
        }
        "posterior_cov_first_row" => Some(json!(covariance_row(&posterior, 0))),
        "mle" => Some(json!(mle(inputs, &data))),
        "mle_train_rmse" => {
            let predicted = Model::Polynomial(mle(inputs, &data)).predict(&data.x);
            let errors = predicted.iter().zip(&data.y).map(|(a, b)| (a - b).powi(2));
            Some(json!(mean(&errors.collect::<Vec<_>>()).sqrt()))
        }
        "mle_norm_exceeds_map_norm" => Some(json!(norm(&mle(inputs, &data)) > norm(&map))),
        "neg_log_lik_at_map" => {
            Some(json!(neg_log_likelihood(&regression(inputs, &data), &DVector::from(map))))
        }
        "neg_log_prior_at_map" => {
            Some(json!(neg_log_prior(&regression(inputs, &data), &DVector::from(map))))
        }
        "grad_neg_log_posterior_at_zero" => {
            let zero = DVector::zeros(map.len());
            let gradient = neg_log_posterior_gradient(&regression(inputs, &data), &zero);
            Some(json!(gradient.as_slice()))
        }
        _ => None,
    }
}

fn features(inputs: &Value) -> Polynomial {
    let degree = inputs["degree"].as_u64().and_then(|degree| usize::try_from(degree).ok());
    Polynomial { degree: degree.expect("a degree") }
}

fn prior(inputs: &Value) -> Normal {
    assert_eq!(text(&inputs["prior"]), "N(0,I)", "the only prior of these cases");
    Normal { mean: 0.0, std: 1.0 }
}

fn noise(inputs: &Value) -> f64 {
    number(&inputs["noise_var"]).sqrt()
}

fn infer(inputs: &Value, data: &Dataset) -> Posterior {
    let bayes = LinearBayes {
        features: Box::new(features(inputs)),
        prior: Box::new(prior(inputs)),
        noise: noise(inputs),
    };
    bayes.infer(data).expect("any data give a belief")
}

fn map(inputs: &Value, data: &Dataset) -> Vec<f64> {
    let features = Box::new(features(inputs));
    let prior = Box::new(prior(inputs));
    coefficients(&LinearMap { features, prior, noise: noise(inputs) }, data)
}

fn mle(inputs: &Value, data: &Dataset) -> Vec<f64> {
    coefficients(&LinearMle { features: Box::new(features(inputs)) }, data)
}

fn coefficients(learner: &dyn Learner, data: &Dataset) -> Vec<f64> {
    let ctx = Ctx::new("train", 0, None);
    match learner.train(data, 0, &ctx) {
        Ok(Model::Polynomial(theta)) => theta,
        other => panic!("expected coefficients, found {other:?}"),
    }
}

fn regression(inputs: &Value, data: &Dataset) -> Regression {
    let prior = prior(inputs);
    Regression {
        design: powers(&data.x, features(inputs).degree),
        targets: DVector::from(data.y.clone()),
        noise: noise(inputs),
        prior_mean: prior.mean,
        prior_std: prior.std,
    }
}

fn covariance_row(posterior: &Posterior, i: usize) -> Vec<f64> {
    (0..posterior.mean.len()).map(|j| posterior.covariance(i, j)).collect()
}

fn norm(theta: &[f64]) -> f64 {
    theta.iter().map(|c| c * c).sum::<f64>().sqrt()
}
