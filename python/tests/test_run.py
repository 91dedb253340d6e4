import io
import os
import signal
import stat
import subprocess
import sys
import textwrap
import time

import pytest

import ivx
from ivx._run import Progress, _spelled


def command(script, more=""):
    """A spec of one measure over two places, made by a line of a shell."""
    return f"""edition "2026"

experiment e {{
    axis n = [1, 2]
    let run = command("sh", args: ["-c", "{script}", n], stdout: "a.json")
    measure v = read_scalar(run, "a.json")
    {more}
}}
"""


def test_what_is_wrong_with_a_spec_is_told_as_a_terminal_shows_it(project):
    (project / "bad.ivx").write_text(command("echo 1").replace("measure v = read_scalar", "measure v = red_scalar"))
    with pytest.raises(ivx.SpecError) as told:
        ivx.run("bad.ivx")
    shown = subprocess.run([ivx.find(), "exec", "bad.ivx"], capture_output=True, text=True).stderr
    assert str(told.value) == shown.strip() and "did you mean `read_scalar`?" in shown and "\x1b" not in shown
    assert told.value._render_traceback_() == shown.strip().splitlines()
    (project / "good.ivx").write_text(command("echo 1"))
    with pytest.raises(ivx.SpecError, match="no parameter is called `m`"):
        ivx.run("good.ivx", set={"m": 2})
    with pytest.raises(ivx.SpecError, match="there is no such file"):
        ivx.run("absent.ivx")


def test_nodes_that_fail_are_named_and_the_others_are_there(project):
    pytest.importorskip("pandas")
    (project / "e.ivx").write_text(command("test $0 -eq 1 && echo 3 || exit 4"))
    with pytest.raises(ivx.RunError, match=r"e/run\[n=2\]: `sh` ended with exit code 4") as told:
        ivx.run("e.ivx")
    assert list(told.value.failures) == ["e/run[n=2]"]
    frame = told.value.results.frame("e/v")
    assert frame["value"][0] == 3 and frame["value"].isna().tolist() == [False, True]


def test_failures_of_one_kind_are_told_once():
    failures = {f"e/run[n={i}]": "same" if i < 3 else f"code {i}" for i in range(7)}
    told = str(ivx.RunError(failures, None)).splitlines()
    assert told[0] == "e/run[n=0] and 2 more: same" and told[1] == "e/run[n=3]: code 3"
    assert told[3:] == ["and 2 more for other reasons"]


def test_results_are_where_they_were_written(first):
    assert ivx.run(first).path == first.parent / "results" / "first"
    set_apart = ivx.run(first, set={"first.seeds": 2}, jobs=1)
    assert set_apart.path == first.parent / "results" / "first@seeds=2"
    assert ivx.run(first, profile="paper", out="elsewhere").path == first.parent / "elsewhere"


def test_values_of_parameters_are_spelled_as_in_a_spec(project):
    pytest.importorskip("pandas")
    spec = """edition "2026"

experiment e {
    param a: Float = 1.0
    param s: Str = "s"
    param l: List<Int> = [1]
    axis n = l
    let run = command("sh", args: ["-c", "echo ${#0}", s], stdout: "length.json")
    measure v = read_scalar(run, "length.json") * a * n
}
"""
    (project / "e.ivx").write_text(spec)
    found = ivx.run("e.ivx", set={"a": 1e-05, "s": 'x"y', "l": [4, 5]})
    assert found.frame()["n"].tolist() == [4, 5]
    assert found.frame()["value"].tolist() == pytest.approx([12e-05, 15e-05])
    assert _spelled(True) == "true" and _spelled((1, 2.5, "é")) == '[1, 2.5, "é"]'


def test_ctrl_c_is_passed_on_and_waits_for_the_orderly_end(project):
    place = project / "slow"
    (project / "e.ivx").write_text(
        f"""edition "2026"

experiment e {{
    let run = command("sh", args: ["slow.sh", "{place}"], files: ["slow.sh"], stdout: "a.json")
    measure v = read_scalar(run, "a.json")
}}
"""
    )
    # It takes some of the second that it is given to end.
    (project / "slow.sh").write_text(
        'trap \'sleep 0.3; : > "$1.ended"; exit 1\' TERM\n: > "$1.began"\nwhile :; do :; done\n'
    )
    # Who starts the tests may have told its children to ignore it, as shells do in the background.
    script = textwrap.dedent("""
        import signal
        import ivx
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            ivx.run("e.ivx")
        except KeyboardInterrupt:
            print("stopped")
    """)
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "IVX": ivx.find()}
    process = subprocess.Popen(
        [sys.executable, "-c", script], env=env, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    while not (project / "slow.began").exists():
        assert process.poll() is None
        time.sleep(0.01)
    # As a terminal does: all of its group have it.
    os.killpg(process.pid, signal.SIGINT)
    out, _ = process.communicate(timeout=30)
    assert out == "stopped\n"
    assert (project / "slow.ended").exists(), "the program had its second to end"
    runs = ivx._binary.call(["runs"]).stdout
    assert "stopped" in runs and "1 executed" not in runs


def test_progress_is_one_line_and_leaves_none():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    terminal = Terminal()
    progress = Progress(terminal)
    progress.EVERY = 0.0
    progress.tell({"event": "planned", "nodes": 2})
    progress.tell({"event": "started", "address": "e/a\x1b[2J"})
    progress.tell({"event": "told", "address": "e/a", "words": "loss 0.3"})
    progress.tell({"event": "finished", "address": "e/a"})
    progress.clear()
    lines = terminal.getvalue().split("\r")
    assert lines[1:4] == ["[0/2] e/a [2J", "[0/2] e/a loss 0.3", "[1/2] e/a         "]
    assert lines[4].strip() == "" and lines[-1] == ""
    silent = io.StringIO()
    progress = Progress(silent)
    progress.EVERY = 0.0
    progress.tell({"event": "started", "address": "e/a"})
    progress.clear()
    assert silent.getvalue() == "" or "ipykernel" in sys.modules


def test_the_command_is_found(tmp_path, monkeypatch):
    own = tmp_path / "ivx"
    own.write_text("#!/bin/sh\n")
    own.chmod(own.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("IVX", str(own))
    assert ivx.find() == str(own)
    monkeypatch.setenv("IVX", str(tmp_path / "absent"))
    with pytest.raises(FileNotFoundError, match="which is no program"):
        ivx.find()
    monkeypatch.delenv("IVX")
    monkeypatch.setattr("sysconfig.get_path", lambda *_, **__: str(tmp_path / "scripts"))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert ivx.find() == str(own)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(FileNotFoundError, match="install its wheel"):
        ivx.find()
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "ivx").write_text("")
    assert ivx.find() == str(tmp_path / "scripts" / "ivx")
