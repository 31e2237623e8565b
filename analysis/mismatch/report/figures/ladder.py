"""The ladder of held-out gains: what each effect buys on frames that no fit has seen."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, SymmetricalLogLocator

from analysis.figures import COLOURS, GREY, INK
from analysis.mismatch.finding import Finding, Gain
from analysis.mismatch.report.figures.ticks import plain_numbers
from analysis.mismatch.report.numbers import plain
from analysis.mismatch.report.sentences import effect_label
from analysis.mismatch.words import effect_words

_LINEAR = 1.0  # nats per frame: within, the scale is linear
LOOKS = {
    "named": (COLOURS[0], COLOURS[0]),
    "considered": (GREY, "white"),
    "undecided": (COLOURS[4], COLOURS[4]),
}


@dataclass(frozen=True)
class Rung:
    """One line of the ladder; `state`: a key of `LOOKS`."""

    label: str
    gain: Gain
    state: str


def rungs(finding: Finding) -> list[Rung]:
    """Return the lines: each named effect, below it what was considered in its place.

    A gain that no locked frame tells has no line.
    """
    found = []
    for effect in finding.omitted_physics:
        found.append(Rung(effect_label(effect), effect.heldout_gain, "named"))
        found += [
            Rung(f"instead: {effect_words(a.effect)}", a.heldout_gain, "considered")
            for a in effect.alternatives
            if a.heldout_gain is not None
        ]
    found += [
        Rung(effect_words(a.effect), a.heldout_gain, "undecided")
        for a in finding.undecided
        if a.heldout_gain is not None
    ]
    return [rung for rung in found if math.isfinite(rung.gain.nats_per_frame)]


def size_inches(ladder: Sequence[Rung]) -> tuple[float, float]:
    """Return width and height of the figure."""
    return 8.0, 1.1 + 0.27 * len(ladder)


def draw(figure: Figure, ladder: Sequence[Rung]) -> None:
    """Draw gains with their 95 % intervals; left of zero an effect predicts worse than none."""
    axes = figure.subplots()
    for place, rung in enumerate(ladder):
        line, face = LOOKS[rung.state]
        value, ends = rung.gain.nats_per_frame, rung.gain.ci95
        known = all(map(math.isfinite, ends))
        bars = [[max(value - ends[0], 0)], [max(ends[1] - value, 0)]] if known else None
        axes.errorbar(
            [value], [place], xerr=bars, fmt="o", color=line, mfc=face, ms=6, lw=1.4, capsize=3
        )
    axes.axvline(0, color=INK, lw=0.9)
    axes.set_yticks(range(len(ladder)), [rung.label for rung in ladder])
    for text, rung in zip(axes.get_yticklabels(), ladder, strict=True):
        text.set(fontweight="bold" if rung.state == "named" else "normal")
    axes.set_ylim(len(ladder) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("gain of log-likelihood on the locked frames, nats per frame")
    axes.grid(visible=True, axis="x")
    axes.set_axisbelow(True)
    _scale(axes, [v for r in ladder for v in (r.gain.nats_per_frame, *r.gain.ci95)])
    for state, (line, face) in LOOKS.items():
        if any(rung.state == state for rung in ladder):
            axes.plot([], [], "o", color=line, mfc=face, label=state)
    axes.legend(loc="best")


def _scale(axes: Axes, values: Sequence[float]) -> None:
    """Choose a scale on which the smallest and the largest gain are both seen."""
    sizes = [abs(v) for v in values if math.isfinite(v)]
    if max(sizes, default=0.0) <= 20 * _LINEAR:
        axes.xaxis.set_major_locator(MaxNLocator(7))
        return
    axes.set_xscale("symlog", linthresh=_LINEAR, linscale=0.6)
    axes.xaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=_LINEAR))
    axes.set_xlabel(f"{axes.get_xlabel()}\nlogarithmic beyond ±{plain(_LINEAR)}")
    plain_numbers(axes.xaxis)
