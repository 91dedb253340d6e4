import sys
from pathlib import Path

import pytest

import ivx

from .conftest import SPEC

nbformat = pytest.importorskip("nbformat")
nbconvert = pytest.importorskip("nbconvert.preprocessors")
pytest.importorskip("ipykernel")
pytest.importorskip("pandas")


@pytest.fixture
def shown(project, monkeypatch):
    """Runs cells in a notebook of the project, and gives what each shows."""
    monkeypatch.setenv("PYTHONPATH", str(Path(ivx.__file__).parents[1]))
    monkeypatch.setenv("IVX", ivx.find())
    # The kernel is this Python, whatever others are known.
    kernels = project.parent / "jupyter" / "kernels" / "python3"
    kernels.mkdir(parents=True)
    (kernels / "kernel.json").write_text(
        f'{{"argv": ["{sys.executable}", "-m", "ipykernel_launcher", "-f", "{{connection_file}}"],'
        ' "display_name": "Python", "language": "python"}'
    )
    monkeypatch.setenv("JUPYTER_PATH", str(kernels.parents[1]))

    def execute(*cells):
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
        runner = nbconvert.ExecutePreprocessor(timeout=120, allow_errors=True, kernel_name="python3")
        runner.preprocess(notebook, {"metadata": {"path": str(project)}})
        return [cell.outputs for cell in notebook.cells]

    return execute


def html(outputs):
    """What is displayed in a cell, as HTML or SVG."""
    shown = [output.data for output in outputs if output.output_type in ("display_data", "execute_result")]
    return "".join(data.get("text/html", data.get("image/svg+xml", "")) for data in shown)


def test_a_cell_is_a_spec_and_shows_what_came_out(shown, project):
    load, ran, few, claims, figure, moved = shown(
        "%load_ext ivx",
        "%%ivx first\n" + SPEC,
        "%%ivx first --set seeds=3 --profile paper\n" + SPEC,
        "import ivx\nfound = ivx.results('results/first')\nfound.claims()",
        "found.figures['error']",
        "ivx.diff(found, 'results/first@seeds=3')",
    )
    assert load == []
    assert (project / "first.ivx").read_text() == SPEC
    assert "<svg" in html(ran) and "<svg" in html(few) and html(ran) != html(few)
    assert "<table" in html(claims) and "<svg" in html(figure)
    assert "first.seeds" in moved[0].data["text/markdown"]
    if not ivx.results("results/first")._told["claims"]:
        pytest.skip("this ivx exports measures alone, without claims")
    assert "more points help" in html(ran) and "more points help" in html(claims)


def test_a_wrong_spec_is_told_without_a_traceback(shown):
    _, wrong, unset, nameless = shown(
        "%load_ext ivx",
        "%%ivx first\n" + SPEC.replace("rmse(", "rsme("),
        "%%ivx first --set seed=3\n" + SPEC,
        "%%ivx\n" + SPEC,
    )
    (error,) = wrong
    told = "\n".join(error.traceback)
    assert error.output_type == "error" and "did you mean `rmse`?" in told and "first.ivx:12:" in told
    assert "Traceback" not in told and ".py" not in told
    assert "no parameter is called `seed`" in "\n".join(unset[0].traceback)
    assert "required: name" in str(nameless) and "Traceback" not in str(nameless)


def test_what_fails_is_told_beside_what_came_out(shown):
    spec = """edition "2026"

experiment e {
    axis n = [1, 2]
    let run = command("sh", args: ["-c", "test $0 -eq 1 && echo 3 || exit 4", n], stdout: "a.json")
    measure v = read_scalar(run, "a.json")
    figure "v" = lines(v, x: n)
}
"""
    _, (results, error) = shown("%load_ext ivx", "%%ivx e\n" + spec)
    assert "<svg" in html([results])
    assert error.traceback == ["failed: e/run[n=2]: `sh` ended with exit code 4"]
