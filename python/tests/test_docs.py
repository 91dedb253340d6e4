import re
from pathlib import Path

import pytest

DOCUMENT = Path(__file__).parents[2] / "docs" / "python.md"
BLOCK = re.compile(r"^```([a-z]+)(?:,file=(\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_what_the_document_shows_is_so(python, capsys):
    """Files are written, what is of Python runs as cells of one notebook, and prints the text that follows it."""
    interactive = pytest.importorskip("IPython.core.interactiveshell")
    for module in ("numpy", "pandas", "xarray", "safetensors"):
        pytest.importorskip(module)
    shell = interactive.InteractiveShell.instance()
    said, kinds = "", []
    for kind, file, text in BLOCK.findall(DOCUMENT.read_text(encoding="utf-8")):
        kinds.append((kind, bool(file)))
        if file:
            (python / file).write_text(text)
        elif kind == "python":
            capsys.readouterr()
            ran = shell.run_cell(text)
            said = capsys.readouterr().out
            assert ran.success, f"{text}{said}"
        elif kind == "text":
            assert said == text
    assert kinds.count(("python", False)) >= 7 and kinds.count(("text", False)) >= 4
