"""For a program that runs as a node, by ``command``: reads what ivx gives it, and writes what ivx reads.

Files lie in the working folder, and the extension of a name says how one is written. ``.json`` needs the standard
library alone, all else ``pip install 'ivx[node]'``.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ._binary import PathLike, need

__all__ = [
    "Array",
    "Dataset",
    "Network",
    "Polynomial",
    "array",
    "dataset",
    "read_model",
    "scalar",
    "write_dataset",
    "write_model",
    "write_scalars",
]


class Dataset(NamedTuple):
    """Observations: ``inputs`` ``[n, ..]`` and ``targets`` ``[n, ..]``, of double precision.

    ``names`` are those of the numbers of an input, where they have some.
    """

    inputs: Any
    targets: Any
    names: list[str]


class Array(NamedTuple):
    """``values`` ``[len(labels), ..]`` with labels of each dimension, by the dimension's name."""

    values: Any
    dims: dict[str, list[Any]]


class Network(NamedTuple):
    """Dense layers: ``weights`` of shape ``[in, out]``, ``biases`` of shape ``[out]``, and what follows hidden ones."""

    weights: list[Any]
    biases: list[Any]
    activation: str


class Polynomial(NamedTuple):
    """``theta[0] + theta[1] x + ..``."""

    theta: Any


def scalar(path: PathLike) -> float:
    """The number that ``as_file`` wrote as ``.json``."""
    return float(json.loads(Path(path).read_text(encoding="utf-8")))


def array(path: PathLike) -> Array:
    """The array that ``as_file`` wrote as ``.json``."""
    numpy = need("numpy", "node")
    told = json.loads(Path(path).read_text(encoding="utf-8"))
    dims = {dim["name"]: dim["labels"] for dim in told["dims"]}
    values = numpy.array([float(value) for value in told["values"]])
    return Array(values.reshape([len(labels) for labels in dims.values()]), dims)


def dataset(path: PathLike, target: str = "y") -> Dataset:
    """The data set of a ``.csv``, ``.npz`` or ``.safetensors``, as ``as_file`` writes it or otherwise.

    What is not ``target`` is an input: an input of one column is a number. Without a column ``y`` the targets are
    ``y0``, ``y1`` and so on. Raises ValueError if there is no target, or of arrays not one input.
    """
    kind = Path(path).suffix
    if kind == ".csv":
        return _of_text(Path(path), target)
    arrays, metadata = _arrays(Path(path))
    numpy = need("numpy", "node")
    names = []
    if "ivx" in metadata and "names" in arrays:
        names = _inputs(arrays.pop("names").tobytes().decode())
    if target not in arrays:
        raise ValueError(f"{path} has no {target!r}: it has {', '.join(arrays)}")
    targets = arrays.pop(target)
    beside = arrays.pop("beside") if "ivx" in metadata and "beside" in arrays else None
    if len(arrays) != 1:
        raise ValueError(f"{path} has not one input: it has {', '.join(arrays) or 'none'}")
    (inputs,) = arrays.values()
    if beside is not None:
        inputs = numpy.concatenate([inputs.reshape(len(inputs), -1), beside], axis=1)
    return Dataset(inputs.astype(float), targets.astype(float), names)


def write_dataset(path: PathLike, inputs: Any, targets: Any) -> None:
    """Writes what ``read_dataset`` reads, as the extension ``.csv``, ``.npz`` or ``.safetensors`` says.

    ``inputs`` ``[n, ..]`` and ``targets`` ``[n, ..]``; in text each is a column for every number of an observation.
    Raises ValueError if they are not equally many.
    """
    numpy = need("numpy", "node")
    sides = {"x": numpy.asarray(inputs, float), "y": numpy.asarray(targets, float)}
    if sides["x"].ndim == 0 or sides["x"].shape[:1] != sides["y"].shape[:1]:
        raise ValueError(f"inputs of shape {sides['x'].shape} have no targets of shape {sides['y'].shape}")
    kind = Path(path).suffix
    if kind == ".csv":
        columns = {}
        for name, side in sides.items():
            if side.ndim == 1:
                columns[name] = side
            else:
                flat = side.reshape(len(side), -1)
                columns.update({f"{name}{i}": flat[:, i] for i in range(flat.shape[1])})
        rows = zip(*(column.tolist() for column in columns.values()))
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    elif kind == ".npz":
        numpy.savez(path, **sides)
    elif kind == ".safetensors":
        _save(sides, path, None)
    else:
        raise ValueError(f"{path} ends in none of .csv, .npz and .safetensors")


def write_scalars(path: PathLike, values: Any) -> None:
    """Writes numbers, in dicts and lists, as ``read_scalar`` and ``read_array`` read them.

    Such as ``{"test": {"rmse": 0.1}}``. Numbers and arrays of other packages are taken by their ``tolist()``.
    """

    def plain(value: Any) -> Any:
        if hasattr(value, "tolist"):
            return value.tolist()
        raise TypeError(f"a {type(value).__name__} is no number")

    Path(path).write_text(json.dumps(values, default=plain) + "\n", encoding="utf-8")


