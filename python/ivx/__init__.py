"""Runs ivx, and reads what it found as pandas and xarray.

The command that runs is the one that came with this package. ``%load_ext ivx`` makes ``%%ivx`` of a notebook's cell a
spec. ``ivx.node`` is for programs that ivx runs.
"""

from ._binary import find
from ._diff import Diff, diff
from ._results import Figure, Results, Table, results
from ._run import RunError, SpecError, run

__all__ = ["Diff", "Figure", "Results", "RunError", "SpecError", "Table", "diff", "find", "results", "run"]


def load_ipython_extension(shell: object) -> None:
    """Makes ``%%ivx`` known, after ``%load_ext ivx``."""
    from ._magic import load

    load(shell)
