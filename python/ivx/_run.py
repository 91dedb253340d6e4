"""Runs a spec."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from ._binary import PathLike, find
from ._results import Results


class SpecError(ValueError):
    """A spec, or what it was run with, is wrong: the text is what ``ivx`` says of it."""

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in the place of a traceback, which tells nothing of a spec."""
        return str(self).splitlines()


class RunError(RuntimeError):
    """Nodes failed.

    ``failures`` says why, by their addresses; ``results`` is what came of all others.
    """

    def __init__(self, failures: dict[str, str], results: Results) -> None:
        self.failures, self.results = failures, results
        alike: dict[str, list[str]] = {}
        for address, why in failures.items():
            alike.setdefault(why, []).append(address)
        told = []
        for why, (first, *others) in list(alike.items())[:3]:
            told.append(f"{first}{f' and {len(others)} more' if others else ''}: {why}")
        if len(alike) > 3:
            told.append(f"and {sum(map(len, list(alike.values())[3:]))} more for other reasons")
        super().__init__("\n".join(told))

    def _render_traceback_(self) -> list[str]:
        return f"failed: {self}".splitlines()


def run(
    spec: PathLike,
    set: Mapping[str, object] | None = None,
    profile: str | None = None,
    out: PathLike | None = None,
    jobs: int | None = None,
) -> Results:
    """Runs what is not known of a spec, as ``ivx exec`` does, and gives its results.

    - ``set``: numbers, texts, truths and lists for parameters, as in ``{"members": 16, "first.noise": 0.5}``.
    - ``out``: the folder of the results; by default the one below ``results/`` that is called as the spec.

    Raises SpecError if the spec or an argument is wrong, RunError if nodes failed, OSError if the disk or the cache
    failed, and KeyboardInterrupt after Ctrl-C: what was executed is kept, and the next run goes on from there.
    """
    args = [f"--set={name}={_spelled(value)}" for name, value in (set or {}).items()]
    args += [] if profile is None else [f"--profile={profile}"]
    args += [] if out is None else [f"--out={os.fspath(out)}"]
    args += [] if jobs is None else [f"--jobs={jobs}"]
    return follow(spec, args)


def follow(spec: PathLike, args: Sequence[str]) -> Results:
    """Runs a spec with arguments of the command line; otherwise as `run`."""
    said: list[str] = []
    ended: dict[str, Any] = {}
    failures: dict[str, str] = {}
    progress = Progress(sys.stderr)
    # In a session of its own: a Ctrl-C at the terminal would reach it twice, and a second one does not wait.
    with subprocess.Popen(
        [find(), "exec", os.fspath(spec), "--format", "json", *args],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        start_new_session=True,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        listener = threading.Thread(target=said.extend, args=(process.stderr,), daemon=True)
        listener.start()
        try:
            for line in process.stdout:
                event = json.loads(line)
                progress.tell(event)
                if event["event"] == "failed":
                    failures[event["address"]] = event["why"]
                elif event["event"] == "ended":
                    ended = event
            process.wait()
        except BaseException:
            _stop(process, process.stdout)
            raise
        finally:
            listener.join()
            progress.clear()
    if process.returncode == 130:
        raise KeyboardInterrupt
    return _results(process.returncode, ended, failures, "".join(said).strip())


def _stop(process: subprocess.Popen[str], stdout: IO[str]) -> None:
    """Passes a Ctrl-C on and waits for the orderly end; another one does not wait for what runs."""
    while True:
        process.send_signal(signal.SIGINT)
        try:
            for _ in stdout:
                pass
            process.wait()
            return
        except KeyboardInterrupt:
            continue


def _results(code: int, ended: dict[str, Any], failures: dict[str, str], said: str) -> Results:
    if code == 2:
        raise SpecError(said)
    if code not in (0, 1) or not ended:
        raise OSError(said or f"ivx ended with {code}")
    if said:
        print(said, file=sys.stderr)
    found = Results(Path(ended["results"]).parent)
    if failures:
        raise RunError(failures, found)
    return found


def _spelled(value: object) -> str:
    """A value of a parameter as a spec has it."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_spelled, value))}]"
    if isinstance(value, (str, bool)):
        return json.dumps(value, ensure_ascii=False)
    return str(value)


class Progress:
    """How far a run is, on one line of a terminal or notebook."""

    EVERY = 0.5  # seconds; what is over sooner is not told

    def __init__(self, stream: Any) -> None:
        is_seen = stream is not None and (stream.isatty() or "ipykernel" in sys.modules)
        self.stream: Any = stream if is_seen else None
        self.done = self.nodes = self.width = 0
        self.last = time.monotonic()

    def tell(self, event: dict[str, Any]) -> None:
        """Takes note of an event."""
        kind = event["event"]
        if kind == "planned":
            self.nodes = event["nodes"]
        elif kind in ("hit", "finished", "failed", "skipped"):
            self.done += 1
        now = time.monotonic()
        if self.stream is not None and "address" in event and now - self.last >= self.EVERY:
            self.last = now
            self._show(f"[{self.done}/{self.nodes}] {event['address']} {event.get('words', '')}")

    def clear(self) -> None:
        """Leaves nothing behind."""
        if self.width:
            self._show("")

    def _show(self, line: str) -> None:
        line = "".join(c if c.isprintable() else " " for c in line)[:79].rstrip()
        self.stream.write("\r" + line.ljust(self.width) + ("" if line else "\r"))
        self.stream.flush()
        self.width = len(line)
