"""The command line: parse, call one function, print. The one place that knows both packages."""

from dsis.cli.program import main, parser

__all__ = ["main", "parser"]
