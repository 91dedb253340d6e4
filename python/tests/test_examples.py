import os
import subprocess
from pathlib import Path

import pytest

import ivx

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_a_learner_of_pytorch_is_an_experiment(python, environment):
    """In the Python that ``$IVX_TORCH`` names, which has PyTorch and ivx; else in this one."""
    pytest.importorskip("xarray")
    own = os.environ.get("IVX_TORCH", environment / "bin" / "python3")
    if subprocess.run([own, "-c", "import torch, ivx.node, safetensors"], capture_output=True).returncode != 0:
        pytest.skip("there is no PyTorch: $IVX_TORCH can name a Python that has it")
    for path in (EXAMPLES / "torch_learner").iterdir():
        text = path.read_text().replace('"python3"', f'"{own}"')
        (python / path.name).write_text(text)
    found = ivx.run("torch_learner.ivx", profile="smoke")
    errors, reread = found.array("torch_learner/error"), found.array("torch_learner/reread")
    assert abs(errors.sel(learner="PyTorch") - reread).max() < 1e-5
    loss = found.array("torch_learner/loss")
    assert (loss.isel(step=-1) < loss.isel(step=0)).all() and loss.sizes["step"] == 10
    assert errors.max() < 1.5
    assert "<svg" in found._repr_html_()
