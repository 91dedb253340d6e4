import pytest

import ivx

numpy = pytest.importorskip("numpy")
pytest.importorskip("safetensors")

from ivx import node  # noqa: E402


def test_data_sets_are_read_as_they_were_written(tmp_path):
    random = numpy.random.default_rng(0)
    for shape, target in [((), ()), ((1,), ()), ((3,), (2,)), ((3, 2), (1,))]:
        x, y = random.normal(size=(4, *shape)), random.normal(size=(4, *target))
        for kind in ("csv", "npz", "safetensors"):
            path = tmp_path / f"data.{kind}"
            node.write_dataset(path, x, y)
            data = node.dataset(path)
            flat = x if len(shape) < 2 or kind != "csv" else x.reshape(4, -1)
            assert (data.inputs == flat).all() and data.inputs.shape == flat.shape
            assert (data.targets == y).all() and data.targets.shape == y.shape
    (tmp_path / "trees.csv").write_text('girth,"tall, or high",volume\n8.3,70,10.3\n8.6,65,10.3\n')
    trees = node.dataset(tmp_path / "trees.csv", target="volume")
    assert trees.names == ["girth", "tall, or high"]
    assert trees.inputs.tolist() == [[8.3, 70], [8.6, 65]] and trees.targets.tolist() == [10.3, 10.3]
    (tmp_path / "one.csv").write_text("depth,y\n1,2\n")
    assert node.dataset(tmp_path / "one.csv").inputs.tolist() == [1]


def test_what_is_no_data_set_is_told(tmp_path):
    with pytest.raises(ValueError, match="no targets of shape"):
        node.write_dataset(tmp_path / "d.npz", [1, 2], [1])
    for path in (tmp_path / "d.txt", "d.txt"):
        with pytest.raises(ValueError, match="ends in none of"):
            node.write_dataset(path, [1], [1])
    node.write_dataset(tmp_path / "d.csv", [1], [1])
    with pytest.raises(ValueError, match="no column 'z': it has x, y"):
        node.dataset(tmp_path / "d.csv", target="z")
    numpy.savez(tmp_path / "d.npz", a=[1], b=[1], y=[1])
    with pytest.raises(ValueError, match="not one input: it has a, b"):
        node.dataset(tmp_path / "d.npz")
    with pytest.raises(ValueError, match="no 'z': it has a, b, y"):
        node.dataset(tmp_path / "d.npz", target="z")


def test_numbers_are_written_as_json(tmp_path):
    path = tmp_path / "s.json"
    node.write_scalars(path, {"a": numpy.float32(0.5), "b": {"c": numpy.arange(3)}, "d": float("nan")})
    assert path.read_text() == '{"a": 0.5, "b": {"c": [0, 1, 2]}, "d": NaN}\n'
    with pytest.raises(TypeError, match="a set is no number"):
        node.write_scalars(path, {1})


def test_models_are_layers_that_fit(tmp_path):
    path = tmp_path / "m.safetensors"
    weights, biases = [numpy.ones((1, 3)), numpy.zeros((3, 2))], [numpy.ones(3), numpy.ones(2)]
    node.write_model(path, [weights[0], numpy.zeros((2, 3)).T], biases, "relu")
    net = node.read_model(path)
    assert net.activation == "relu" and [w.shape for w in net.weights] == [(1, 3), (3, 2)]
    assert all((a == b).all() for a, b in zip(net.weights + net.biases, weights + biases))
    for own, why in [
        ((weights[:1], biases), "are no layers"),
        (([], []), "are no layers"),
        (([weights[0], weights[1].T], biases), "layer 1 does not fit"),
        (([weights[0].T, weights[1]], biases), "layer 0 does not fit"),
        (([weights[1], weights[1]], [biases[1], biases[1]]), "layer 1 does not fit"),
    ]:
        with pytest.raises(ValueError, match=why):
            node.write_model(path, *own, "relu")
    node.write_dataset(path, [1], [1])
    with pytest.raises(ValueError, match="no network of dense layers alone: it has x, y"):
        node.read_model(path)


def test_what_ivx_keeps_beside_and_names_is_read(tmp_path):
    from safetensors.numpy import save_file

    path = tmp_path / "d.safetensors"
    arrays = {
        "x": numpy.arange(12, dtype=numpy.uint8).reshape(2, 1, 2, 3),
        "beside": numpy.array([[0.5], [1.5]]),
        "y": numpy.array([1.0, 0.0]),
        "names": numpy.frombuffer(rb'(inputs:["a","\"\u{e9}\\"],classes:["no"])', numpy.uint8),
    }
    save_file(arrays, path, {"ivx": '(kind:"Dataset",facts:Some(2))'})
    data = node.dataset(path)
    assert data.inputs.tolist() == [[0, 1, 2, 3, 4, 5, 0.5], [6, 7, 8, 9, 10, 11, 1.5]]
    assert data.inputs.dtype == float and data.names == ["a", '"é\\']


