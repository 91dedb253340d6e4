"""What `ivx lsp` answers to a client that knows the protocol and not ivx."""

import re
import subprocess
from pathlib import Path

import pytest
from lsprotocol import types as t

from editor import IVX, document, start, until

GAP = (Path(__file__).parent / "gap.ivx").read_text()
PROBLEM = """\
edition "2026"

param noise: Float = 0.1

let data = sample(sinusoids(), n: 20, noise: noise)
"""
LEARNING = """\
edition "2026"
use "problem.ivx" { data }

experiment learning {
    axis seed = 0..3
    let model = train(linear_map(features: polynomial(degree: 5)), on: data)
    measure error = rmse(model, on: data)
}
"""


@pytest.fixture
def root(tmp_path):
    (tmp_path / ".ivx").mkdir()
    return tmp_path


@pytest.fixture
def gap(root):
    path = root / "gap.ivx"
    path.write_text(GAP)
    return path


@pytest.fixture
def pair(root):
    """Two specs, of which the second uses the first."""
    problem, learning = root / "problem.ivx", root / "learning.ivx"
    problem.write_text(PROBLEM)
    learning.write_text(LEARNING)
    return problem, learning


# One offers UTF-16 alone, which is the default of the protocol; the other UTF-8 first.
@pytest.fixture(params=["visual_studio_code", "neovim@v0.11"])
async def editor(request, root):
    editor = await start(request.param, root)
    yield editor
    await editor.stop()


async def test_a_good_spec_has_no_faults(editor, gap):
    editor.open(gap)
    assert await editor.faults(gap) == []


async def test_a_fault_has_its_code_place_and_mend(editor, gap):
    editor.open(gap, GAP.replace("= train(", "= trian("))
    [fault] = await editor.faults(gap, "IVX0302")
    assert editor.stands(gap, fault.range) == "trian"
    assert (fault.source, fault.severity) == ("ivx", t.DiagnosticSeverity.Error)
    assert "trian" in fault.message
    actions = await editor.server.text_document_code_action_async(
        t.CodeActionParams(document(gap), fault.range, t.CodeActionContext(diagnostics=[fault])))
    [action] = [a for a in actions if a.edit]
    assert action.title.startswith("did you mean `train`?")
    assert action.kind == t.CodeActionKind.QuickFix
    assert editor.edited(gap, edits_of(action.edit, gap)) == GAP


async def test_several_faults_are_told_at_once(editor, gap):
    editor.open(gap, GAP.replace('[ke: "WCM"]', '[ke: "WMC"]').replace('[ke: "BCM"]', '[ek: "BCM"]'))
    label, axis = await editor.faults(gap, "IVX0307", "IVX0306")
    assert editor.stands(gap, label.range) == '"WMC"'
    assert editor.stands(gap, axis.range) == "ek"


async def test_what_stands_behind_other_signs_has_its_place(editor, gap):
    editor.open(gap, GAP.replace('"doubt is worth hearing" : cost', '"Zweifel 𝔼 ist — 疑い — es wert" : csot'))
    [fault] = await editor.faults(gap, "IVX0301")
    assert editor.stands(gap, fault.range) == "csot"


async def test_faults_follow_the_text(editor, gap):
    editor.open(gap)
    await editor.faults(gap)
    editor.replace(gap, "= train(", "= trian(")
    await editor.faults(gap, "IVX0302")
    editor.replace(gap, "= trian(", "= train(")
    assert await editor.faults(gap) == []


async def test_hover_tells_what_an_operation_does(editor, gap):
    editor.open(gap)
    hover = await editor.server.text_document_hover_async(t.HoverParams(*editor.at(gap, "let model = tr", "ain(")))
    assert hover.contents.kind == t.MarkupKind.Markdown
    assert "A model learned from data." in hover.contents.value
    assert re.search(r"train\(\s*learner: Learner,\s+on: Dataset", hover.contents.value)
    nothing = await editor.server.text_document_hover_async(t.HoverParams(document(gap), t.Position(1, 0)))
    assert nothing is None


async def test_operations_are_completed(editor, gap):
    editor.open(gap, GAP.replace("chosen = argmax(model", "chosen = arg(model"))
    found = await completions(editor, gap, "chosen = arg")
    assert "argmax" in found
    assert found["argmax"].kind == t.CompletionItemKind.Function


async def test_names_and_arguments_are_completed(editor, gap):
    editor.open(gap, GAP.replace("on: data", "on: d"))
    assert "data" in await completions(editor, gap, "on: d")
    editor.replace(gap, "on: d, steps: 20", "on: data, s")
    assert any(label.startswith("steps") for label in await completions(editor, gap, "on: data, s"))


async def test_labels_are_completed(editor, gap):
    editor.open(gap, GAP.replace('cost[ke: "WCM"]', 'cost[ke: "'))
    assert {label.strip('"') for label in await completions(editor, gap, 'cost[ke: "')} == {"WCM", "BCM"}


