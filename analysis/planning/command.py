"""What `dsis plan` says and writes."""

import argparse
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import pandas as pd
from matplotlib.figure import Figure

from analysis.figures import COLOURS, INK, MARKS, STYLE, save, simulated_mark
from analysis.planning.leastsquares import fit_additive
from analysis.planning.pilot import ALPHA, OBSERVERS, POWER_COLUMNS, power_from_pilot, whole_grades
from analysis.planning.samplesize import Plan, observers_needed, power_of
from analysis.report.remarks import count_votes, unmarked_robots
from analysis.table import to_csv
from analysis.votes import index_votes
from analysis.votesfile import read_test
from dsis.errors import Fault, InputError
from dsis.outdir import UNFINISHED, result_folder

FILES = ("power.csv", "power.svg", "power.png")
CURVES_DRAWN = 12
SPREAD_LEAST = 0.5  # grades; below, whole votes hide where between the grades a score lies
_SCORES = (
    "Scores and spread of the pilot: least squares, observers' biases taken off, every observer\n"
    "weighs the same, as in the paired t tests planned here (P.910's scores may lean on a single\n"
    "one and are not used)."
)


def describe_plan(options: argparse.Namespace) -> str:
    """Return how many observers are needed, in a sentence, and what fewer and more would do."""
    missing = [name for name in ("difference", "sd") if getattr(options, name) is None]
    if missing:
        fact = "is missing: give --difference and --sd, or --pilot VOTES.csv"
        raise InputError(Fault(f"--{name}", "", fact) for name in missing)
    plan = Plan(
        options.difference,
        options.sd,
        options.comparisons,
        options.correction,
        not options.groups,
        options.power,
        options.alpha,
    )
    needed = observers_needed(plan)
    who = "observers" if plan.paired else "observers in each of two groups"
    several = (
        f", {plan.comparisons} comparisons ({plan.correction})" if plan.comparisons > 1 else ""
    )
    test = "paired t test" if plan.paired else "t test of two groups"
    says = (
        f"{needed} {who}: a difference of {plan.difference:g} with sd {plan.sd:g} is shown with a "
        f"power of {power_of(plan, needed):.2f} ({test}, alpha {plan.alpha:g}{several})."
    )
    lines = [says]
    sizes = sorted({max(2, round(needed * share)) for share in (0.5, 0.75, 1.25, 1.5)} - {needed})
    powers = [f"{size}: {power_of(plan, size):.2f}" for size in sizes]
    lines.append(f"Power with other numbers - {', '.join(powers)}.")
    if needed < 15 and plan.paired:
        lines.append("BT.500 asks for at least 15 observers all the same.")
    return "\n".join(lines)


def write_power(options: argparse.Namespace) -> str:
    """Write the power curves of a pilot as table and figure, and return them as text."""
    given = {"sd": None, "comparisons": 1, "correction": "bonferroni", "groups": False}
    unused = [name for name, default in {**given, "alpha": ALPHA}.items()
              if getattr(options, name) != default]  # fmt: skip
    if unused:
        fact = f"is not used with --pilot (its own spread, its own pairs, Holm at {ALPHA:g})"
        raise InputError(Fault(f"--{name}", "", fact) for name in unused)
    scale = tuple(options.scale) if options.scale else None
    votes, test = read_test(options.pilot, scale)
    sizes = tuple(options.observers or OBSERVERS)
    seed = 1 if options.seed is None else options.seed
    table = power_from_pilot(
        votes, test.scale, observers=sizes, difference=options.difference, seed=seed
    )
    out: Path = options.out or options.pilot.with_name(f"{options.pilot.stem}-plan")
    with result_folder(out, FILES[0], keep=_not_ours) as partial:
        text = to_csv(table, POWER_COLUMNS)
        (partial / FILES[0]).write_text(text, encoding="utf-8", newline="")
        share = count_votes(votes).simulated_share
        draw_power(table, options.power, share, partial / "power")
    wide = table.pivot_table(index="comparison", columns="observers", values="power", sort=False)
    mark, scored = simulated_mark(share), index_votes(votes)
    lines = [f"{mark}: what holds for them may not hold for people"] if mark else []
    whole = whole_grades(scored.vote)
    lines += ["power by number of observers", wide.round(2).to_string(), _SCORES]
    spread = fit_additive(scored).spread
    if whole and spread < SPREAD_LEAST:
        lines.append(
            f"The pilot's whole grades spread by {spread:.2f} only, under half a grade: they do "
            "not tell where between two grades a score lies, and the power may be off."
        )
    if options.difference is not None:
        simulated = float(table["difference"].abs().mean())
        lines += _changed(abs(options.difference), simulated, whole=whole)
    return "\n".join([*lines, *unmarked_robots(scored), f"in {out}"])


def _changed(asked: float, simulated: float, *, whole: bool) -> Iterator[str]:
    """Yield why the simulated difference is not the one that was asked for, where it shows."""
    if f"{simulated:.2f}" != f"{asked:.2f}":
        why = (
            "rounded to whole grades and kept on the scale, which change the difference"
            if whole
            else "kept on the scale, whose ends cut the difference short"
        )
        yield f"{asked:g} lower comes to {simulated:.2f} in the votes: they are {why}."


def _not_ours(out: Path) -> str | None:
    other = sorted(p.name for p in out.iterdir() if p.name not in (*FILES, UNFINISHED))
    return ", ".join(other) or None


def draw_power(table: pd.DataFrame, wanted: float, simulated_share: float, path: Path) -> None:
    """Draw the power of each comparison against the number of observers; a line at `wanted`."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 4.2), layout="constrained")
        axes = figure.subplots()
        for at, (name, rows) in enumerate(table.groupby("comparison", sort=False)):
            if at >= CURVES_DRAWN:
                axes.set_title(f"the first {CURVES_DRAWN}; all in power.csv", loc="right")
                break
            axes.plot(
                rows["observers"],
                rows["power"],
                color=COLOURS[at % len(COLOURS)],
                marker=MARKS[at % len(MARKS)],
                ls="-" if at < len(COLOURS) else "--",
                ms=4.5,
                lw=1.3,
                label=f"{name} ({rows['difference'].mean():+.2f})".replace("-", "\u2212"),
            )
        axes.axhline(wanted, color=INK, lw=0.8, ls=":")
        axes.set_ylim(0, 1.02)
        axes.set_xlabel("observers (pilot: scores and spread by least squares)")
        axes.set_ylabel("power (paired t, Holm)")
        axes.grid(visible=True, axis="y")
        axes.set_axisbelow(True)
        figure.legend(loc="outside right upper", title="(difference of the simulated votes)")
        save(figure, "Power of a larger test", simulated_share, path)
