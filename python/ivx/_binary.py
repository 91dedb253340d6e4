"""Where the command is, and how it is called."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Union

PathLike = Union[str, "os.PathLike[str]"]


def find() -> str:
    """The path of the ``ivx`` that runs: ``$IVX``, else the one that came with this package, else that of ``PATH``.

    Raises FileNotFoundError if there is none.
    """
    if named := os.environ.get("IVX"):
        if found := shutil.which(named):
            return found
        raise FileNotFoundError(f"$IVX names {named}, which is no program")
    name = "ivx" + (sysconfig.get_config_var("EXE") or "")
    user = sysconfig.get_preferred_scheme("user") if hasattr(sysconfig, "get_preferred_scheme") else "posix_user"
    for scheme in (None, user):
        folder = sysconfig.get_path("scripts") if scheme is None else sysconfig.get_path("scripts", scheme)
        if (path := Path(folder) / name).is_file():
            return str(path)
    if found := shutil.which("ivx"):
        return found
    raise FileNotFoundError("there is no ivx beside this Python nor in PATH: install its wheel, or let $IVX name one")


def call(args: Sequence[PathLike]) -> subprocess.CompletedProcess[str]:
    """What a short command printed; raises OSError if the disk or the cache failed."""
    done = subprocess.run([find(), *args], check=False, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8")
    if done.returncode not in (0, 1, 2):
        raise OSError(done.stderr.strip() or f"ivx ended with {done.returncode}")
    return done


def need(module: str, extra: str) -> Any:
    """The module; raises ImportError, which says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.split(".")[0]
        raise ImportError(f"this needs {package}: pip install 'ivx[{extra}]'") from error