async def test_definitions_and_references(editor, gap):
    editor.open(gap)
    there = await editor.server.text_document_definition_async(
        t.DefinitionParams(*editor.at(gap, "argmax(mo", "del")))
    there = locations(there)
    assert there == [(gap, GAP[:GAP.index("let model")].count("\n"))]
    uses = await editor.server.text_document_references_async(t.ReferenceParams(
        context=t.ReferenceContext(include_declaration=True),
        **dict(zip(("text_document", "position"), editor.at(gap, "let da", "ta")))))
    lines = [GAP[:GAP.index(use)].count("\n") for use in ("let data", "on: data")]
    assert sorted(locations(uses)) == [(gap, line) for line in lines]
    assert all(editor.stands(gap, use.range) == "data" for use in uses)


async def test_definitions_lie_in_other_files(editor, pair):
    problem, learning = pair
    editor.open(learning)
    there = await editor.server.text_document_definition_async(
        t.DefinitionParams(*editor.at(learning, "on: da", "ta")))
    assert locations(there) == [(problem, PROBLEM[:PROBLEM.index("let data")].count("\n"))]


async def test_a_rename_reaches_both_files(editor, pair):
    problem, learning = pair
    editor.open(problem)
    editor.open(learning)
    await editor.faults(learning)
    edit = await editor.server.text_document_rename_async(t.RenameParams(
        new_name="seen", **dict(zip(("text_document", "position"), editor.at(problem, "let da", "ta")))))
    assert editor.edited(problem, edits_of(edit, problem)) == PROBLEM.replace("let data", "let seen")
    assert editor.edited(learning, edits_of(edit, learning)) == (
        LEARNING.replace("{ data }", "{ seen }").replace("on: data", "on: seen"))


async def test_operations_are_not_renamed(editor, gap):
    editor.open(gap)
    try:
        place = await editor.server.text_document_prepare_rename_async(
            t.PrepareRenameParams(*editor.at(gap, "let model = tr", "ain(")))
    except Exception as refused:
        place = None
        assert str(refused)
    assert place is None


async def test_formatting_is_that_of_ivx_fmt(editor, gap):
    untidy = GAP.replace("    axis seed = 0..5", "  axis   seed=0..5")
    editor.open(gap, untidy)
    options = t.FormattingOptions(tab_size=4, insert_spaces=True)
    edits = await editor.server.text_document_formatting_async(t.DocumentFormattingParams(document(gap), options))
    assert editor.edited(gap, edits) == GAP
    editor.replace(gap, "  axis   seed=0..5", "    axis seed = 0..5")
    edits = await editor.server.text_document_formatting_async(t.DocumentFormattingParams(document(gap), options))
    assert not edits


async def test_experiments_fold(editor, gap):
    editor.open(gap)
    folds = await editor.server.text_document_folding_range_async(t.FoldingRangeParams(document(gap)))
    first = GAP[:GAP.index("experiment gap")].count("\n")
    assert any(f.start_line == first and f.end_line >= GAP.count("\n") - 2 for f in folds)


async def test_semantic_tokens_lie_on_words(editor, gap):
    editor.open(gap)
    tokens = await editor.server.text_document_semantic_tokens_full_async(t.SemanticTokensParams(document(gap)))
    legend = editor.capabilities.semantic_tokens_provider.legend.token_types
    line = column = 0
    kinds = {}
    for i in range(0, len(tokens.data), 5):
        down, right, length, kind, _ = tokens.data[i:i + 5]
        line, column = line + down, right + (0 if down else column)
        place = t.Range(t.Position(line, column), t.Position(line, column + length))
        kinds.setdefault(editor.stands(gap, place), set()).add(legend[kind])
    assert "function" in kinds["train"]
    assert len(kinds) > 5


async def test_inlay_hints_tell_axes_and_verdicts(editor, gap):
    editor.open(gap)

    def beside(what, words):
        line = GAP[:GAP.index(what)].count("\n")
        return lambda hints: any(at == line and re.search(words, text) for at, text in hints)

    async def ask():
        return await inlay_hints(editor, gap)

    await until("axes and nodes", ask, beside("let chosen", r"seed × ke\b.*\b10 nodes"))
    assert not beside("claim", "holds|fails|undecided")(await ask())
    execute(gap, editor)
    await until("a verdict", ask, beside("claim", "holds|fails|undecided"))


