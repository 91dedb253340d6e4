"""What a run found."""

from __future__ import annotations

import html
import json
import tempfile
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._binary import PathLike, call, need

if TYPE_CHECKING:
    import pandas
    import xarray

# What is found of a claim, or of one of its coordinates.
FOUND = ["verdict", "difference", "low", "high", "n"]


def results(path: PathLike | None = None, *, run: str | None = None) -> Results:
    """The results in a folder such as ``results/first``, or those of an earlier run as ``ivx runs`` names it.

    Raises FileNotFoundError if the folder has none, LookupError if there is no such run or it has no results.
    """
    if (path is None) == (run is None):
        raise TypeError("name a folder or a run, such as results('results/first') or results(run='3f2a')")
    if path is not None:
        return Results(path)
    folder = tempfile.TemporaryDirectory(prefix="ivx-")
    done = call(["show", str(run), "--to", Path(folder.name) / "results"])
    if done.returncode != 0:
        raise LookupError(done.stderr.strip().removeprefix("error: "))
    found = Results(Path(folder.name) / "results")
    found._folder = folder
    return found


class Results:
    """What a run found, as it lies in the folder ``path``."""

    _folder: Any = None  # of a run that is shown again; gone with this object

    def __init__(self, path: PathLike) -> None:
        self.path = Path(path).resolve()
        if self.path.name == "results.ron":
            self.path = self.path.parent
        if not (self.path / "results.ron").is_file():
            raise FileNotFoundError(f"there are no results in {self.path}")

    def frame(self, name: str | None = None) -> pandas.DataFrame:
        """Measures, one number a row: ``experiment``, ``measure``, a column for each axis, and ``value``.

        Of all, of one ``"experiment"``, or of one ``"experiment/measure"``. Raises KeyError if there is none such.
        """
        rows = self._rows(name)
        axes = sorted({key for row in rows for key in row} - {"experiment", "measure", "value"})
        return need("pandas", "notebook").DataFrame(rows, columns=["experiment", "measure", *axes, "value"])

    def array(self, name: str) -> xarray.DataArray:
        """The measure ``"experiment/measure"``, with a dimension for each axis and its labels as coordinates.

        Raises KeyError if there is none such.
        """
        numpy = need("numpy", "notebook")
        rows = [row for row in self._rows(name) if _name(row) == name]
        if not rows:
            raise KeyError(f"{name!r} is several measures: {', '.join(dict.fromkeys(map(_name, self._rows(name))))}")
        # In the order of the results, which is that of the spec.
        dims = [key for key in rows[0] if key not in ("experiment", "measure", "value")]
        labels = {dim: list(dict.fromkeys(row[dim] for row in rows)) for dim in dims}
        places = {dim: {label: i for i, label in enumerate(labels[dim])} for dim in dims}
        values = numpy.full([len(labels[dim]) for dim in dims], numpy.nan)
        for row in rows:
            values[tuple(places[dim][row[dim]] for dim in dims)] = row["value"]
        return need("xarray", "notebook").DataArray(values, dims=dims, coords=labels, name=name)

    def claims(self) -> pandas.DataFrame:
        """Claims, one a row: what is compared, the verdict, and the difference with its interval over ``n`` seeds.

        ``corrected`` is the verdict with all claims of its family in mind, where it has one. A claim at several
        coordinates has no difference of its own: `findings` has them all.
        """
        return _frame(self._claims(), ["experiment", "claim", "comparison", *FOUND, "confidence", "corrected"])

    def findings(self) -> pandas.DataFrame:
        """Claims, one a row for every coordinate that they are judged at, which is in the columns of axes.

        An axis that is called as another column has `axis_` before its name.
        """
        rows: list[dict[str, Any]] = []
        axes: set[str] = set()
        for claim in self._claims():
            for finding in claim["findings"]:
                at = {f"axis_{axis}" if axis in FOUND else axis: label for axis, label in finding["at"].items()}
                axes |= at.keys()
                rows.append({**at, **finding, "experiment": claim["experiment"], "claim": claim["claim"]})
        return _frame(rows, ["experiment", "claim", *sorted(axes), *FOUND])

    @property
    def figures(self) -> dict[str, Figure]:
        """Figures by their names."""
        return {path.stem: Figure(path) for path in sorted((self.path / "figures").glob("*.svg"))}

    @property
    def tables(self) -> dict[str, Table]:
        """Tables by their names."""
        return {path.stem: Table(path) for path in sorted((self.path / "tables").glob("*.csv"))}

    def __repr__(self) -> str:
        return f"Results({str(self.path)!r})"

    def _repr_html_(self) -> str:
        return _table(self._claims()) + "".join(f"<p>{figure.svg}</p>" for figure in self.figures.values())

    @cached_property
    def _told(self) -> dict[str, Any]:
        """Measures and claims, as ``ivx export`` tells them."""
        with tempfile.TemporaryDirectory(prefix="ivx-") as folder:
            to = Path(folder) / "told.json"
            done = call(["export", self.path, "--to", to])
            if done.returncode != 0:
                raise ValueError(done.stderr.strip().removeprefix("error: "))
            return told(to.read_text(encoding="utf-8"))

    def _rows(self, name: str | None) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = self._told["measures"]
        wanted = [row for row in rows if name in (None, row["experiment"], _name(row))]
        if not wanted and name is not None:
            raise KeyError(f"no measure is called {name!r}: {', '.join(dict.fromkeys(map(_name, rows)))}")
        return wanted

    def _claims(self) -> list[dict[str, Any]]:
        claims: list[dict[str, Any]] = self._told["claims"]
        return claims


