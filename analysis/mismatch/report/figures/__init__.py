"""The figures of a diagnosis: which picture shows which mismatch, and how it is saved."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import matplotlib as mpl
from matplotlib.figure import Figure

from analysis.figures import STYLE
from analysis.mismatch.evidence import Evidence
from analysis.mismatch.finding import Finding, Mismatch
from analysis.mismatch.report.figures import codes, curves, ladder, maps, series, spectra
from analysis.mismatch.report.sentences import strongest
from analysis.mismatch.report.words import parted, statistic_words

MOST = 12  # pictures on a page
OFFSET = frozenset({"dsnu", "row_fpn", "column_fpn"})
TIME = frozenset({"hot_pixels", "dark_current", "amp_glow"})
MAPPED = ("fixed_", "half_seam", "parity", "channel_ratio", "pattern_growth", "outlying_pixels")
NOISY_PIXELS = frozenset({"variance_spread", "variance_persistence", "one_off_outliers"})
OFF_AXIS = frozenset({"spectral_peak", "phase"})
OF_CODES = frozenset({"code_spacing", "code_imbalance"})
_EXPOSURES = 3  # panels of frame means

Size = tuple[float, float]
Part = TypeVar("Part")


@dataclass(frozen=True)
class Picture:
    """A figure, and the mismatches that it shows, the largest first."""

    name: str
    title: str
    mismatches: tuple[Mismatch, ...]
    size_inches: Size
    draw: Callable[[Figure], None]


def pictures(finding: Finding) -> tuple[Picture, ...]:
    """Return a picture for each statistic that differs, as the evidence has it; at most `MOST`.

    The strongest of each explanation, and of what is unexplained, come first: a weak effect is
    not crowded out by a strong one.
    """
    evidence = finding.evidence
    if not isinstance(evidence, Evidence):
        return ()
    found: dict[str, Picture] = {}
    for mismatch in _in_turn(finding):
        for one in _of(mismatch, evidence):
            name = re.sub(r"[^\w.-]+", "-", one.name)  # a file is named so
            seen = found.get(name, replace(one, name=name, mismatches=()))
            found[name] = replace(seen, mismatches=(*seen.mismatches, mismatch))
    return tuple(found.values())[:MOST]


def ladder_picture(finding: Finding) -> Picture | None:
    """Return the ladder of held-out gains; None where no gain was computed."""
    lines = ladder.rungs(finding)
    if not lines:
        return None
    draw = partial(ladder.draw, ladder=lines)
    return Picture("ladder", "Held-out gains", (), ladder.size_inches(lines), draw)


def save(picture: Picture, folder: Path) -> bytes:
    """Write NAME.svg and NAME.png (200 dots per inch) into a folder; return the SVG."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=picture.size_inches, layout="constrained")
        picture.draw(figure)
        svg, png = (folder / f"{picture.name}.{end}" for end in ("svg", "png"))
        title = picture.title
        figure.savefig(svg, metadata={"Date": None, "Creator": "dsis", "Title": title}, dpi=200)
        figure.savefig(png, metadata={"Software": "dsis", "Title": title}, dpi=200)
    return svg.read_bytes()


def _in_turn(finding: Finding) -> Iterator[Mismatch]:
    """Yield mismatches: first the strongest of each explanation, then the others by size."""
    unexplained = [m for m in finding.unexplained if m not in finding.mismatches]
    ordered = strongest([*finding.mismatches, *unexplained])
    first: dict[str | None, Mismatch] = {}
    for mismatch in ordered:
        first.setdefault(mismatch.explained_by, mismatch)
    yield from first.values()
    yield from (m for m in ordered if m is not first[m.explained_by])


