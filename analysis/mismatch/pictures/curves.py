"""Each statistic of single exposures against signal, light, exposure time or lag."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.evidence import Against, Curve
from analysis.mismatch.layout import Place, Taken
from analysis.mismatch.pictures.natural import UNITS, Scale, back, shared
from analysis.mismatch.state import State

Array = NDArray[np.float64]
DARK_LEVEL = "dark_level"  # the level of darks, against their exposure time
_LAGS = "line_correlation"
_TOGETHER = "of all channels"


@dataclass(frozen=True)
class Point:
    """A number beside a model: recorded, expected, its spread, and z of the departure."""

    observed: float
    expected: float
    sd: float
    z: float


def curves(base: State, final: State | None) -> dict[str, tuple[Curve, ...]]:
    """Return a curve for each statistic and channel; `final` is None where nothing was named."""
    before = points(base)
    after = None if final is None else points(final)
    groups: dict[str, dict[str, list[Key]]] = {}
    for key in before:
        name = _name(base, key)
        if np.isfinite(_place(base, name, key)):
            groups.setdefault(name, {}).setdefault(key.channel, []).append(key)
    return {
        name: tuple(
            _curve(base, (name, channel), keys, before, after) for channel, keys in channels.items()
        )
        for name, channels in groups.items()
    }


def points(state: State) -> dict[Key, Point]:
    """Return the numbers of single exposures, and of lags along lines, in their units."""
    null, values = state.null, state.vector.values
    own = {
        key: i
        for i, key in enumerate(state.vector.keys)
        if null.known[i] and (key.exposure or key.statistic == _LAGS)
    }
    places: dict[Place, tuple[dict[str, float], dict[str, float]]] = {}
    for key, i in own.items():
        seen, mean = places.setdefault((key.exposure, key.channel), ({}, {}))
        seen[key.statistic], mean[key.statistic] = float(values[i]), float(null.mean[i])
    found = {}
    for key, i in own.items():
        place = (key.exposure, key.channel)
        x, mean_x, sd = float(values[i]), float(null.mean[i]), float(null.sd[i])
        if state.setting.seen.level(place) is not None:
            scale = Scale.of(state, key.place)
            recorded, expected = (back(key.statistic, scale, n) for n in places[place])
        else:
            recorded = expected = shared(key.statistic)
        spread = (expected(mean_x + sd) - expected(mean_x - sd)) / 2
        found[key] = Point(recorded(x), expected(mean_x), spread, (x - mean_x) / sd)
    return found


def _name(state: State, key: Key) -> str:
    """Return under which name a number is drawn."""
    if key.statistic == _LAGS:
        return f"{_LAGS} along {key.detail.split()[0]}"
    if key.channel not in ("G", *state.setting.layout.channels):
        return f"{key.statistic} {_TOGETHER}" + (f" in {key.detail}" if key.detail else "")
    if key.statistic == "level" and _exposure(state, key).kind == "dark":
        return DARK_LEVEL
    return key.statistic


def _curve(
    base: State,
    of: tuple[str, str],
    keys: Sequence[Key],
    before: Mapping[Key, Point],
    after: Mapping[Key, Point] | None,
) -> Curve:
    name, channel = of
    seen = [before[key] for key in keys]
    observed = np.array([p.observed for p in seen])
    expected = np.array([p.expected for p in seen])
    later = z_after = sd_after = None
    if after is not None:
        left = [after.get(key) for key in keys]
        rest = np.array([np.nan if p is None else p.observed - p.expected for p in left])
        # What is recorded depends on the fit that it stands beside: the same departure is drawn.
        later = observed - rest
        z_after = np.array([np.nan if p is None else p.z for p in left])
        sd_after = np.array([np.nan if p is None else p.sd for p in left])
    return Curve(
        channel,
        _against(name),
        np.array([_place(base, name, key) for key in keys]),
        observed,
        expected,
        later,
        np.array([p.sd for p in seen]),
        "" if _TOGETHER in name else UNITS.get(keys[0].statistic, ""),
        np.array([p.z for p in seen]),
        z_after,
        sd_after,
    )


def _against(name: str) -> Against:
    if name.startswith(_LAGS):
        return "lag_pixels"
    known: dict[str, Against] = {"level": "light", DARK_LEVEL: "exposure_time_s"}
    return known.get(name, "signal_dn")


def _place(state: State, name: str, key: Key) -> float:
    """Return where along x a number stands; nan where it is unknown."""
    if name.startswith(_LAGS):
        return float(key.detail.split()[1]) * (1 if key.channel == "MONO" else 2)
    if name == DARK_LEVEL:
        return _exposure(state, key).exposure_time_s
    if name == "level":
        light = _exposure(state, key).light
        return np.nan if light is None else light
    signals = {**state.setting.layout.signal_dn, **state.fit.signal_dn}
    place = key.place
    channels = state.setting.layout.channels
    usual = "Gr" if "Gr" in channels else channels[0]
    return signals[place if place in signals else (key.exposure, usual)]


def _exposure(state: State, key: Key) -> Taken:
    return next(e for e in state.setting.layout.exposures if e.name == key.exposure)
