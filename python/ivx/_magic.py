"""The cell magic ``%%ivx``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from IPython.core.magic_arguments import argument, magic_arguments, parse_argstring
from IPython.display import display

from ._results import Results
from ._run import RunError, follow


@magic_arguments()
@argument("name", help="The cell is written to NAME.ivx")
@argument("--set", action="append", default=[], metavar="NAME=VALUE", help="Set a parameter")
@argument("--profile", help="The profile")
def ivx(line: str, cell: str) -> Results:
    """Writes the cell to a spec, runs it, and shows its claims and figures."""
    asked = parse_argstring(ivx, line)
    args = [f"--set={setting}" for setting in asked.set]
    args += [] if asked.profile is None else [f"--profile={asked.profile}"]
    spec = Path(f"{asked.name}.ivx")
    spec.write_text(cell, encoding="utf-8")
    try:
        return follow(spec, args)
    except RunError as error:
        display(error.results)
        raise


def load(shell: Any) -> None:
    """Makes the magic known."""
    shell.register_magic_function(ivx, magic_kind="cell")
