"""Promise: what the README shows works as it stands there."""

import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from OpenImageIO import UINT8, ImageBuf

from dsis.cli import parser
from dsis.spec import SHIPPED, read_spec
from dsis.stimuli.figure import fig5
from dsis.stimuli.frames import FrameMaker
from dsis.stimuli.jobs import jobs_of

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


def test_its_first_picture_is_the_one_that_the_demo_draws() -> None:
    test = read_spec(SHIPPED / "demo.toml")
    given = test.spec.awgn.model_copy(update={"match": None, "sigma": 1.0})  # not in the picture
    test = replace(test, spec=test.spec.model_copy(update={"awgn": given}))
    city = next(job for job in jobs_of(test) if job.name == "city")
    middle = test.spec.sequence.frames // 2
    drawn = fig5(FrameMaker.of(test, city).figure_frames(middle)["sd", 2])
    shown = ImageBuf(str(ROOT / re.search(r"!\[.*?\]\((.*?)\)", README)[1])).get_pixels(UINT8)
    assert shown.shape == drawn.shape
    # Elsewhere one code in 1e-4 of samples may be another; a sample may touch all of its crop.
    assert np.mean(shown != drawn) < 1e-2