READS = """
import numpy
from ivx import node

def rmse(values, data):
    return ((values - data.targets) ** 2).mean() ** 0.5

data, wide = node.dataset("data.KIND"), node.dataset("wide.KIND")
assert data.inputs.shape == data.targets.shape == (9,)
assert wide.inputs.shape == (4, 2) and wide.targets.shape == (4,)
assert wide.names == {"csv": ["x0", "x1"], "npz": [], "safetensors": ["a", 'b "c"']}["KIND"], wide.names

net = node.read_model("net.safetensors")
assert net.activation == "tanh"
h = data.inputs[:, None]
for i, (weight, bias) in enumerate(zip(net.weights, net.biases)):
    h = h @ weight.astype(float) + bias
    h = numpy.tanh(h) if i < 2 else h
theta = node.read_model("line.safetensors").theta
line = sum(theta[i] * data.inputs**i for i in range(len(theta)))

curves = node.array("curves.json")
assert curves.dims == {"part": ["train", "test"], "epoch": [1, 5, 10]}, curves.dims
assert curves.values[1, 0] == 3 and numpy.isnan(curves.values[0, 2])
node.write_scalars("about.json", {
    "net": rmse(h[:, 0], data), "line": numpy.float64(rmse(line, data)), "read": node.scalar("net.json"),
    "infinite": float("-inf"), "curves": curves.values, "last": wide.inputs[-1, 1] * wide.targets[-1]})
node.write_dataset("twice.KIND", list(data.inputs) * 2, list(data.targets) * 2)
node.write_dataset("wider.KIND", wide.targets, wide.inputs)
node.write_model("again.safetensors", net.weights, net.biases, net.activation)
"""

SPEC = """edition "2026"

experiment e {
    axis seed = 0..2
    axis way = ["net", "line"]
    let data = sample(sinusoids(), n: 9)
    let wide = read_table("wide.csv", target: "y")
    let net  = train(map_estimate(net: mlp(hidden: [4, 3])), on: data, steps: 5)
    let line = train(linear_map(features: polynomial(degree: 2)), on: data)
    let model = match way { "net": net, "line": line }
    measure errors = rmse(model, on: data)
    let curves = load_array("curves.json", dims: [part, epoch], labels: (epoch: [1, 5, 10]))
    let run = command(
        "python3", args: ["reads.py"], files: ["reads.py"],
        inputs: [
            as_file(data, "data.KIND"), as_file(wide, "wide.KIND"),
            as_file(net, "net.safetensors"), as_file(line, "line.safetensors"),
            as_file(errors[way: "net"], "net.json"), as_file(curves, "curves.json"),
        ],
        outputs: ["about.json", "twice.KIND", "wider.KIND", "again.safetensors"])
    measure net_error = read_scalar(run, "about.json", field: "net")
    measure line_error = read_scalar(run, "about.json", field: "line")
    measure read = read_scalar(run, "about.json", field: "read")
    measure last = read_scalar(run, "about.json", field: "last")
    measure infinite = read_scalar(run, "about.json", field: "infinite")
    measure array = read_array(run, "about.json", field: "curves", dims: [first, second])
    measure twice = rmse(model, on: read_dataset(run, "twice.KIND"))
    measure wider = sum(targets(read_dataset(run, "wider.KIND"TARGETS), column: 1), over: row)
    measure again = rmse(read_model(run, "again.safetensors"), on: data)
}
"""


@pytest.mark.parametrize("kind", ["csv", "npz", "safetensors"])
def test_a_program_reads_what_ivx_writes_and_writes_what_it_reads(kind, python):
    pytest.importorskip("xarray")
    (python / "wide.csv").write_text('a,"b ""c""",y\n1,2,3\n4,5,6\n7,8,9\n10,11,12\n')
    (python / "curves.json").write_text('{"train": [4, 2, NaN], "test": [3, 2, 1]}')
    (python / "reads.py").write_text(READS.replace("KIND", kind))
    targets = ', inputs: ["x"], targets: ["y0", "y1"]' if kind == "csv" else ""
    (python / "e.ivx").write_text(SPEC.replace("KIND", kind).replace("TARGETS", targets))
    found = ivx.run("e.ivx")

    def measure(name):
        return found.array(f"e/{name}")

    errors = measure("errors")
    net, line = errors.sel(way="net"), errors.sel(way="line")
    # ivx computes networks in single precision.
    numpy.testing.assert_allclose(measure("net_error"), net, rtol=1e-6)
    numpy.testing.assert_allclose(measure("line_error"), line, rtol=1e-12)
    assert (measure("read") == net).all() and (measure("last") == 132).all()
    assert (measure("infinite") == -numpy.inf).all()
    array = measure("array").sel(seed=1).transpose("first", "second").values
    numpy.testing.assert_array_equal(array, [[4, 2, numpy.nan], [3, 2, 1]])
    numpy.testing.assert_allclose(measure("twice").transpose(*errors.dims), errors, rtol=1e-12)
    assert (measure("wider") == 2 + 5 + 8 + 11).all()
    assert (measure("again") == net).all()