def write_model(path: PathLike, weights: Sequence[Any], biases: Sequence[Any], activation: str) -> None:
    """Writes a network of dense layers as ``read_model`` reads it.

    ``weights[i]`` has the shape ``[in, out]`` (that of PyTorch's ``Linear`` is its transpose) and ``biases[i]`` the
    shape ``[out]``. ``activation``, such as ``"tanh"``, follows each layer but the last. Raises ValueError if shapes
    do not fit.
    """
    numpy = need("numpy", "node")
    arrays, before = {}, None
    if len(weights) != len(biases) or not weights:
        raise ValueError(f"{len(weights)} weights and {len(biases)} biases are no layers")
    for i, sides in enumerate(zip(weights, biases)):
        weight, bias = (numpy.asarray(side) for side in sides)
        if weight.ndim != 2 or bias.shape != weight.shape[1:] or before not in (None, weight.shape[0]):
            raise ValueError(f"layer {i} does not fit: its weight is {weight.shape}, its bias {bias.shape}")
        before = weight.shape[1]
        arrays[f"{i}.weight"], arrays[f"{i}.bias"] = weight, bias
    _save(arrays, path, {"activation": activation})


def read_model(path: PathLike) -> Network | Polynomial:
    """The network of dense layers, or the polynomial, that ``as_file`` or a program wrote as ``.safetensors``.

    Raises ValueError if it is another model.
    """
    arrays, metadata = _arrays(Path(path))
    if list(arrays) == ["theta"]:
        return Polynomial(arrays["theta"])
    activation = metadata.get("activation", "")
    if header := metadata.get("ivx"):
        layers = re.search(r"module:Sequence\(\[((?:Dense\([^()]*\),?)+)\]\)", header)
        if layers is None or not re.search(r"prior_scale:0\.0\)", header):
            raise ValueError(f"{path} is no network of dense layers alone: {header[:200]}")
        curves = set(re.findall(r"curve:(\w+)", layers[1])[:-1]) or {"Identity"}
        if len(curves) != 1:
            raise ValueError(f"the layers of {path} have several activations: {', '.join(sorted(curves))}")
        activation = curves.pop().lower()
    n_layers = len(arrays) // 2
    named = [[arrays.get(f"{i}.{side}") for i in range(n_layers)] for side in ("weight", "bias")]
    if len(arrays) % 2 or not arrays or any(side is None for sides in named for side in sides):
        raise ValueError(f"{path} is no network of dense layers alone: it has {', '.join(arrays)}")
    return Network(named[0], named[1], activation)


def _of_text(path: Path, target: str) -> Dataset:
    numpy = need("numpy", "node")
    with path.open(newline="", encoding="utf-8") as file:
        names, *rows = list(csv.reader(file))
    numbers = numpy.array([[float(cell) for cell in row] for row in rows if row]).reshape(-1, len(names))
    targets = [name for name in names if name == target]
    if not targets and target == "y":
        targets = [name for name in names if re.fullmatch(r"y\d+", name)]
    if not targets:
        raise ValueError(f"{path} has no column {target!r}: it has {', '.join(names)}")
    inputs = [name for name in names if name not in targets]

    def side(own: list[str]) -> Any:
        # `x0` alone was a vector of one number.
        is_number = len(own) == 1 and own[0] not in ("x0", "y0")
        return numbers[:, names.index(own[0])] if is_number else numbers[:, [names.index(name) for name in own]]

    return Dataset(side(inputs), side(targets), inputs)


def _arrays(path: Path) -> tuple[dict[str, Any], Mapping[str, str]]:
    """Arrays by name, and the metadata where there is some."""
    if path.suffix == ".npz":
        with need("numpy", "node").load(path) as file:
            return dict(file), {}
    if path.suffix != ".safetensors":
        raise ValueError(f"{path} ends in none of .csv, .npz and .safetensors")
    need("numpy", "node")
    with need("safetensors", "node").safe_open(path, framework="numpy") as file:
        return {name: file.get_tensor(name) for name in sorted(file.keys())}, file.metadata() or {}


def _save(arrays: dict[str, Any], path: PathLike, metadata: Any) -> None:
    contiguous = need("numpy", "node").ascontiguousarray
    # safetensors.numpy wants memory in order.
    need("safetensors.numpy", "node").save_file({name: contiguous(a) for name, a in arrays.items()}, path, metadata)


def _inputs(ron: str) -> list[str]:
    """The names of inputs as ivx keeps them: ``(inputs:["a","b"],classes:[])``."""
    listed = re.match(r'\(inputs:(\[(?:"(?:[^"\\]|\\.)*",?)*\])', ron)
    names: list[str] = json.loads(re.sub(r"\\u\{(\w+)\}", lambda m: chr(int(m[1], 16)), listed[1])) if listed else []
    return names