async def test_code_lenses_run_and_ask_why(editor, gap):
    editor.open(gap)
    lenses = await editor.server.text_document_code_lens_async(t.CodeLensParams(document(gap)))
    commands = [
        lens.command or (await editor.server.code_lens_resolve_async(lens)).command for lens in lenses]
    assert {c.title for c in commands} >= {"run", "why"}
    run = next(c for c in commands if c.title == "run")
    why = next(c for c in commands if c.title == "why")
    assert (run.command, run.arguments[0]) == ("ivx.run", gap.as_uri())
    assert (why.command, why.arguments[0]) == ("ivx.why", gap.as_uri())
    said = subprocess.run([IVX, "why", str(gap), why.arguments[1]], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr


async def test_a_report_is_found_once_there_is_one(editor, gap):
    editor.open(gap)

    async def ask():
        answer = await editor.server.protocol.send_request_async("ivx/report", {"uri": gap.as_uri()})
        return answer["path"] if isinstance(answer, dict) else answer.path

    assert await ask() is None
    execute(gap, editor)
    report = await until("a report", ask, bool)
    assert Path(report).samefile(gap.parent / "results/gap/report.html")


async def test_unsaved_text_of_a_used_file_counts(editor, pair):
    problem, learning = pair
    editor.open(learning)
    await editor.faults(learning)
    editor.open(problem)
    editor.replace(problem, "let data", "let seen")
    found = await editor.some_faults(learning)
    assert [editor.stands(learning, f.range) for f in found if "data" in f.message][:1] == ["data"]
    editor.replace(problem, "let seen", "let data")
    assert await editor.faults(learning) == []


async def test_broken_text_is_a_fault_and_no_end(editor, gap):
    editor.open(gap)
    for broken in ["", "{", 'edition "2026"\nexperiment e {', GAP[:len(GAP) // 2], GAP + '"', "\0é𝔼\r\n]"]:
        editor.replace(gap, editor.texts[gap], broken)
        at = t.Position(0, 0)
        await editor.server.text_document_hover_async(t.HoverParams(document(gap), at))
        await editor.server.text_document_completion_async(t.CompletionParams(document(gap), at))
        await editor.server.text_document_folding_range_async(t.FoldingRangeParams(document(gap)))
        await editor.server.text_document_inlay_hint_async(
            t.InlayHintParams(document(gap), t.Range(at, t.Position(100, 0))))
    editor.replace(gap, editor.texts[gap], GAP.replace("\n}\n", "\n"))
    assert await editor.some_faults(gap)
    editor.replace(gap, editor.texts[gap], GAP)
    assert await editor.faults(gap) == []


async def test_broken_text_leaves_the_rest_known(editor, gap):
    editor.open(gap, GAP.replace("let data = sample(", "let data = = sample("))
    assert await editor.some_faults(gap)
    there = await editor.server.text_document_definition_async(
        t.DefinitionParams(*editor.at(gap, "argmax(mo", "del")))
    assert locations(there) == [(gap, GAP[:GAP.index("let model")].count("\n"))]


async def test_two_roots_are_two_projects(tmp_path):
    roots = [tmp_path / "one", tmp_path / "two"]
    for root, text in zip(roots, [PROBLEM, PROBLEM.replace("let data", "let seen")]):
        (root / ".ivx").mkdir(parents=True)
        (root / "problem.ivx").write_text(text)
        (root / "learning.ivx").write_text(LEARNING)
    editor = await start("visual_studio_code", *roots)
    good, bad = (root / "learning.ivx" for root in roots)
    editor.open(good)
    editor.open(bad)
    assert await editor.faults(good) == []
    assert await editor.some_faults(bad)
    await editor.stop()


def execute(path, editor):
    """Runs a spec, of which the editor tells the server."""
    subprocess.run([IVX, "exec", str(path)], check=True, capture_output=True)
    editor.changed(path.parent / "results" / path.stem / "results.ron")


async def completions(editor, path, before):
    """What is offered behind a text, by label."""
    answer = await editor.server.text_document_completion_async(t.CompletionParams(*editor.at(path, before)))
    return {item.label: item for item in getattr(answer, "items", answer)}


async def inlay_hints(editor, path):
    """The hints of a file: their lines and texts."""
    everything = t.Range(t.Position(0, 0), editor.position(editor.texts[path], len(editor.texts[path])))
    hints = await editor.server.text_document_inlay_hint_async(t.InlayHintParams(document(path), everything))
    parts = [h.label if isinstance(h.label, str) else "".join(p.value for p in h.label) for h in hints]
    return [(hint.position.line, text) for hint, text in zip(hints, parts)]


def locations(answer):
    """The files and lines of one or several locations or links."""
    answer = answer if isinstance(answer, (list, tuple)) else [answer]
    places = [(getattr(a, "uri", None) or a.target_uri, getattr(a, "range", None) or a.target_selection_range) for a in answer]
    return [(Path(uri.removeprefix("file://")), place.start.line) for uri, place in places]


def edits_of(edit, path):
    """The edits that a workspace edit has for a file."""
    by_file = dict(edit.changes or {})
    by_file |= {change.text_document.uri: change.edits for change in edit.document_changes or []}
    return by_file[path.as_uri()]

