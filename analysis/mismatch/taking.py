"""Which exposures and frames of a recording are taken, and what to expect of each."""

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.layout import Layout, Place, Taken, sites
from analysis.mismatch.scenes import SCENE
from analysis.mismatch.staging import with_scenes
from analysis.mismatch.wholecells import unseen
from dsis.cfa import Cfa
from dsis.effects import Image
from dsis.errors import InputError
from dsis.recording import Recording, Sensor

SINGLE = "of a single frame that may be looked at"
CLIPPED = "clipped at the white level"
ALIKE = "their frames are byte-identical"
STILL = "they hold code"
_LEAST_FRAMES = 2
_LEAST_LINES = 4  # rows, and columns
_CUT = 0.25  # of the largest variance at less light: what is less, a full well has cut
# Pairs of neighbours that both moved, below which sums of their products are not near normal.
_LEAST_PAIRS = 30.0


def layout_of(
    recording: Recording,
    numbers: Mapping[str, Sequence[int]],
    first: Callable[[str, Sequence[int]], Iterable[NDArray[np.generic]]],
) -> Layout:
    """Return the layout of the frames `numbers`; two frames of each exposure set the weights.

    `first(exposure, numbers)` gives frames; all of a scene are read. Scenes that move are left out,
    and exposures with fewer than two frames, with more than 0.1 % of a channel at the white level,
    or whose frames are copies.

    Raises
    ------
    InputError
        Nothing is left, or frames are so small that their lines tell nothing.
    """
    sensor = recording.sensor
    taken = []
    left_out: dict[str, str] = {}
    means: dict[Place, float] = {}
    still: set[Place] = set()
    variances: dict[Place, float] = {}
    plain: dict[Place, float] = {}
    step = 1 if sensor.cfa is Cfa.MONO else 2
    if min(recording.rows, recording.columns) < _LEAST_LINES * step:
        size, each = f"{recording.columns} x {recording.rows}", " of each colour" * (step - 1)
        fact = f"are of {size} pixels, must have at least {_LEAST_LINES} rows and columns{each}"
        raise InputError.of(recording.folder, "frames", fact)
    for recorded in recording.exposures:
        own = tuple(numbers.get(recorded.name, ()))
        if len(own) < _LEAST_FRAMES:
            left_out |= dict.fromkeys([recorded.name] if own else [], SINGLE)
            continue
        e = Taken(recorded.name, recorded.kind, recorded.exposure_time_s, recorded.light, own)
        a, b = (np.asarray(f, np.float32) for f in first(e.name, own[:2]))
        if why := _unfit(a, b, sensor):
            left_out[e.name] = why
            continue
        taken.append(e)
        for channel, (y, x) in sites(sensor.cfa).items():
            one, two = a[y::step, x::step], b[y::step, x::step]
            means[e.name, channel] = float(one.mean() + two.mean()) / 2 - sensor.black_level
            spread = np.percentile(two - one, [15.865, 84.135])
            robust = float(spread[1] - spread[0]) ** 2 / 8
            variances[e.name, channel] = max(robust, 0.05)
            plain[e.name, channel] = float((two - one).var()) / 2
            moved = float((one != two).mean()) / 2
            if e.kind != SCENE and moved**2 * one.size * len(own) < _LEAST_PAIRS:
                still.add((e.name, channel))
    if not any(e.kind != SCENE for e in taken):
        fact = "holds no dark or flat of two different frames that are not clipped"
        raise InputError.of(recording.folder, "exposure", fact)
    signal = {}
    for e in taken:
        for channel in sites(sensor.cfa):
            darks = [means[d.name, channel] for d in taken if d.kind == "dark"]
            ground = float(np.mean(darks)) if darks else 0.0
            signal[e.name, channel] = (
                0.0 if e.kind == "dark" else max(means[e.name, channel] - ground, 0.0)
            )
    layout = Layout(
        tuple(taken),
        recording.rows,
        recording.columns,
        sensor.cfa,
        sensor.black_level,
        sensor.white_level,
        signal,
        variances,
        still=frozenset(still),
        full=_full(taken, signal, plain),
        unseen=unseen(recording),
        left_out=left_out,
    )
    return with_scenes(layout, means, first)


def _unfit(a: Image, b: Image, sensor: Sensor) -> str:
    """Return why an exposure is of no use, by two of its frames; empty where it is of use."""
    step = 1 if sensor.cfa is Cfa.MONO else 2
    clipped = [
        float((a[y::step, x::step] >= sensor.white_level).mean())
        for y, x in sites(sensor.cfa).values()
    ]
    if max(clipped) > CLIPPED_SHARE:
        return CLIPPED
    if not (a == b).all():
        return ""
    return f"{STILL} {a[0, 0]:g} only" if (a == a[0, 0]).all() else ALIKE


def _full(
    taken: Iterable[Taken], signal_dn: Mapping[Place, float], variance_dn2: Mapping[Place, float]
) -> frozenset[Place]:
    """Return the brightest flats, if their noise is far less than that of flats of less light.

    Noise of light grows with light, until pixels are full; that of another read-out path, which may
    be less where it begins, grows from there on.
    """
    flats = [e.name for e in taken if e.kind == "flat"]
    found = set()
    for channel in {channel for _, channel in signal_dn}:
        places = sorted(((name, channel) for name in flats), key=lambda at: signal_dn[at])
        while len(places) > 1:
            brightest = places.pop()
            if variance_dn2[brightest] >= _CUT * max(variance_dn2[at] for at in places):
                break
            found.add(brightest)
    return frozenset(found)
