"""Promise: complaints are of the command that was given, and any terminal can show what is said."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dsis.cli import main

MISSING = "the following arguments are required:"
GREEDY = "--without takes every word up to the next option: give it after them"


@pytest.mark.parametrize(
    ("arguments", "usage", "says"),
    [
        (
            ["mismatch", "camera.toml", "recording", "-o", "out", "--job", "1", "--fast"],
            "dsis mismatch",
            "unrecognized arguments: --fast",
        ),
        (
            ["camera", "fit", "recording", "-o", "camera.toml", "--seed", "1"],
            "dsis camera fit",
            "unrecognized arguments: --seed 1",
        ),
        (["--fast", "demo"], "dsis", "unrecognized arguments: --fast"),
        (
            ["mismatch", "--without", "dsnu", "camera.toml", "recording", "-o", "out"],
            "dsis mismatch",
            f"{MISSING} camera.toml, RECORDING ({GREEDY})",
        ),
        (
            ["mismatch", "camera.toml", "-o", "out"],
            "dsis mismatch",
            f"{MISSING} RECORDING",
        ),
        (
            ["mismatch", "camera.toml", "recording", "-o", "out", "--jobs", "0"],
            "dsis mismatch",
            "argument --jobs: is '0', must be a whole number of 1 or more",
        ),
        (
            ["plan", "--observers", "1"],
            "dsis plan",
            "argument --observers: is '1', must be a whole number from 2 to 10000",
        ),
    ],
)
def test_a_complaint_is_of_the_command(
    arguments: list[str], usage: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith(f"usage: {usage} [-h]")
    assert said.endswith(f"\n{usage}: error: {says}\n")


SAYS = """
import argparse, sys
from dsis.cli import main, program

def command(_):
    print("3.20 \u00b1 0.10, \u22121, \u03b1")
    print("\u22121", file=sys.stderr)

given = argparse.ArgumentParser()
given.set_defaults(command=command)
program.parser = lambda: given
sys.exit(main([]))
"""


@pytest.mark.parametrize(
    ("encoding", "shown"),
    [
        ("cp1252", "3.20 \u00b1 0.10, ?1, ?"),
        ("ascii", "3.20 ? 0.10, ?1, ?"),
        ("utf-8", "3.20 \u00b1 0.10, \u22121, \u03b1"),
    ],
)
def test_what_an_encoding_lacks_is_replaced(encoding: str, shown: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SAYS],
        env=os.environ | {"PYTHONIOENCODING": f"{encoding}:strict"},
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.decode(encoding).strip() == shown
    assert done.stderr.decode(encoding).strip() in {"?1", "\u22121"}
