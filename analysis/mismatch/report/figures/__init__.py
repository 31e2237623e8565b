"""The figures of a diagnosis: which picture shows which mismatch, and how it is saved."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from analysis.figures import STYLE
from analysis.mismatch.bank.coherent import ALTERNATING
from analysis.mismatch.bank.motion import STATISTIC as MOTION
from analysis.mismatch.bank.standing import NAME as FIXED_WAVE
from analysis.mismatch.evidence import Array, Evidence, Histogram, Map, Shown
from analysis.mismatch.finding import Finding, Mismatch
from analysis.mismatch.jumping import NAME as JUMPING
from analysis.mismatch.report.figures import (
    codes,
    curves,
    ladder,
    maps,
    pixels,
    profiles,
    series,
    shifts,
    spectra,
)
from analysis.mismatch.report.sentences import strongest
from analysis.mismatch.words import parted, statistic_words

MOST = 12  # pictures on a page
MAPPED = ("fixed_", "half_seam", "parity", "outlying_")
AXES = {"fixed_row_variance": "rows", "fixed_column_variance": "columns"}
GROUPS: Mapping[str, profiles.Groups] = {"half_seam": "halves", "parity": "parity"}
NOISY_PIXELS = frozenset(
    {"variance_spread", "variance_persistence", "noisy_pixels", "one_off_outliers", JUMPING}
)
OFF_AXIS = frozenset({"spectral_peak", "phase", "alternation_variance", "patch_variance",
                      ALTERNATING})  # fmt: skip
OF_CODES = frozenset({"code_spacing", "code_imbalance"})
_SURFACES = ("fixed_smooth_variance", "fixed_patch_variance", "outlying_patch")
NOISY_PARTS = "smooth_variance_spread"
MANY_PIXELS = frozenset({"fixed_pixel_variance"})
VARIANCE = "pixel_variance"
_MARKS = {".svg": b"<dc:title>dsis</dc:title>", ".png": b"Software\0dsis"}
_METADATA_BYTES = 4096  # before any drawing
_EXPOSURES = 3  # panels of frame means

Size = tuple[float, float]
Look = Literal["", "smooth", "pixels"]
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
        figure.set_layout_engine(None)  # it is laid out: with one it would be drawn twice again
        figure.savefig(png, metadata={"Software": "dsis", "Title": title}, dpi=200)
    return svg.read_bytes()


def drawn_by_dsis(path: Path) -> bool:
    """Tell whether a file is a figure that `save` wrote: its metadata say so."""
    mark = _MARKS.get(path.suffix)
    if mark is None or not path.is_file():
        return False
    with path.open("rb") as file:
        return mark in file.read(_METADATA_BYTES)


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
    beside = [*_patterns(m, name, evidence), *_spectrum(m, name, evidence)]
    beside += _of_frames(m, name, evidence)
    drawn, largest = _curves(m, name, evidence, needed=not beside)
    shown = evidence.shown_in.get(m.statistic)
    # A pattern of every pixel looks like noise: how it grows says more than its map.
    first = name in MANY_PIXELS or (shown is not None and largest > shown.z)
    yield from (*drawn, *beside) if first else (*beside, *drawn)


def _curves(
    m: Mismatch, name: str, evidence: Evidence, *, needed: bool
) -> tuple[list[Picture], float]:
    """Return the curves that leave the band of chance; if one is `needed`, at least the best.

    And the largest departure in them.
    """
    found = []
    for stored in _curve_names(m, name, evidence):
        some = evidence.curves[stored]
        how = curves.draw_transfer if stored == VARIANCE else curves.draw
        draw = partial(how, curves=some, threshold_z=evidence.threshold_z)
        one = Picture(stored, statistic_words(stored), (m,), curves.SIZE_INCHES, draw)
        found.append((max(curves.largest_z(curve) for curve in some), one))
    largest = max((z for z, _ in found), default=0.0)
    least = min(largest, evidence.threshold_z) if needed else evidence.threshold_z
    return [one for z, one in found if z >= least], largest


def _patterns(m: Mismatch, name: str, evidence: Evidence) -> Iterator[Picture]:
    if name in NOISY_PIXELS:
        yield from _map(m, "variance_map", evidence, "pixels")
    elif name == NOISY_PARTS:
        yield from _map(m, "variance_map", evidence, "smooth")
    elif name == FIXED_WAVE and m.statistic in evidence.shown_in:
        yield from _of_map(m, evidence.shown_in[m.statistic].map, evidence)
    elif name.startswith(MAPPED) and m.statistic in evidence.shown_in:
        yield from _pattern(m, name, evidence.shown_in[m.statistic], evidence)


def _of_map(m: Mismatch, wanted: str, evidence: Evidence) -> Iterator[Picture]:
    """Yield the spectrum of a map, the wave that stands out ringed."""
    some = _parts(m, wanted, evidence)
    if some:
        parts = [spectra.of_maps(some)]
        draw = partial(spectra.draw, spectra=parts, where=m.where)
        size = spectra.size_inches(parts)
        yield Picture(f"{wanted}-spectrum", _title(m, wanted), (m,), size, draw)


def _of_frames(m: Mismatch, name: str, evidence: Evidence) -> Iterator[Picture]:
    words = statistic_words(m.statistic)
    if name == "frame_variance" and evidence.series:
        draw = partial(series.draw, shown=_some(m, evidence.series))
        yield Picture("frame-means", words, (m,), series.SIZE_INCHES, draw)
    if name == MOTION and evidence.shifts:
        some = _some(m, evidence.shifts)
        own = partial(shifts.draw, shown=some)
        yield Picture("scene-motion", words, (m,), shifts.size_inches(some), own)
    if name in OF_CODES and evidence.codes:
        key = _oddest(m, evidence.codes)
        draw = partial(codes.draw, histograms=evidence.codes[key])
        yield Picture(f"codes-{key}", f"{words}: {key}", (m,), codes.SIZE_INCHES, draw)


def _spectrum(m: Mismatch, name: str, evidence: Evidence) -> Iterator[Picture]:
    words = statistic_words(m.statistic)
    if name in OFF_AXIS and evidence.spectra:
        key, parts = _at(m, evidence.spectra)
        draw = partial(spectra.draw, spectra=parts, where=m.where)
        yield Picture(f"spectrum-{key}", words, (m,), spectra.size_inches(parts), draw)
    for axis, stem, stored in (
        (1, "row", evidence.row_spectra),
        (0, "column", evidence.column_spectra),
    ):
        if name in (f"{stem}_spectrum_peak", f"slow_{stem}_variance") and stored:
            key, lines = _at(m, stored)
            draw = partial(spectra.draw_lines, spectra=lines, where=m.where, axis=axis)
            size = spectra.LINE_SIZE_INCHES
            yield Picture(f"{stem}-spectrum-{key}", words, (m,), size, draw)


def _pattern(m: Mismatch, name: str, shown: Shown, evidence: Evidence) -> Iterator[Picture]:
    """Yield the picture of a fixed pattern: of lines their means, of a surface a smoothed map."""
    axis = AXES.get(name) or shown.axis
    if axis and (name in AXES or name in GROUPS or name == "fixed_edge"):
        parts = _parts(m, shown.map, evidence)
        if parts:
            groups = GROUPS.get(name, "")
            draw = partial(profiles.draw, maps=parts, axis=axis, groups=groups)
            stem = "-".join(part for part in (shown.map, axis, groups) if part)
            yield Picture(stem, _title(m, shown.map), (m,), profiles.size_inches(parts), draw)
    else:
        looks: dict[str, Look] = dict.fromkeys(_SURFACES, "smooth")
        looks |= dict.fromkeys(MANY_PIXELS | {"outlying_pixels"}, "pixels")
        yield from _map(m, shown.map, evidence, looks.get(name, ""))


def _map(m: Mismatch, wanted: str, evidence: Evidence, look: Look) -> Iterator[Picture]:
    parts = _parts(m, wanted, evidence)
    if not parts:
        return
    alone = m.where.channel if len(parts) == 1 else None
    stem = "-".join(part for part in (wanted, look, alone) if part)
    if look == "pixels":
        size = pixels.size_inches(parts)
        draw: Callable[[Figure], None] = partial(pixels.draw, maps=parts, where=m.where)
    else:
        most = maps.SMOOTH_CELLS if look else maps.MOST_PIXELS
        size = maps.size_inches(parts)
        draw = partial(maps.draw, maps=parts, where=m.where, most_pixels=most)
    yield Picture(stem, _title(m, wanted), (m,), size, draw)


def _parts(m: Mismatch, wanted: str, evidence: Evidence) -> tuple[Map, ...]:
    """Return a map of the channel that a mismatch names, else of all."""
    parts = evidence.maps.get(wanted, ())
    return tuple(p for p in parts if p.channel == m.where.channel) or parts


def _title(m: Mismatch, wanted: str) -> str:
    return f"{statistic_words(m.statistic)}: {wanted.replace('_alone', '').replace('_', ' ')}"


def _curve_names(m: Mismatch, name: str, evidence: Evidence) -> list[str]:
    """Return the curves of a statistic: several where it has directions, or kinds of exposure."""
    if name == "level":
        levels = {"dark": ["dark_level"], "flat": ["level"]}
        wanted = levels.get(m.where.kind or "", ["level", "dark_level"])
        return [stored for stored in wanted if evidence.curves.get(stored)]
    own = [stored for stored in (m.statistic, name) if evidence.curves.get(stored)][:1]
    kinds = [s for s, some in evidence.curves.items() if some and s.startswith(f"{name} ")]
    return [*kinds, *own] if m.statistic == name else own


def _at(m: Mismatch, stored: Mapping[str, Sequence[Part]]) -> tuple[str, Sequence[Part]]:
    """Return the evidence of the one exposure that a mismatch names, else of all pooled."""
    named = m.where.exposures
    wanted = (*(named if len(named) == 1 else ()), "pooled", *named, next(iter(stored)))
    key = next(name for name in wanted if name in stored)
    return key, stored[key]


def _oddest(m: Mismatch, stored: Mapping[str, Sequence[Histogram]]) -> str:
    """Return the exposure, of those that a mismatch names, whose codes differ most."""
    names = [name for name in m.where.exposures if name in stored] or list(stored)
    return max(names, key=lambda name: sum(_distance(one) for one in stored[name]))


def _distance(one: Histogram) -> float:
    """Return how far counts are from those of the base model, relative to their noise."""
    if one.before is None:
        return 0.0
    total = one.counts + one.before
    apart: Array = np.where(total > 0, (one.counts - one.before) ** 2 / np.maximum(total, 1), 0)
    return float(apart.sum() / max(int((total > 0).sum()), 1))


def _some(m: Mismatch, stored: Mapping[str, Part]) -> dict[str, Part]:
    """Return the evidence of the first, middle and last exposure that a mismatch names."""
    names = [name for name in m.where.exposures if name in stored] or list(stored)
    last = len(names) - 1
    chosen = dict.fromkeys(names[round(last * i / (_EXPOSURES - 1))] for i in range(_EXPOSURES))
    return {name: stored[name] for name in chosen}
