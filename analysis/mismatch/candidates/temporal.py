"""Lines and frames that move together: row and column noise, drift, flicker, bands, patterns."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf, isfinite, log, pi, sqrt

import numpy as np

from analysis.mismatch.bank import periods
from analysis.mismatch.bank.coherent import RANKS, line_name
from analysis.mismatch.bank.movingbands import KIND as MOVING_PLACE
from analysis.mismatch.bank.movingbands import LABEL as MOVING
from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.scalars import UNKNOWN
from analysis.mismatch.candidates.candidate import Candidate, Proposal, measured, proposals
from analysis.mismatch.clues import NO_LINE, Clues, alike
from analysis.mismatch.framewalk import Walk, means_of, walk_of
from analysis.mismatch.instance import Frequency, same_line
from analysis.mismatch.layout import Layout
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift

_ALTERNATING = {"checkerboard": ((0.5, 0.5),), "rows": ((0.0, 0.5),), "columns": ((0.5, 0.0),)}
_BY_PLANE = {  # of a mosaic: what alternates in each of its planes
    "checkerboard": ((0.25, 0.25), (0.25, -0.25)),
    "rows": ((0.0, 0.25), (0.5, 0.25)),
    "columns": ((0.25, 0.0), (0.25, 0.5)),
}
# Most of pink noise is in the slowest waves across lines: one of them may stand out.
_SLOW = ("row_variance", "slow_row_variance", "row_correlation", "line_correlation",
         "frame_variance", "row_spectrum_peak", "column_variance", "column_spectrum_peak",
         "slow_column_variance", "column_correlation")  # fmt: skip
_CLEAR = 3.0  # standard errors of what columns vary by
_BANDS = {
    "rows of light": "row_spectrum_peak of light",
    MOVING_PLACE: MOVING,
    "rows": "row_spectrum_peak",
}
_PERSISTS = 1.0  # of log-likelihood: more than a parameter gains by chance (Akaike, 1974)
_TINY = 1e-300
_WAVES = 64  # a row: means over rows have next to nothing of shorter ones
_PARABOLA = 1.3  # scatter of a parabola's top on half bins, over the bound (Rife & Boorstyn, 1974)
_HALVES = (0.0, 0.5)  # cycles per pixel, modulo which a plane of a mosaic sees frequencies
_LEAST_POWER = 1.2  # of a line worth a trial, white noise at 1


def _lines(kind: str, statistic: str) -> Candidate:
    def propose(clues: Clues) -> Sequence[Proposal]:
        variance, _ = clues.amplitude(statistic, alike)
        return proposals(kind, ["sigma_dn"], sigma_dn=sqrt(variance)) if variance > 0 else []

    return Candidate(kind, (statistic,), propose)


def _drift(clues: Clues) -> Sequence[Proposal]:
    """Start from the weighted mean of what exposures show, or from the likeliest wander.

    The mean may be none: errors grow with what is seen, so quiet exposures outweigh restless ones.
    """
    variance, _ = clues.amplitude("frame_variance", alike)
    walk = _walk(clues)
    if walk is None and variance <= 0:
        return []
    if walk is None or walk.gain < _PERSISTS:
        size = sqrt(variance) if walk is None or variance > 0 else walk.white_dn
        return proposals("black_level_drift", ["sigma_dn"], sigma_dn=size)
    values = {"sigma_dn": walk.sigma_dn, "persistence": walk.persistence}
    start = proposals("black_level_drift", (), (), **values)
    return [measured(own, values, walk.errors) for own in start]


def _walk(clues: Clues) -> Walk | None:
    """Return how the means of whole frames wander; None: it is not seen, or is the camera's own."""
    if any(isinstance(own, BlackLevelDrift) for own in clues.camera.effect):
        return None
    channels = clues.layout.channels

    def signal_dn(exposure: str) -> float:
        return float(np.mean([clues.signal((exposure, c)) for c in channels]))

    found = means_of(clues.seen.lines, clues.layout.uniform, clues.camera.effect, signal_dn)
    return walk_of(list(found.values()))


def _flicker(clues: Clues) -> Sequence[Proposal]:
    """Start from the weighted mean of what lit exposures show, and from their middle one.

    The brightest tell most, and of few frames may show a tenth of the variance that is there.
    """
    excess = clues.excess("frame_variance")
    lit = {at: value for at, (value, _) in excess.items() if clues.signal(at) > 0}
    variance, _ = clues.amplitude("frame_variance", lambda place: clues.signal(place) ** 2)
    shares = [value / clues.signal(at) ** 2 for at, value in lit.items()]
    found: list[Proposal] = []
    for own in (variance, float(np.median(shares)) if shares else 0.0):
        if own > 0:
            found += proposals("flicker", ["sigma_percent"], sigma_percent=100 * sqrt(own))
    return found


