"""Pixels that know of others: crosstalk, brighter-fatter, filtering, memory, lag."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.mismatch.bank.sawtooth import PLACES, Sawtooth, sawteeth
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.candidates.linestart import lines_begin_darker
from analysis.mismatch.clues import Clues, alike

_ALONG_ROWS, _ALONG_COLUMNS = "correlation_0_1", "correlation_1_0"
_DIAGONAL = "correlation_1_1"
_SEEN_STEPS = 100.0  # of chi-squared: ten standard deviations
_AS_LIKELY = 4.6  # of chi-squared, odds of 10: of few levels, periods may be alike
_TOLD = 2.0  # standard errors from which levels show an exchange
_CLEAR = 3.0  # and from which there are diagonals
_MOST = 0.1  # of a pixel's charge, that it gives a neighbour
_ASKEW = 0.5  # anisotropy from which a fit starts where greens alone tell it
_LEAST_FLATS = 2  # of one, colours may be the light's
_AS_MUCH = (0.5, 2.0)  # times what lines begin darker by, that they remember
_BESIDE = {"R": ("Gr", "Gb"), "Gr": ("R", "B"), "Gb": ("B", "R"), "B": ("Gb", "Gr")}
_NEAR = (_ALONG_ROWS, _ALONG_COLUMNS, "line_correlation", "pixel_variance")


def _crosstalk(clues: Clues) -> Sequence[Proposal]:
    across, _ = clues.amplitude(_ALONG_ROWS, clues.shot_share)
    down, _ = clues.amplitude(_ALONG_COLUMNS, clues.shot_share)
    lines = _unequal(clues)
    shares = [("both", (across + down) / 4), ("rows", across / 2), ("columns", down / 2),
              ("rows", lines), ("columns", -lines)]  # fmt: skip
    found: list[Proposal] = []
    for along, share in shares:
        if share > 0:
            found += proposals("crosstalk", ["fraction"], fraction=min(share, 0.15), along=along)
    return found


def _unequal(clues: Clues) -> float:
    """Return the share along rows by which greens would differ as they do; below 0: along columns.

    Gr has red beside it in its row and blue in its column, Gb the other way round: charge that is
    shared along one of both parts them.
    """

    def shape(place: tuple[str, str]) -> float:
        own = {c: clues.signal((place[0], c)) for c in _BESIDE}
        greens = own["Gr"] + own["Gb"]
        return 4 * (own["R"] - own["B"]) / greens if greens > 0 else 0.0

    if not set(_BESIDE) <= set(clues.layout.channels):
        return 0.0
    share, error = clues.amplitude("channel_ratio", shape)
    return share if abs(share) > _TOLD * error else 0.0


def _brighter_fatter(clues: Clues) -> Sequence[Proposal]:
    def shape(place: tuple[str, str]) -> float:
        return 2 * clues.signal(place) * clues.shot_share(place)

    across, error = clues.amplitude(_ALONG_ROWS, shape)
    down, other = clues.amplitude(_ALONG_COLUMNS, shape)
    found: list[Proposal] = []
    for rate in ((across + down) / 2, _exchanged(clues)):
        if rate > 0:
            found += proposals("brighter_fatter", ["per_dn"], per_dn=rate)
    if across + down > 0 and abs(across - down) > _TOLD * np.hypot(error, other):
        apart = float(np.clip((across - down) / (across + down), -0.95, 0.95))
        found += proposals(
            "brighter_fatter",
            ["per_dn", "anisotropy"],
            ["anisotropy"],
            per_dn=(across + down) / 2,
            anisotropy=apart,
        )
    if product := _exchanged_unequally(clues):
        rate = max(abs(product) / _ASKEW, (across + down) / 2)
        if rate * max(map(clues.signal, clues.seen.levels)) < _MOST:
            found += proposals(
                "brighter_fatter",
                ["per_dn", "anisotropy"],
                ["anisotropy"],
                per_dn=rate,
                anisotropy=product / rate,
            )
    return found


def _exchanged_unequally(clues: Clues) -> float:
    """Return rate per DN times anisotropy by which greens would differ as they do; 0: they do not.

    Next to Gr red lies along its row and blue along its column, to Gb the other way round.
    """

    def shape(place: tuple[str, str]) -> float:
        own = {c: clues.signal((place[0], c)) for c in _BESIDE}
        greens = own["Gr"] + own["Gb"]
        return 4 * (own["R"] ** 2 - own["B"] ** 2) / greens if greens > 0 else 0.0

    if not set(_BESIDE) <= set(clues.layout.channels):
        return 0.0
    product, error = clues.amplitude("channel_ratio", shape)
    return product if abs(product) > _TOLD * error else 0.0


def _exchanged(clues: Clues) -> float:
    """Return the rate per DN at which levels show that colours exchange charge; 0: they do not.

    At a rate a, a site of signal S gains a / 2 (N^2 - S^2) of each neighbour of signal N: what is
    darker gains what is brighter loses. What is in proportion to the signal is the light's colour.
    """
    levels = clues.excess("level")
    places = [p for p in levels if p[1] in _BESIDE and clues.signal(p) > 0]
    design, values = [], []
    for place in places:
        name, channel = place
        value, sd = levels[place]
        own, *others = (clues.signal((name, c)) for c in (channel, *_BESIDE[channel]))
        light = [own * (channel == c) for c in _BESIDE]
        exchange = sum(other**2 - own**2 for other in others)
        design.append(np.array([exchange, *light]) / sd)
        values.append(value / sd)
    if len({name for name, _ in places}) < _LEAST_FLATS:
        return 0.0
    shapes = np.array(design)
    rate = float(np.linalg.lstsq(shapes, np.array(values), rcond=None)[0][0])
    error = float(np.linalg.pinv(shapes.T @ shapes)[0, 0]) ** 0.5
    return rate if rate > _TOLD * error > 0 else 0.0


def _filtering(clues: Clues) -> Sequence[Proposal]:
    """Propose a kernel of four neighbours, of two where axes differ, and with the diagonals.

    A pixel that has kept 1 - n f of itself is alike with each of n neighbours by 2 f / (1 - n f),
    to first order: half of that is r, f = r / (1 + n r). Of a mosaic no number says how alike
    diagonal neighbours of one colour are: there are none.
    """
    mono = clues.layout.channels == ("MONO",)
    names = (_ALONG_ROWS, _ALONG_COLUMNS) if mono else ("correlation_0_2", "correlation_2_0")
    (across, error), (down, other) = (clues.amplitude(name, alike) for name in names)
    near = (across + down) / 4
    found: list[Proposal] = []
    if near > 0:
        own = near / (1 + 4 * near)
        found += proposals("spatial_filtering", ["fraction"], fraction=min(own, 0.15))
    if abs(across - down) > _TOLD * np.hypot(error, other):
        along, more = ("rows", across) if across > down else ("columns", down)
        share = min(more / 2 / (1 + more), 0.15)
        found += proposals("spatial_filtering", ["fraction"], fraction=share, along=along)
    askew, error = clues.amplitude(_DIAGONAL, alike) if mono else (0.0, np.inf)
    askew -= 2 * near**2  # which the nearest neighbours have in common
    if near > 0 and askew > _CLEAR * error:
        diagonal = min(askew / (2 * near), 1.0)
        found += proposals(
            "spatial_filtering",
            ["fraction", "diagonal"],
            fraction=min(near / (1 + 4 * (1 + diagonal) * near), 0.1),
            diagonal=diagonal,
        )
    return found


def _memory(clues: Clues) -> Sequence[Proposal]:
    """Propose the lags along lines that stand out most, of so many.

    Of the noise; of samples of another colour that of the signal too, which colours may tell from
    it: see `forms`.
    """
    step = 1 if clues.layout.channels == ("MONO",) else 2
    departures: dict[tuple[str, int], list[float]] = {}
    for i, key in enumerate(clues.vector.keys):
        if not clues.null.known[i]:
            continue
        if key.statistic == "line_correlation":
            axis, number = key.detail.split(" ")
            departures.setdefault((axis, round(float(number) * step)), []).append(
                float(clues.vector.values[i] - clues.null.mean[i])
            )
        elif step == 2 and key.statistic in (_ALONG_ROWS, _ALONG_COLUMNS) and key.exposure:
            axis = "rows" if key.statistic == _ALONG_ROWS else "columns"
            departures.setdefault((axis, 1), []).append(
                float(clues.vector.values[i] - clues.null.mean[i])
            )
    means = {key: float(np.mean(values)) for key, values in departures.items()}
    best = sorted(means, key=lambda key: -abs(means[key]))[:2]
    found: list[Proposal] = []
    for axis, lag in best:
        for remembers in ("noise", "signal") if step == 2 and lag % 2 else ("noise",):
            start = proposals(
                "readout_memory",
                ["fraction"],
                ["fraction"],
                fraction=float(np.clip(means[axis, lag], -0.6, 0.6)),
                lag_pixels=lag,
                along=axis,
                remembers=remembers,
            )
            # Its size, and which of so many lags it is.
            found += [replace(one, best_of=len(means), errors={"lag_pixels": 0.0}) for one in start]
        share = lines_begin_darker(clues, axis, lag)
        if share and _AS_MUCH[0] < means[axis, lag] / share < _AS_MUCH[1]:
            found += _from_black(axis, lag, share, len(means))
    return found


def _from_black(axis: str, lag: int, share: float, lags: int) -> list[Proposal]:
    """Propose the memory of the signal of lines that begin at black."""
    start = proposals(
        "readout_memory",
        ["fraction"],
        ["fraction"],
        fraction=float(np.clip(share, -0.6, 0.6)),
        lag_pixels=lag,
        along=axis,
        remembers="signal",
        before_line="black",
    )
    return [replace(one, best_of=lags, errors={"lag_pixels": 0.0}) for one in start]


def _converter(clues: Clues) -> Sequence[Proposal]:
    """Propose the residues, of either direction, that explain most of what samples carry over.

    Beyond what goes in proportion, as other memories do. Where noise covers no step there is
    nothing else: unless steps are seen for sure, those with it are proposed too.
    """
    steps = _sawteeth(clues, whole=False)
    sure = max((one.chi2 for _, one in steps), default=0.0) > _SEEN_STEPS
    return [*_residues(steps), *([] if sure else _residues(_sawteeth(clues, whole=True)))]


def _sawteeth(clues: Clues, *, whole: bool) -> list[tuple[str, Sawtooth]]:
    return [
        (axis, one)
        for axis, own in clues.seen.carried.items()
        for one in sawteeth(own, whole=whole)
    ]


def _residues(tried: Sequence[tuple[str, Sawtooth]]) -> list[Proposal]:
    best = max((one.chi2 for _, one in tried), default=0.0)
    found: list[Proposal] = []
    for axis, own in tried:
        if own.chi2 <= 0 or own.chi2 < best - _AS_LIKELY:
            continue
        start = proposals(
            "adc_memory",
            ["step_dn", "at_code"],
            ["step_dn", "at_code"],
            step_dn=own.step_dn,
            period_codes=own.period,
            at_code=own.at_code,
            along=axis,
        )
        found += [replace(one, best_of=PLACES * len(tried)) for one in start]
    return found


def _lag(clues: Clues) -> Sequence[Proposal]:
    rho, _ = clues.amplitude("frame_correlation", clues.shot_share)
    if rho <= 0:
        return []
    return proposals("image_lag", ["fraction"], fraction=min(max(rho, 1e-4), 0.45))


CANDIDATES = (
    Candidate(
        "crosstalk",
        (*_NEAR, "channel_ratio"),
        _crosstalk,
        credited=frozenset({"spatial_filtering"}),
    ),
    Candidate(
        "brighter_fatter", (*_NEAR, "level"), _brighter_fatter, hints=("channel_ratio",)
    ),
    Candidate(
        "spatial_filtering",
        ("correlation_0_1", "correlation_0_2", "correlation_1_0", "correlation_2_0",
         "line_correlation"),
        _filtering,
        credited=frozenset({"crosstalk"}),
    ),
    Candidate(
        "readout_memory",
        ("line_correlation", "correlation_0_1", "correlation_1_0", "correlation_0_2",
         "correlation_2_0"),
        _memory,
    ),
    # Levels too have the mean residue of their codes, for which there are many other reasons.
    Candidate(
        "adc_memory", ("carry_over", _ALONG_ROWS, _ALONG_COLUMNS), _converter, hints=("level",)
    ),
    Candidate("image_lag", ("frame_correlation",), _lag),
)  # fmt: skip
