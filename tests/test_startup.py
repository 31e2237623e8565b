"""Promise: the program answers at once, and says why the first use of a kernel takes longer."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from dsis.cli import parser

HEAVY = {
    "IPython", "OpenImageIO", "PyOpenColorIO", "distributed", "jinja2", "matplotlib", "numba",
    "numpy", "pandas", "pydantic", "scipy", "starlette", "tqdm", "uvicorn",
}  # fmt: skip
COMMANDS = next(action.choices for action in parser()._subparsers._group_actions if action.choices)


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
    (tmp_path / "new.py").write_text(
        "from dsis.compiled import kernel\n\n@kernel\ndef one():\n    return 1\n\nprint(one())\n"
    )
    code, elsewhere = [sys.executable, str(tmp_path / "new.py")], {"NUMBA_CACHE_DIR": str(tmp_path)}
    silent = subprocess.run(
        code, capture_output=True, text=True, check=True, env=os.environ | elsewhere
    )
    assert (silent.stdout, silent.stderr) == ("1\n", "")  # nobody is at the terminal


def test_a_kernel_is_compiled_anew_when_one_that_it_calls_changes(tmp_path: Path) -> None:
    """The compiler's own cache would keep the old one."""
    package = tmp_path / "package"
    (package / "__pycache__").mkdir(parents=True)
    (package / "outer.py").write_text(
        "from dsis.compiled import kernel\nfrom inner import add\n\n"
        "@kernel\ndef outer(x):\n    return add(x)\n"
    )
    said = []
    for step in (1, 2, 2):
        (package / "inner.py").write_text(
            f"from dsis.compiled import kernel\n\n@kernel\ndef add(x):\n    return x + {step}\n"
        )
        os.utime(package / "inner.py", (step, step))  # of one size; written at another time
        code = "from outer import outer; print(outer(1), sum(outer.stats.cache_hits.values()))"
        environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
        environment |= dict.fromkeys(("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"), str(tmp_path))
        found = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True,
            cwd=package, env=environment,
        )  # fmt: skip
        said.append(found.stdout.split())
    assert said == [["2", "0"], ["3", "0"], ["3", "1"]]