class Figure:
    """A figure, which a notebook shows."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def svg(self) -> str:
        """The picture as SVG."""
        return self.path.read_text(encoding="utf-8")

    def __repr__(self) -> str:
        return f"Figure({str(self.path)!r})"

    def _repr_svg_(self) -> str:
        return self.svg


class Table:
    """A table, which a notebook shows; ``.csv``, ``.md`` and ``.tex`` of it lie side by side."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def frame(self) -> pandas.DataFrame:
        """The table, as it is written."""
        return need("pandas", "notebook").read_csv(self.path)

    def __repr__(self) -> str:
        return f"Table({str(self.path)!r})"

    def _repr_markdown_(self) -> str:
        return self.path.with_suffix(".md").read_text(encoding="utf-8")


def told(text: str) -> dict[str, Any]:
    """Measures and claims of the JSON that ``ivx export`` writes, with whole labels as whole numbers.

    Of an ``ivx`` that tells measures alone, without claims.
    """
    found = json.loads(text)
    measures, claims = (found, []) if isinstance(found, list) else (found["measures"], found["claims"])
    for row in measures:
        for key, value in row.items():
            if key == "value":
                row[key] = float(value)
            elif isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
                row[key] = int(value)
    for claim in claims:
        claim["corrected"] = (claim["family"] or {}).get("verdict")
        for row in (claim, *claim["findings"]):
            row.update({key: float(row[key]) for key in ("difference", "low", "high") if row[key] is not None})
    return {"measures": measures, "claims": claims}


def _frame(rows: list[dict[str, Any]], columns: list[str]) -> pandas.DataFrame:
    frame = need("pandas", "notebook").DataFrame(rows, columns=columns)
    return frame.astype({"difference": float, "low": float, "high": float})


def _name(row: dict[str, Any]) -> str:
    return f"{row['experiment']}/{row['measure']}"


def _table(claims: list[dict[str, Any]]) -> str:
    """Claims as HTML; nothing where there are none."""
    if not claims:
        return ""
    heads = ["experiment", "claim", "verdict", "difference", "interval", "n"]
    if any(claim["corrected"] for claim in claims):
        heads.append("corrected")
    rows = []
    for claim in claims:
        rows.append(claim)
        if len(claim["findings"]) > 1:
            for finding in claim["findings"]:
                at = ", ".join(f"{axis} = {label}" for axis, label in finding["at"].items())
                rows.append({**finding, "claim": f"at {at}"})
    head = "".join(f"<th>{head}</th>" for head in heads)
    body = "".join(f"<tr>{_cells(row, heads)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cells(row: dict[str, Any], heads: list[str]) -> str:
    low, high = row["low"], row["high"]
    interval = None if low is None or high is None else f"[{_short(low)}, {_short(high)}]"
    cells = {**row, "interval": interval}
    return "".join(f"<td>{html.escape(_short(cells.get(head)))}</td>" for head in heads)


def _short(value: str | float | None) -> str:
    """Four digits of a number, text as it is, and nothing of nothing."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
