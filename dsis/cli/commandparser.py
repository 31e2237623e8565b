"""A parser of commands whose complaints are of the command that was given."""

import argparse
import sys
from collections.abc import Sequence
from typing import Any, NoReturn


class CommandParser(argparse.ArgumentParser):
    """Shows the usage of the command at fault, and which option took the words that it misses."""

    def __init__(self, *how: Any, **more: Any) -> None:
        self._greedy: list[str] = []
        self._given: list[str] = []
        super().__init__(*how, **more)

    def add_argument(self, *names: Any, **how: Any) -> argparse.Action:
        """Take an argument, and remember options that take all words up to the next option."""
        action = super().add_argument(*names, **how)
        if action.nargs in {"+", "*"}:
            self._greedy += action.option_strings
        return action

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """Read the arguments; what is not known is an error here, not in the parser above."""
        self._given = list(sys.argv[1:] if args is None else args)
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return options, unknown

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, below the usage of this command, and leave with status 2."""
        took = [name for name in self._greedy if name in self._given]
        if took and message.startswith("the following arguments are required"):
            message += f" ({took[0]} takes every word up to the next option: give it after them)"
        super().error(message)
