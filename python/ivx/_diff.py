"""What moved between two results."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Union

from ._binary import PathLike, call, need
from ._results import Results

if TYPE_CHECKING:
    import pandas

Side = Union[Results, PathLike]


def diff(a: Side | None = None, b: Side | None = None) -> Diff:
    """What moved from ``a`` to ``b``, each a Results, a path, a run or a git revision.

    Without ``b``, ``b`` is the project's results; without both, the last two runs of a spec are compared. Raises
    LookupError if one is not there.
    """
    sides = [side.path if isinstance(side, Results) else side for side in (a, b) if side is not None]
    told, shown = (call(["diff", *sides, "--format", kind]) for kind in ("json", "markdown"))
    if told.returncode == 2:
        raise LookupError(told.stderr.strip().removeprefix("error: "))
    return Diff(json.loads(told.stdout), shown.stdout)


class Diff:
    """What moved, which a notebook shows. ``same`` says whether nothing did; ``told`` is all that ``ivx`` said."""

    def __init__(self, told: dict[str, Any], shown: str) -> None:
        self.told, self._shown = told, shown
        self.same: bool = told["same"]

    @property
    def changes(self) -> pandas.DataFrame:
        """Changes, one a row: the ``results``, the ``kind`` of thing, its ``name``, ``what`` became of it.

        ``before`` and ``after`` are values of a parameter or verdicts of a claim; of a measure they are the number
        that moved most, ``at`` its coordinates, of ``of`` numbers ``moved`` have moved.
        """
        rows = [_row(pair["name"], change) for pair in self.told["results"] for change in pair["changes"]]
        columns = ["results", "kind", "name", "what", "before", "after", "at", "moved", "of"]
        return need("pandas", "notebook").DataFrame(rows, columns=columns)

    def __repr__(self) -> str:
        return self._shown.rstrip()

    def _repr_markdown_(self) -> str:
        return self._shown


def _row(results: str, change: dict[str, Any]) -> dict[str, Any]:
    return {"results": results, **(change.get("largest") or {}), **change}
