"""Promise: what the README shows works as it stands there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from dsis.cli import parser

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
SHELL = [
    line.split(" #")[0].strip()
    for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    for line in block.splitlines()
    if line.startswith("dsis ")
]


@pytest.mark.parametrize("code", PYTHON, ids=range(len(PYTHON)))
def test_python_examples_run(code: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.parametrize("line", SHELL)
def test_commands_are_understood(line: str) -> None:
    options = parser().parse_args(shlex.split(line)[1:])
    assert callable(options.command)


def test_the_two_commands_install_with_the_locked_versions() -> None:
    main, tests = (
        re.search(rf"<!-- {name} command -->\n```sh\n(.*)\n```", README)[1]
        for name in ("main", "test")
    )
    for command in (main, tests):
        assert command.startswith(
            "python3 -m venv .venv && .venv/bin/pip install -c constraints.txt"
        )
    assert main.endswith(".venv/bin/dsis demo")
    assert tests.endswith(".venv/bin/python -m pytest")


def test_pictures_and_files_it_names_exist() -> None:
    for path in re.findall(r"!\[.*?\]\((.*?)\)", README, re.DOTALL):
        assert (ROOT / path).is_file(), path
    for name in re.findall(r"`(\w+\.toml)`", README):
        if name not in ("camera.toml", "recording.toml"):
            assert (ROOT / "stimuli_specs" / name).is_file(), name
