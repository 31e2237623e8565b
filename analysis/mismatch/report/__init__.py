"""The report of a diagnosis: one self-contained page that needs no network."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from analysis.mismatch.evidence import Evidence
from analysis.mismatch.finding import Finding, Mismatch
from analysis.mismatch.model import apart
from analysis.mismatch.remarks import NO_FLATS, as_far_as
from analysis.mismatch.report.figures import Picture, ladder_picture, pictures, save
from analysis.mismatch.report.numbers import interval, measured, plain
from analysis.mismatch.report.sentences import (
    because,
    considered,
    credited,
    gain,
    joined,
    numbers_in_short,
    parameters,
    strongest,
    tie,
    verdict,
)
from analysis.mismatch.words import (
    effect_says,
    effect_words,
    listed,
    parted,
    place,
    statistic_words,
    unit,
)
from analysis.page import embedded, render_page
from dsis import __version__

HEADLINES = {
    "match": "Simulation and recording agree",
    "parameters": "No physics is seen to be missing, but numbers are off",
    "omitted_physics": "The simulation leaves out physics",
    "unexplained": "Something differs that is not explained",
}
IN_DARKS = {
    "match": "In darks simulation and recording agree",
    "parameters": "In darks no physics is seen to be missing, but numbers are off",
}
LOCATED = "Simulation and recording differ"
TEMPLATE = Path(__file__).with_name("report.html.jinja")
_FIRST_PAGE = 8  # kinds of departure listed before the details
_SAID = 3  # sentences below a picture


def headline(finding: Finding) -> str:
    """Return the verdict in a line."""
    if finding.verdict == "unexplained" and not finding.searched:
        return LOCATED
    if NO_FLATS in finding.remarks and finding.verdict in IN_DARKS:
        return IN_DARKS[finding.verdict]
    limit = as_far_as(finding.remarks) if finding.verdict == "match" else ""
    if limit:
        return f"{HEADLINES['match']} {limit}"
    return HEADLINES[finding.verdict]


@dataclass(frozen=True)
class Difference:
    """Departures of one statistic that have one explanation: a line of the first table."""

    words: str
    where: str
    z: float
    z_after: float
    explained: str
    says: str
    count: int


def write_page(finding: Finding, folder: Path, origin: str = "") -> None:
    """Write `report.html` and `figures/` into a folder; same finding, same bytes.

    Parameters
    ----------
    finding
        What was found; without evidence there are no pictures but the ladder.
    folder
        An existing one.
    origin
        What was compared, in its first line; below it source, copyright, licence.
    """
    figures = folder / "figures"
    figures.mkdir(exist_ok=True)
    ladder, some = ladder_picture(finding), pictures(finding)
    drawn = apart(partial(save, folder=figures), [*some, *([] if ladder is None else [ladder])])
    shown = [_shown(picture, svg, finding) for picture, svg in zip(some, drawn, strict=False)]
    page = render(finding, shown, "" if ladder is None else embedded(drawn[-1]), origin)
    (folder / "report.html").write_text(page, encoding="utf-8", newline="")


def render(
    finding: Finding, shown: Sequence[dict[str, Any]], ladder_svg: str, origin: str = ""
) -> str:
    """Return the page: HTML that holds its style and its figures."""
    filters: dict[str, Callable[..., Any]] = {
        "plain": plain,
        "gain": gain,
        "statistic": statistic_words,
        "effect": effect_words,
        "effect_says": effect_says,
        "unit": unit,
        "place": place,
        "because": because,
        "tie": tie,
    }
    evidence = finding.evidence if isinstance(finding.evidence, Evidence) else Evidence()
    differences = _differences(finding)
    values = {
        "finding": finding,
        "headline": headline(finding),
        "searched": finding.searched,
        "verdict": verdict(finding),
        "origin": [line for line in origin.splitlines() if line],
        "effects": [(e, parameters(e)) for e in finding.omitted_physics],
        "differences": differences[:_FIRST_PAGE],
        "several": any(one.count > 1 for one in differences[:_FIRST_PAGE]),
        "more": len(differences) - _FIRST_PAGE,
        "mismatches": strongest(finding.mismatches),
        "unexplained": strongest(finding.unexplained),
        "errors": [(e, measured(e.recorded, e.standard_error)) for e in finding.parameter_errors],
        "considered": considered(finding),
        "proof": finding.proof,
        "locked": _locked(finding),
        "evidence": evidence,
        "pictures": shown,
        "ladder": ladder_svg,
        "interval": interval,
        "version": __version__,
    }
    return render_page(TEMPLATE, values, filters)


def _differences(finding: Finding) -> list[Difference]:
    grouped: dict[tuple[str, str], list[Mismatch]] = {}
    for mismatch in strongest([*finding.mismatches, *_only_unexplained(finding)]):
        key = (parted(mismatch.statistic)[0], credited(mismatch, finding))
        grouped.setdefault(key, []).append(mismatch)
    return [_difference(some, explained) for (_, explained), some in grouped.items()]


def _difference(some: Sequence[Mismatch], explained: str) -> Difference:
    first = some[0]
    after = [m.z_after for m in some if not np.isnan(m.z_after)]
    statistics = {m.statistic for m in some}
    words = first.statistic if len(statistics) == 1 else parted(first.statistic)[0]
    return Difference(
        statistic_words(words),
        place(first.where),
        first.z,
        max(after, key=abs, default=float("nan")),
        explained,
        first.says,
        len(some),
    )


def _only_unexplained(finding: Finding) -> list[Mismatch]:
    """Return what is left over that the base model's departures do not list already."""
    listed_too = {(m.statistic, m.where) for m in finding.mismatches}
    return [m for m in finding.unexplained if (m.statistic, m.where) not in listed_too]


def _locked(finding: Finding) -> list[tuple[str, str]]:
    """Return (exposures, frames) of the proof; exposures with the same frames share a line."""
    alike: dict[tuple[int, ...], list[str]] = {}
    for name, frames in finding.proof.heldout_frames.items():
        alike.setdefault(tuple(frames), []).append(name)
    return [
        (listed(tuple(names), "exposures"), numbers_in_short(frames))
        for frames, names in alike.items()
    ]


def _shown(picture: Picture, svg: bytes, finding: Finding) -> dict[str, Any]:
    explained = dict.fromkeys(credited(m, finding) for m in picture.mismatches)
    names = [name for name in explained if name]
    some = " in part" if names and "" in explained else ""
    return {
        "name": picture.name,
        "title": picture.title[0].upper() + picture.title[1:],
        "says": list(dict.fromkeys(m.says for m in picture.mismatches))[:_SAID],
        "explained": f"{joined(names) or 'nothing yet'}{some}",
        "svg": embedded(svg),
    }