def _line_flicker(clues: Clues) -> Sequence[Proposal]:
    """Start from the clearest of peaks: of bands that grow with light, move on, or are alike in DN.

    How high a peak is tells nothing of where it is: no trial finds the right one of several.
    """
    found = {
        kind: own
        for kind in _BANDS
        if (own := clearest(clues, kind)) is not None and _cycles(clues, *own) > 0
    }
    if not found:
        return []

    def score(kind: str) -> float:
        value, _ = clues.seen.pooled[found[kind][0]].get(_BANDS[kind], UNKNOWN)
        return value if isfinite(value) else -inf

    channel, peak = found[max(found, key=score)]
    bright = _brightness(clues, channel)
    mean = sum(w * b for b, w in bright) / max(sum(w for _, w in bright), _TINY)
    if not mean > 0:
        return []
    n, m = clues.shape(channel)
    excess = max(peak.power - 1, 0.05)
    depth = 2 * sqrt(excess / (n * m * mean))  # of power d^2 S^2 n m / (4 v) beyond noise
    frames = sum(w for _, w in bright) ** 2 / sum(w * b for b, w in bright)
    made = proposals(
        "line_flicker",
        ["depth_percent"],
        depth_percent=100 * depth,
        cycles_per_frame=_cycles(clues, channel, peak),
    )
    error = _PARABOLA * sqrt(6 / (excess * frames)) / (2 * pi) / clues.layout.seen_cycles(1.0)
    return [replace(one, errors={"cycles_per_frame": error}) for one in made]


def _of_a_lamp(layout: Layout, effect: Effect) -> bool:
    """Return whether bands are wider than a row: a lamp's, and not of every other row.

    Two fields of a frame, or two amplifiers, have light that goes up and down from each row to the
    next, and a lamp once in as many cases as there are rows.
    """
    cycles = layout.seen_cycles(float(effect.model_dump()["cycles_per_frame"]))
    return cycles < (layout.rows - 1) / 2


def _cycles(clues: Clues, channel: str, peak: Peak) -> float:
    """Return cycles per frame of a peak."""
    return (peak.fy * clues.shape(channel)[0] + peak.off) / clues.layout.seen_cycles(1.0)


def _brightness(clues: Clues, channel: str) -> list[tuple[float, float]]:
    """Return S^2 / v of each place with light, and the weight that its frames have."""
    places = [p for p in clues.places if channel in ("", p[1]) and clues.signal(p) > 0]
    bright = [clues.signal(p) ** 2 / clues.seen.levels[p].variance_dn2 for p in places]
    return [(b, b * (clues.frames(p[0]) - 1)) for p, b in zip(places, bright, strict=True)]


def _pink(clues: Clues) -> Sequence[Proposal]:
    """Start from the size that makes rows vary as they do; where they do not, frames.

    In a frame's mean is a single number of each frame, in its rows many: these know the size. Of a
    sensor that is read column by column columns do, where they clearly vary.
    """
    rows, columns = clues.layout.rows, clues.layout.columns
    row, _ = clues.amplitude("row_variance", alike)
    frame, _ = clues.amplitude("frame_variance", alike)
    of_row, of_frame = pink_shares(rows, columns)
    variances = {"rows": row / of_row if row > 0 else frame / of_frame}
    column, error = clues.amplitude("column_variance", alike)
    if column > _CLEAR * error:
        variances["columns"] = column / pink_shares(columns, rows)[0]
    return [
        one
        for along, variance in variances.items()
        if variance > 0
        for size in (sqrt(variance), sqrt(variance / 3))  # what else makes lines vary has a part
        for one in proposals("pink_noise", ["sigma_dn"], sigma_dn=size, along=along)
    ]


def pink_shares(rows: int, columns: int) -> tuple[float, float]:
    """Return which shares of the variance of 1/f noise along rows are those of rows, and of frames.

    A mean over n of N samples keeps sinc^2(k n / N) of the wave of k cycles in N; here N are two
    frames, and waves have 1 / k. Their sum is ln(N / 2) and Euler's constant, nearly. Components
    are those of the balanced two-way model, in expectation.
    """
    k = np.arange(1, _WAVES * rows)
    total = log(rows * columns) + np.euler_gamma
    of_row = float((np.sinc(k / (2 * rows)) ** 2 / k).sum()) / total
    of_frame = float((np.sinc(k / 2) ** 2 / k).sum()) / total
    moved = rows / max(rows - 1, 1) * (of_row - of_frame)
    single = (1 - of_row) / max(columns - 1, 1)  # of pixels, over the samples of a row
    return moved - single, of_frame - moved / rows


def _patterns(kind: str) -> Candidate:
    def propose(clues: Clues) -> Sequence[Proposal]:
        found: list[Proposal] = []
        for fx, fy, amplitude in frequencies(clues, kind):
            corner = abs(fx) in (0.0, 0.5) and abs(fy) in (0.0, 0.5)
            size = amplitude / 2 if corner and kind == "bistable_pattern" else amplitude
            found += proposals(kind, ["amplitude_dn"], amplitude_dn=size, frequency=(fx, fy))
        return found

    return Candidate(
        kind,
        ("spectral_peak", "row_spectrum_peak", "column_spectrum_peak", "correlation_0_1",
         "frame_variance", "alternation_variance"),
        propose,
    )  # fmt: skip


