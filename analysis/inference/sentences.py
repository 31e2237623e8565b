"""Conclusions in words: what the contrasts say, with their numbers."""

from collections.abc import Hashable
from typing import Any

import pandas as pd

from analysis.inference.design import ALL, CELL, CONTENT, OVERALL

SIGNIFICANT = 0.05
NAMES = {"bilinear": "bilinear", "dlmmse": "DLMMSE", "lu_tan": "Lu-Tan"}
HELD = {"awgn": "white noise", "sd": "signal-dependent noise", "none": "no demosaicking"}


def conclusions(contrasts: pd.DataFrame) -> list[str]:
    """Return a sentence per contrast: overall first, then by content, then pair by pair.

    "Demosaicking (bilinear) lowers the MOS by 2.31 [1.80, 2.82] on city ..." with the
    Holm-adjusted p of the paired t test; where that is above 0.05, that no effect is shown.

    Parameters
    ----------
    contrasts
        `analysis.test_contrasts`.
    """
    order = {OVERALL: 0, CONTENT: 1, CELL: 2}
    table = contrasts.assign(rank=contrasts["grain"].map(order))
    table = table.sort_values(["rank", "question", "treatment"], kind="stable")
    return [_sentence(row) for row in table.to_dict("records")]


def _sentence(row: dict[Hashable, Any]) -> str:
    subject, where = _subject(row), _where(row)
    n, difference, p = int(row["n"]), float(row["difference"]), float(row["p_t_holm"])
    if n == 0:
        return f"{subject} cannot be judged {where}: no observer saw both."
    if p != p:  # noqa: PLR0124  nan: one observer, or all differ by the same
        how = "one observer" if n == 1 else f"all {n} observers alike"
        return f"{subject} {_verb(difference)} {where} ({how}; no test)."
    low, high = sorted((abs(float(row["ci_low"])), abs(float(row["ci_high"]))))
    numbers = f"paired t, n = {n}, p {_p(p)} after Holm"
    if p < SIGNIFICANT:
        return f"{subject} {_verb(difference)} [{low:.2f}, {high:.2f}] {where} ({numbers})."
    interval = f"[{row['ci_low']:+.2f}, {row['ci_high']:+.2f}]"
    interval = interval.replace("-", "\u2212")
    shift = f"{difference:+.2f}".replace("-", "\u2212")
    return f"{subject} shows no significant effect {where}: {shift} {interval} ({numbers})."


def _subject(row: dict[Hashable, Any]) -> str:
    if row["question"] == "noise":
        return "Signal-dependent instead of white noise"
    method = str(row["treatment"]).split(" - ", maxsplit=1)[0]
    return f"Demosaicking ({NAMES.get(method, method)})"


def _verb(difference: float) -> str:
    if difference == 0:
        return "does not change the MOS"
    verb = "lowers" if difference < 0 else "raises"
    return f"{verb} the MOS by {abs(difference):.2f}"


def _where(row: dict[Hashable, Any]) -> str:
    content, within, level = str(row["content"]), str(row["within"]), str(row["level"])
    place = "over all contents" if content == ALL else f"on {content}"
    if within not in (ALL, ""):
        held = HELD.get(within, f"{NAMES.get(within, within)} demosaicking")
        place += f" with {held}"
    if level not in (ALL, "", "0"):
        place += f", {level} stop{'' if level == '1' else 's'} under-exposed"
    return place


def _p(p: float) -> str:
    return "< 0.001" if p < 0.001 else f"= {p:.3f}"