def _of(m: Mismatch, evidence: Evidence) -> Iterator[Picture]:
    """Yield the pictures that show a mismatch, as far as there is evidence for them."""
    name = parted(m.statistic)[0]
    words = statistic_words(m.statistic)
    if name.startswith(MAPPED) or name in NOISY_PIXELS:
        yield from _map(m, name, evidence)
    if name in OFF_AXIS and evidence.spectra:
        key, parts = _at(m, evidence.spectra)
        draw = partial(spectra.draw, spectra=parts, where=m.where)
        yield Picture(f"spectrum-{key}", words, (m,), spectra.size_inches(parts), draw)
    for axis, stem, stored in (
        (1, "row", evidence.row_spectra),
        (0, "column", evidence.column_spectra),
    ):
        if name == f"{stem}_spectrum_peak" and stored:
            key, lines = _at(m, stored)
            draw = partial(spectra.draw_lines, spectra=lines, where=m.where, axis=axis)
            size = spectra.LINE_SIZE_INCHES
            yield Picture(f"{stem}-spectrum-{key}", words, (m,), size, draw)
    if name == "frame_variance" and evidence.series:
        shown = _some(m, evidence.series)
        stem = "frame-means"
        yield Picture(stem, words, (m,), series.SIZE_INCHES, partial(series.draw, shown=shown))
    if name in OF_CODES and evidence.codes:
        key, counted = _at(m, evidence.codes)
        draw = partial(codes.draw, histograms=counted)
        yield Picture(f"codes-{key}", words, (m,), codes.SIZE_INCHES, draw)
    for stored_name in dict.fromkeys((m.statistic, name)):
        if evidence.curves.get(stored_name):
            drawn = evidence.curves[stored_name]
            draw = partial(curves.draw, curves=drawn, threshold_z=evidence.threshold_z)
            yield Picture(stored_name, statistic_words(stored_name), (m,), curves.SIZE_INCHES, draw)
            break


def _map(m: Mismatch, name: str, evidence: Evidence) -> Iterator[Picture]:
    for wanted in _map_names(m, name):
        parts = evidence.maps.get(wanted, ())
        channel = m.where.channel
        parts = tuple(p for p in parts if p.channel == channel) or parts
        if parts:
            stem = wanted if len(parts) > 1 or channel is None else f"{wanted}-{channel}"
            title = f"{statistic_words(m.statistic)}: {wanted.replace('_', ' ')}"
            draw = partial(maps.draw, maps=parts, where=m.where)
            yield Picture(stem, title, (m,), maps.size_inches(parts), draw)


def _map_names(m: Mismatch, name: str) -> tuple[str, ...]:
    """Return which maps may show it: of offsets, gains, growth in time, or noise."""
    if name in NOISY_PIXELS:
        return ("variance_map",)
    detail = parted(m.statistic)[1].split()
    named = tuple(f"{word}_map" for word in ("offset", "gain", "time") if word in detail)
    if named:
        return named
    if m.explained_by in TIME or m.where.exposure_time_s is not None:
        return ("time_map",)
    if m.explained_by in OFFSET or m.where.kind == "dark":
        return ("offset_map",)
    known = m.explained_by is not None or m.where.kind == "flat"
    return ("gain_map",) if known else ("offset_map", "gain_map")


def _at(m: Mismatch, stored: Mapping[str, Sequence[Part]]) -> tuple[str, Sequence[Part]]:
    """Return the evidence of the exposure that a mismatch names, else of all pooled."""
    wanted = (*m.where.exposures, "pooled", next(iter(stored)))
    key = next(name for name in wanted if name in stored)
    return key, stored[key]


def _some(m: Mismatch, stored: Mapping[str, Sequence[Part]]) -> dict[str, Sequence[Part]]:
    """Return the evidence of the first, middle and last exposure that a mismatch names."""
    names = [name for name in m.where.exposures if name in stored] or list(stored)
    last = len(names) - 1
    chosen = dict.fromkeys(names[round(last * i / (_EXPOSURES - 1))] for i in range(_EXPOSURES))
    return {name: stored[name] for name in chosen}
