"""Promise: the program answers at once, and says why the first use of a kernel takes longer."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from dsis.cli import _parser

HEAVY = {
    "IPython", "OpenImageIO", "PyOpenColorIO", "distributed", "jinja2", "matplotlib", "numba",
    "numpy", "pandas", "pydantic", "scipy", "starlette", "tqdm", "uvicorn",
}  # fmt: skip
COMMANDS = next(action.choices for action in _parser()._subparsers._group_actions if action.choices)


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["stimuli", "--help"], []])
def test_help_loads_no_library(arguments: list[str]) -> None:
    """No timing, which a busy machine would spoil: what is not loaded takes no time."""
    program = [sys.executable, "-X", "importtime", "-m", "dsis", *arguments]
    said = subprocess.run(program, capture_output=True, text=True, check=False)
    assert said.returncode in (0, 2)
    lines = [line for line in said.stderr.splitlines() if line.startswith("import time:")]
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in lines}
    assert "argparse" in loaded
    assert not HEAVY & loaded


DRAW = """
from dsis import Draw, PixelGrid
Draw(1).normal("a", PixelGrid(8, 8))
Draw(1).normal("b", PixelGrid(8, 8))
"""


def on_terminal(cache: Path) -> str:
    """Return what a program that draws a field says on a terminal."""
    ours, theirs = pty.openpty()
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    subprocess.run([sys.executable, "-c", DRAW], stderr=theirs, env=environment, check=True)
    os.write(theirs, b".")
    said = os.read(ours, 4096).decode()
    os.close(theirs)
    os.close(ours)
    return said


def test_kernels_are_compiled_once_and_that_is_said(tmp_path: Path) -> None:
    assert on_terminal(tmp_path).count("compiling once for this machine") == 1
    assert on_terminal(tmp_path) == "."  # they lie on disk now
    code = [sys.executable, "-c", DRAW]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "other")}
    silent = subprocess.run(code, capture_output=True, text=True, check=True, env=environment)
    assert silent.stderr == ""  # nobody is at the terminal
