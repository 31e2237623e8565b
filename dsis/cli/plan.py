"""`dsis plan`: how many observers a test needs."""

import argparse
from pathlib import Path

from dsis.cli.arguments import Add, add_scale, add_seed, number, whole


def add_plan(add: Add) -> None:
    """Say what `dsis plan` takes."""
    sub = add(
        "plan",
        plan,
        "Say how many observers a test needs, from a difference of MOS or from a pilot's votes.",
        "plan --difference 0.5 --sd 1 --comparisons 12",
    )
    difference = "of two mean opinion scores that shall be shown, grades"
    sub.add_argument("--difference", type=number(), metavar="GRADES", help=difference)
    sd = "of an observer's difference of two votes (of votes, with --groups), grades"
    sub.add_argument("--sd", type=number(), metavar="GRADES", help=sd)
    comparisons = "how many differences are tested (default: 1)"
    sub.add_argument("--comparisons", type=whole(1), default=1, metavar="N", help=comparisons)
    correction = "for several comparisons (default: bonferroni)"
    sub.add_argument(
        "--correction", choices=("bonferroni", "holm"), default="bonferroni", help=correction
    )
    groups = "two groups of observers, one for each score, instead of one that judges both"
    sub.add_argument("--groups", action="store_true", help=groups)
    power = "chance to show the difference (default: 0.8)"
    sub.add_argument("--power", type=number(), default=0.8, metavar="P", help=power)
    alpha = "chance to show one that is not there (default: 0.05)"
    sub.add_argument("--alpha", type=number(), default=0.05, metavar="P", help=alpha)
    pilot = "votes of a pilot: power curves, simulated with the observers fitted to it"
    sub.add_argument("--pilot", type=Path, metavar="VOTES.csv", help=pilot)
    add_scale(sub)
    sizes = "numbers of observers to try with a pilot"
    sub.add_argument("--observers", type=whole(2, 10_000), nargs="+", metavar="N", help=sizes)
    out = "folder for the table and the figure of a pilot (default: PILOT-plan)"
    sub.add_argument("--out", type=Path, metavar="DIR", help=out)
    add_seed(sub, "default: 1")


def plan(options: argparse.Namespace) -> None:
    """Say how many observers a test needs, or what power a pilot promises."""
    from analysis.planning.command import describe_plan, write_power

    if options.pilot is None:
        print(describe_plan(options))
    else:
        print(write_power(options))
