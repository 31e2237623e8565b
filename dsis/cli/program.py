"""The program: its commands, its messages and its exit statuses."""

import argparse
import errno
import io
import os
import sys
from collections.abc import Sequence

from dsis import __version__
from dsis.cli.arguments import adder
from dsis.cli.camera import add_camera
from dsis.cli.commandparser import CommandParser
from dsis.cli.demo import add_demo
from dsis.cli.mismatch import add_mismatch
from dsis.cli.paper import add_paper
from dsis.cli.plan import add_plan
from dsis.cli.report import add_report
from dsis.cli.scenes import add_scenes
from dsis.cli.session import add_session, add_votes
from dsis.cli.stimuli import add_stimuli
from dsis.errors import DsisError, InputError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 0 done, 1 damaged files, 2 bad input."""
    _print_anything()
    options = parser().parse_args(arguments)
    try:
        options.command(options)
    except DsisError as error:
        _complain(str(error))
        return 2 if isinstance(error, InputError) else 1
    except KeyboardInterrupt:
        _complain("interrupted")
        return 130
    except BrokenPipeError:
        # Whoever read the output has gone (`| head`); nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        _complain(f"{place}{error.strerror or error}")
        return 1 if error.errno in (errno.ENOSPC, errno.EIO) else 2
    return 0


def _print_anything() -> None:
    """Put a question mark where a terminal's encoding lacks a character, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _complain(message: str) -> None:
    print("\n".join(f"dsis: {line}" for line in message.splitlines()), file=sys.stderr)


def parser() -> argparse.ArgumentParser:
    """Return what reads a command line: `command` is the function that it names."""
    program: argparse.ArgumentParser = CommandParser(
        prog="dsis",
        description="Prepare, run and analyse a double-stimulus impairment test (ITU-R BT.500) "
        "of real camera noise.",
        epilog="Start with: dsis demo",
    )
    program.add_argument("--version", action="version", version=f"dsis {__version__}")
    commands = program.add_subparsers(title="commands", required=True, metavar="COMMAND")
    add = adder(commands)
    add_demo(add)
    add_stimuli(add)
    add_session(add)
    add_votes(add)
    add_report(add)
    add_scenes(add)
    add_plan(add)
    add_camera(commands)
    add_mismatch(add)
    add_paper(add)
    return program
