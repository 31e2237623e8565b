"""The paper's questions as contrasts of stimuli: demosaicked or not, camera noise or white.

A contrast is a weighted sum of stimuli. The paired tests, the linear and the ordinal mixed model
all answer for the same contrasts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.votes import CONDITION, Indexed

ALL = "all"
CELL, CONTENT, OVERALL = "cell", "content", "overall"
UNDEMOSAICKED = "none"
CAMERA, WHITE = "sd", "awgn"


@dataclass(frozen=True)
class Contrast:
    """One comparison: the mean of the stimuli `plus` less that of the stimuli `minus`.

    Attributes
    ----------
    question
        `demosaicking` or `noise`.
    treatment
        What is compared: `bilinear - none`, `sd - awgn`.
    grain
        `cell`: one pair of stimuli; `content`: the pairs of a content averaged; `overall`: all
        pairs.
    content, within, level
        Where: content, the factor that is held (noise, or demosaicking), stops; `all` where
        averaged.
    plus, minus
        Rows of the table of stimuli, pairwise.
    """

    question: str
    treatment: str
    grain: str
    content: str
    within: str
    level: str
    plus: tuple[int, ...]
    minus: tuple[int, ...]

    def weights(self, stimuli: int) -> NDArray[np.float64]:
        """Return the weight of each stimulus, (stimulus,)."""
        weights = np.zeros(stimuli)
        np.add.at(weights, list(self.plus), 1 / len(self.plus))
        np.add.at(weights, list(self.minus), -1 / len(self.minus))
        return weights


def list_contrasts(scored: Indexed) -> list[Contrast]:
    """Return all contrasts that the conditions of a test allow, none where they are not named.

    A pair of stimuli differs in demosaicking alone (a method against none), or in noise alone
    (signal-dependent against white). For every question and method: each pair, the pairs of each
    content, and all pairs.
    """
    tests = _named(scored)
    if tests[list(CONDITION)].duplicated().any():
        return []
    methods = [name for name in dict.fromkeys(tests["demosaic"]) if name != UNDEMOSAICKED]
    found: list[Contrast] = []
    for method in methods:
        found += _question("demosaicking", tests, "demosaic", (method, UNDEMOSAICKED), "noise")
    return found + _question("noise", tests, "noise", (CAMERA, WHITE), "demosaic")


def not_comparable(scored: Indexed) -> Iterator[str]:
    """Yield why no conditions can be compared; nothing where they can.

    A sentence for each condition that several stimuli share; else which columns of the votes are
    missing, or that no two stimuli are a pair.
    """
    tests = _named(scored)
    yield from _alike(tests)
    if tests.empty:
        yield f"No comparison of conditions: {_unnamed(scored)}."
    elif not tests[list(CONDITION)].duplicated().any() and not list_contrasts(scored):
        yield (
            "No comparison of conditions: no two sequences of one content and level differ in "
            f"demosaic alone (a method against {UNDEMOSAICKED}) or in noise alone ({CAMERA} "
            f"against {WHITE})."
        )


def _unnamed(scored: Indexed) -> str:
    """Return which columns do not say what is compared."""
    stimuli = scored.stimuli[scored.stimuli["kind"] == "test"]
    blank = [name for name in ("noise", "demosaic") if (stimuli[name] == "").all()]
    if not blank:
        return "no sequence has both a noise and a demosaic in these columns of the votes"
    columns = f"column{'s' if len(blank) > 1 else ''} {' and '.join(blank)}"
    return f"the votes lack the {columns} (missing, or blank everywhere)"


def _alike(tests: pd.DataFrame) -> Iterator[str]:
    for values, sharing in tests.groupby(list(CONDITION), dropna=False, sort=False):
        if len(sharing) == 1:
            continue
        content, noise, demosaic, level = values
        stops = f", level {_level(level)}" if _level(level) else ""
        yield (
            f"No comparison of conditions: {', '.join(sharing['stimulus'])} are the same condition "
            f"(content {content or 'blank'}, noise {noise}, demosaicking {demosaic}{stops}), which "
            "must be one sequence."
        )


def _named(scored: Indexed) -> pd.DataFrame:
    """Return the test stimuli that name noise and demosaicking."""
    stimuli = scored.stimuli
    tests = stimuli[stimuli["kind"] == "test"]
    return tests[(tests["noise"] != "") & (tests["demosaic"] != "")]


def _question(
    question: str, tests: pd.DataFrame, factor: str, sides: tuple[str, str], held: str
) -> list[Contrast]:
    cells = list(_cells(question, tests, factor, sides, held))
    found = list(cells)
    contents = list(dict.fromkeys(cell.content for cell in cells))
    for content in contents:
        mine = [cell for cell in cells if cell.content == content]
        if len(mine) > 1:
            found.append(_averaged(mine, CONTENT, content))
    if len(contents) > 1:
        found.append(_averaged(cells, OVERALL, ALL))
    return found


def _cells(
    question: str, tests: pd.DataFrame, factor: str, sides: tuple[str, str], held: str
) -> Iterator[Contrast]:
    keys = ["content", held, "level"]
    at = tests.assign(row=tests.index)
    plus, minus = (at[at[factor] == side][[*keys, "row"]] for side in sides)
    pairs = plus.merge(minus, on=keys, suffixes=("_plus", "_minus"))
    treatment = f"{sides[0]} - {sides[1]}"
    for pair in pairs.to_dict("records"):
        level = _level(pair["level"])
        where = (pair["content"], pair[held], level)
        rows = ((int(pair["row_plus"]),), (int(pair["row_minus"]),))
        yield Contrast(question, treatment, CELL, *where, *rows)


def _level(level: Any) -> str:
    return "" if pd.isna(level) else f"{level:g}"


def _averaged(cells: list[Contrast], grain: str, content: str) -> Contrast:
    first = cells[0]

    def common(values: list[str]) -> str:
        return values[0] if len(set(values)) == 1 else ALL

    return Contrast(
        first.question,
        first.treatment,
        grain,
        content,
        common([cell.within for cell in cells]),
        common([cell.level for cell in cells]),
        tuple(row for cell in cells for row in cell.plus),
        tuple(row for cell in cells for row in cell.minus),
    )
