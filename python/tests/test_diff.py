import pytest

import ivx


def test_what_moved_is_a_row_a_change(first):
    pytest.importorskip("pandas")
    before = ivx.run(first)
    after = ivx.run(first, set={"seeds": 3})
    moved = ivx.diff(before, after)
    assert not moved.same
    changes = moved.changes.set_index(["kind", "name"])
    parameter = changes.loc[("param", "first.seeds")]
    assert (parameter["what"], parameter["before"], parameter["after"]) == ("changed", 5, 3)
    mean = changes.loc[("measure", "first/mean_error")]
    values = [found.frame("first/mean_error")["value"].item() for found in (before, after)]
    assert [mean["before"], mean["after"]] == values and (mean["moved"], mean["of"]) == (1, 1)
    assert "first.seeds" in moved._repr_markdown_() and str(moved) in moved._repr_markdown_()


def test_nothing_moved_is_the_same(first):
    pytest.importorskip("pandas")
    found = ivx.run(first)
    moved = ivx.diff("results/first", found)
    assert moved.same and moved.changes.empty
    with pytest.raises(LookupError, match="no path, no run and no git revision"):
        ivx.diff("absent", found)
