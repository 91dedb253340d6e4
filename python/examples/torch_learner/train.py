"""Trains a network of PyTorch on data.npz and scores it on test.npz.

Writes score.json and model.safetensors, which ivx reads. All that it depends on is in its arguments and files.
"""

import argparse

import torch

from ivx import node


def read(path):
    """Inputs and targets, ``[n, 1]`` each, of double precision."""
    data = node.dataset(path)
    return torch.from_numpy(data.inputs)[:, None], torch.from_numpy(data.targets)[:, None]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--hidden", type=int)
    parser.add_argument("--lr", type=float)
    parser.add_argument("--steps", type=int)
    parser.add_argument("--seed", type=int)
    args = parser.parse_args()

    torch.manual_seed(args.seed)
    torch.set_num_threads(1)
    layers = [torch.nn.Linear(1, args.hidden).double(), torch.nn.Linear(args.hidden, 1).double()]
    net = torch.nn.Sequential(layers[0], torch.nn.Tanh(), layers[1])
    optimiser = torch.optim.Adam(net.parameters(), lr=args.lr)
    x, y = read("data.npz")
    losses = []
    for _ in range(args.steps):
        optimiser.zero_grad()
        loss = torch.nn.functional.mse_loss(net(x), y)
        loss.backward()
        optimiser.step()
        losses.append(loss.item())

    x, y = read("test.npz")
    with torch.no_grad():
        rmse = torch.nn.functional.mse_loss(net(x), y).sqrt()
    node.write_scalars("score.json", {"rmse": rmse, "losses": losses})
    # What PyTorch keeps as [out, in] is [in, out] here.
    weights = [layer.weight.detach().T for layer in layers]
    node.write_model("model.safetensors", weights, [layer.bias.detach() for layer in layers], "tanh")


main()
