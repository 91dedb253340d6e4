import json

import pytest

import ivx
from ivx._results import Results, told


def found(at, verdict, difference, low, high, n):
    return {"at": at, "verdict": verdict, "difference": difference, "low": low, "high": high, "n": n}


TOLD = {
    "measures": [
        {"experiment": "e", "measure": "gap", "ke": "WCM", "seed": 0.0, "value": 1.5},
        {"experiment": "e", "measure": "gap", "ke": "WCM", "seed": 1.0, "value": "NaN"},
        {"experiment": "e", "measure": "gap", "ke": "BCM", "seed": 0.0, "value": 2},
        {"experiment": "e", "measure": "gap", "ke": "BCM", "seed": 1.0, "value": "Infinity"},
        {"experiment": "e", "measure": "total", "value": 3.0},
    ],
    "claims": [
        {
            "experiment": "e",
            "claim": "less <is> more",
            "comparison": "a < b",
            "verdict": "holds",
            "difference": -0.123456,
            "low": -0.2,
            "high": -0.1,
            "n": 20,
            "confidence": 0.95,
            "family": {"of": 3, "p": 0.01, "adjusted": 0.03, "verdict": "undecided"},
            "findings": [found({}, "holds", -0.123456, -0.2, -0.1, 20)],
        },
        {
            "experiment": "e",
            "claim": "anywhere",
            "comparison": "c > d",
            "verdict": "undecided",
            "difference": None,
            "low": None,
            "high": None,
            "n": None,
            "confidence": None,
            "family": None,
            "findings": [
                found({"ke": "WCM", "n": "5"}, "holds", 1.0, "-Infinity", 2.0, 3),
                found({"ke": "BCM", "n": "5"}, "undecided", "NaN", None, None, 0),
            ],
        },
    ],
}


@pytest.fixture
def of_told(tmp_path):
    """Results of which that is told."""
    (tmp_path / "results.ron").write_text("")
    found = Results(tmp_path)
    found._told = told(json.dumps(TOLD))
    return found


def test_a_frame_has_a_number_a_row(of_told):
    pandas = pytest.importorskip("pandas")
    frame = of_told.frame("e/gap")
    assert list(frame.columns) == ["experiment", "measure", "ke", "seed", "value"]
    assert frame["seed"].tolist() == [0, 1, 0, 1] and frame["seed"].dtype == int
    assert frame["value"][0] == 1.5 and pandas.isna(frame["value"][1]) and frame["value"][3] == float("inf")
    assert len(of_told.frame()) == len(of_told.frame("e")) == 5
    assert list(of_told.frame("e/total").columns) == ["experiment", "measure", "value"]
    with pytest.raises(KeyError, match="e/gap, e/total"):
        of_told.frame("e/gaps")


def test_an_array_has_a_dimension_an_axis_in_the_order_of_the_spec(of_told):
    pytest.importorskip("xarray")
    array = of_told.array("e/gap")
    assert array.dims == ("ke", "seed") and array.name == "e/gap"
    assert array["ke"].values.tolist() == ["WCM", "BCM"]
    assert array.sel(ke="BCM", seed=0) == 2 and array.sel(ke="WCM").isnull().values.tolist() == [False, True]
    assert of_told.array("e/total").shape == () and of_told.array("e/total") == 3
    with pytest.raises(KeyError, match="several measures"):
        of_told.array("e")


def test_claims_have_a_verdict_a_row(of_told):
    pandas = pytest.importorskip("pandas")
    claims = of_told.claims()
    assert claims["verdict"].tolist() == ["holds", "undecided"]
    assert claims["low"][0] == -0.2 and claims["n"][0] == 20 and pandas.isna(claims["high"][1])
    assert claims.dtypes[["difference", "low", "high"]].tolist() == [float] * 3
    assert claims["corrected"][0] == "undecided" and pandas.isna(claims["corrected"][1])


def test_findings_have_a_verdict_a_coordinate(of_told):
    pandas = pytest.importorskip("pandas")
    findings = of_told.findings()
    assert findings["verdict"].tolist() == ["holds", "holds", "undecided"]
    assert pandas.isna(findings["ke"][0]) and findings["ke"].tolist()[1:] == ["WCM", "BCM"]
    assert findings["axis_n"].tolist()[1:] == ["5", "5"] and findings["n"].tolist() == [20, 3, 0]
    assert findings["low"][1] == float("-inf") and pandas.isna(findings["difference"][2])


def test_a_notebook_is_shown_the_claims(of_told):
    shown = of_told._repr_html_()
    row = "<td>less &lt;is&gt; more</td><td>holds</td><td>-0.1235</td><td>[-0.2, -0.1]</td><td>20</td>"
    assert f"<tr><td>e</td>{row}<td>undecided</td></tr>" in shown
    assert "<td>anywhere</td><td>undecided</td><td></td><td></td><td></td>" in shown
    assert "<td>at ke = WCM, n = 5</td><td>holds</td><td>1</td><td>[-inf, 2]</td><td>3</td><td></td>" in shown


def test_results_are_read_from_their_folder(first):
    pytest.importorskip("xarray")
    ivx.run(first)
    found = ivx.results("results/first")
    assert ivx.results("results/first/results.ron").path == found.path
    error = found.array("first/error")
    assert dict(error.sizes) == {"n": 2, "way": 2, "seed": 5} and error["n"].values.tolist() == [50, 5]
    frame = found.frame("first/error")
    one = frame[(frame.n == 5) & (frame.way == "again") & (frame.seed == 3)]["value"].item()
    assert error.sel(n=5, way="again", seed=3).item() == one
    mean = error.sel(way="plain").mean().item()
    assert found.array("first/mean_error").item() == pytest.approx(mean, rel=1e-12)
    assert found.figures["error"]._repr_svg_().startswith("<svg")
    assert "error" in found.tables["errors"].frame().to_string()
    assert found.tables["errors"]._repr_markdown_().startswith("| n ")
    assert "<svg" in found._repr_html_()
    with pytest.raises(FileNotFoundError, match="no results in"):
        ivx.results("results/other")


def test_claims_are_those_of_the_run(first):
    found = ivx.run(first)
    if not found._told["claims"]:
        pytest.skip("this ivx exports measures alone, without claims")
    pytest.importorskip("pandas")
    (claim,) = found.claims().to_dict("records")
    assert (claim["experiment"], claim["claim"], claim["n"]) == ("first", "more points help", 5)
    error = found.array("first/error").sel(way="plain")
    difference = (error.sel(n=50) - error.sel(n=5)).mean().item()
    assert claim["difference"] == pytest.approx(difference, rel=1e-9)
    assert claim["low"] <= claim["difference"] <= claim["high"]
    assert claim["verdict"] in found._repr_html_()


def test_earlier_runs_are_read_by_their_names(first):
    pytest.importorskip("pandas")
    ivx.run(first)
    few = ivx.run(first, set={"seeds": 2})
    told = json.loads(ivx._binary.call(["runs", "--format", "json"]).stdout)
    earlier, later = (ivx.results(run=run["run"]) for run in told)
    assert (len(earlier.frame("first/error")), len(later.frame("first/error"))) == (20, 8)
    assert later.frame().equals(few.frame())
    with pytest.raises(LookupError, match="no run is called `zz`"):
        ivx.results(run="zz")
    with pytest.raises(TypeError, match="name a folder or a run"):
        ivx.results()
