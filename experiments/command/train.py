"""Trains a regressor of scikit-learn on data.csv and scores it on test.csv.

Writes score.json and model.safetensors, which ivx reads. All that it depends on is in its arguments and files.
"""

import argparse
import json

import numpy as np
from safetensors.numpy import save_file
from sklearn.linear_model import Ridge
from sklearn.metrics import root_mean_squared_error
from sklearn.neural_network import MLPRegressor
from sklearn.preprocessing import PolynomialFeatures


def read(path):
    table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return table[:, :1], table[:, 1]


def ridge(args, x, y):
    """The polynomial that minimises |y - f(x)|² + alpha |coefficients|²."""
    powers = PolynomialFeatures(args.degree)
    model = Ridge(alpha=args.alpha, fit_intercept=False, solver="svd").fit(powers.fit_transform(x), y)
    arrays = {"theta": model.coef_}
    return lambda x: model.predict(powers.transform(x)), arrays, {}


def mlp(args, x, y):
    """A network with one hidden layer, trained on all data at each step."""
    model = MLPRegressor(
        hidden_layer_sizes=(args.hidden,),
        activation="tanh",
        solver="adam",
        alpha=0.0,
        batch_size=len(y),
        learning_rate_init=args.lr,
        max_iter=args.steps,
        n_iter_no_change=args.steps,
        tol=0.0,
        random_state=args.seed,
    ).fit(x, y)
    arrays = {}
    for i, (weight, bias) in enumerate(zip(model.coefs_, model.intercepts_)):
        arrays |= {f"{i}.weight": np.ascontiguousarray(weight), f"{i}.bias": bias}
    return model.predict, arrays, {"activation": "tanh"}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("method", choices=["ridge", "mlp"])
    parser.add_argument("--degree", type=int)
    parser.add_argument("--alpha", type=float)
    parser.add_argument("--hidden", type=int)
    parser.add_argument("--lr", type=float)
    parser.add_argument("--steps", type=int)
    parser.add_argument("--seed", type=int)
    args = parser.parse_args()
    predict, arrays, metadata = {"ridge": ridge, "mlp": mlp}[args.method](args, *read("data.csv"))
    x, y = read("test.csv")
    with open("score.json", "w") as file:
        json.dump({"test": {"rmse": root_mean_squared_error(y, predict(x)), "n": len(y)}}, file)
    save_file(arrays, "model.safetensors", metadata=metadata)


main()