def frequencies(clues: Clues, kind: str) -> list[tuple[float, float, float]]:
    """Return candidates (fx, fy) in cycles per pixel of the mosaic, with amplitudes in DN.

    Planes of a mosaic see frequencies modulo half a cycle per pixel: each alias is one. All of it
    together sees the frequency itself.
    """
    place = min(clues.places, key=lambda p: clues.seen.levels[p].variance_dn2)
    v = clues.seen.levels[place].variance_dn2
    found = []
    for name, channel, peak in _strongest(clues, kind):
        n, m = clues.shape(channel)
        amplitude = 2 * sqrt(max(peak.power - 1, 0.05) * v / (n * m))
        if channel == "MONO":
            found.append((peak.fx, peak.fy, amplitude))
            continue
        aliases = (0.0,) if _whole(name, channel) else _HALVES
        own = (_alias(peak, ax, ay) for ax in aliases for ay in aliases)
        found += [(*at, amplitude) for at in own if not _settled(clues, kind, at, 1)]
    if len(clues.layout.channels) > 1:  # constant in each plane: stripes and checkerboards
        frame, _ = clues.amplitude("frame_variance", alike)
        stripes = ((0.5, 0.0), (0.0, 0.5), (0.5, 0.5)) if frame > 0 else ()
        found += [(*own, 2 * sqrt(frame)) for own in stripes if not _settled(clues, kind, own, 1)]
    n, m = clues.shape(place[1])
    for name, lines in (_ALTERNATING if place[1] == "MONO" else _BY_PLANE).items():
        ratio = clues.value("alternation_variance", "all", name) ** 3
        if ratio > _LEAST_POWER:
            amplitude = 2 * sqrt((ratio - 1) * v / (n * m))
            found += [(*at, amplitude) for at in lines if not _settled(clues, kind, at, 1)]
    return found


def _alias(peak: Peak, ax: float, ay: float) -> Frequency:
    """Return one of the frequencies that a plane of a mosaic sees as a peak's."""
    return (peak.fx / 2 + ax + 0.5) % 1 - 0.5, (peak.fy / 2 + ay + 0.5) % 1 - 0.5


def _settled(clues: Clues, kind: str, at: Frequency, step: int) -> bool:
    """Return whether a line needs no trial; `step`: of the plane that sees it.

    What frames do not show has no other of the frequencies that a plane takes for it.
    """
    size = clues.layout.rows // step, clues.layout.columns // step
    kinds = {kind, NO_LINE} if step == 1 else {kind}
    return any(one in kinds and same_line(known, at, *size, step) for one, known in clues.settled)


def _whole(name: str, channel: str) -> bool:
    """Return whether a spectrum is that of a whole mosaic, in phase: its lines have no aliases."""
    return name in ("spectrum", periods.PLACE) and not channel


def _strongest(clues: Clues, kind: str) -> Iterator[tuple[str, str, Peak]]:
    """Yield the strongest line of the plane, of rows and of columns that is not settled yet.

    With the names of its spectrum and of its channel.
    """

    def settled(name: str, channel: str, peak: Peak) -> bool:
        step = 1 if channel == "MONO" else 2
        at = (peak.fx / step, peak.fy / step)
        if step == 1 or _whole(name, channel):
            return _settled(clues, kind, at, 1)
        every = [_alias(peak, ax, ay) for ax in _HALVES for ay in _HALVES]
        none = all(_settled(clues, kind, one, 1) for one in every)
        return none or _settled(clues, kind, at, step)

    ranks = [line_name(rank) for rank in range(1, RANKS[-1] + 2)]
    cells = [periods.PLACE] if kind == "bistable_pattern" and _seen_in_cells(clues) else []
    for names in (["spectrum", *ranks], cells, ["rows"], ["columns"]):
        seen = ((name, clearest(clues, name)) for name in names)
        lines = ((name, *line) for name, line in seen if line is not None)
        line = next((line for line in lines if not settled(*line)), None)
        if line is not None and line[2].power >= _LEAST_POWER:
            yield line


def _seen_in_cells(clues: Clues) -> bool:
    """Return whether a pattern of few pixels stands out."""
    pooled = clues.seen.pooled.values()
    return max(own.get(periods.NUMBER, UNKNOWN)[0] for own in pooled) > _CLEAR


def clearest(clues: Clues, kind: str) -> tuple[str, Peak] | None:
    """Return the channel whose spectrum has the largest peak, and the peak; "": all channels."""
    own = [(c, peak) for (c, k), peak in clues.seen.peaks.items() if k == kind]
    own = [one for one in own if not one[0]] or own
    return max(own, key=lambda one: one[1].power, default=None)


CANDIDATES = (
    _lines("row_noise", "row_variance"),
    _lines("column_noise", "column_variance"),
    Candidate("black_level_drift", ("frame_variance", "level"), _drift),
    Candidate("flicker", ("frame_variance", "level"), _flicker),
    Candidate(
        "line_flicker", ("row_spectrum_peak", "row_variance"), _line_flicker, sane=_of_a_lamp
    ),
    Candidate("pink_noise", _SLOW, _pink),
    _patterns("periodic_noise"),
    _patterns("bistable_pattern"),
)
