"""Promise: the command line is quick and documented, and the package holds what it needs."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import analysis
import dsis
from dsis.cli import main, parser

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = next(action.choices for action in parser()._subparsers._group_actions if action.choices)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    said = capsys.readouterr().out
    assert f"example:\n  dsis {command}" in said


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_in_the_readme(command: str) -> None:
    assert f"dsis {command}" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_unknown_words_leave_with_status_2() -> None:
    for arguments in (["stimulate"], ["stimuli", "--jobs", "0", "x.toml"], []):
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert left.value.code == 2


def test_help_imports_nothing_heavy() -> None:
    """`dsis --help` is instant because no library is loaded for it."""
    code = "import sys, dsis.cli; dsis.cli.parser(); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numpy", "numba", "pandas", "scipy", "OpenImageIO", "pydantic"} & set(loaded)


def test_python_m_dsis_is_the_same_program() -> None:
    said = subprocess.run(
        [sys.executable, "-m", "dsis", "--version"], capture_output=True, text=True, check=True
    ).stdout
    assert said == f"dsis {dsis.__version__}\n"


@pytest.mark.parametrize("package", [dsis, analysis])
def test_public_names_exist_and_are_documented(package: object) -> None:
    for name in package.__all__:
        assert getattr(package, name).__doc__, name


def test_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == dsis.__version__


def test_locked_versions_cover_every_requirement_and_name_no_address() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = project["dependencies"] + project["optional-dependencies"]["test"]
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    assert "://" not in text
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    locked = {line.split("==")[0].lower().replace("_", "-") for line in lines}
    for requirement in wanted:
        name = requirement.split(">")[0].lower().replace("_", "-")
        assert name in locked, name


def test_what_takes_long_has_something_quicker_beside_it() -> None:
    """Whole diagnoses that are run by `-m long` alone are not all that is asked of a law."""
    for file in sorted((ROOT / "tests").glob("test_*.py")):
        tests = re.findall(r"((?:^[@ )\]].*\n)*)^def test_", file.read_text("utf-8"), re.MULTILINE)
        assert not tests or any("@pytest.mark.long" not in own for own in tests), file.name
