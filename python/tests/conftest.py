"""A project in a folder of its own, and a Python for its programs."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import ivx

SPEC = """edition "2026"

experiment first {
    param seeds: Int = 5
    axis seed = 0..seeds
    axis n = [50, 5]
    axis way = ["plain", "again"]
    let data = sample(sinusoids(), n: n, noise: 0.1)
    let test = sample(sinusoids(), n: 50, stream: "test")
    let model = train(linear_map(features: polynomial(degree: 3)), on: data)
    measure error = match way {
        "plain": rmse(model, on: test),
        "again": rmse(model, on: data),
    }
    measure mean_error = mean(mean(error[way: "plain"], over: seed), over: n)
    figure "error" = lines(error[way: "plain"], x: n)
    table "errors" = table(error, rows: n)
    claim "more points help" : error[n: 50, way: "plain"] < error[n: 5, way: "plain"]
}
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """The current folder: an empty project with its own cache, and ``ivx`` to run it."""
    try:
        ivx.find()
    except FileNotFoundError as why:
        pytest.skip(str(why))
    folder = tmp_path / "project"
    (folder / ".git").mkdir(parents=True)
    monkeypatch.setenv("IVX_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def first(project):
    """The path of a small spec."""
    path = project / "first.ivx"
    path.write_text(SPEC)
    return path


@pytest.fixture(scope="session")
def environment(tmp_path_factory):
    """An environment of Python in which this package is installed, beside all that this one has."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    packages = sysconfig.get_path("purelib", vars={"base": str(folder)})
    own = [str(Path(ivx.__file__).parents[1]), sysconfig.get_path("purelib")]
    Path(packages, "beside.pth").write_text("\n".join(own) + "\n")
    return folder


@pytest.fixture
def python(project, environment, monkeypatch):
    """Makes that environment the one of ``python3``, as if it were activated."""
    monkeypatch.setenv("PATH", f"{environment / 'bin'}{os.pathsep}{os.environ['PATH']}")
    return project
