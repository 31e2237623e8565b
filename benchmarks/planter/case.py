"""What a recording holds: sensor, base noise, exposures, hidden effects; frozen and JSON-able."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Self

import numpy as np


@dataclass(frozen=True)
class Segment:
    """One read-out path of the base model: variance = slope x + intercept below `upper_dn`."""

    slope: float
    intercept: float
    upper_dn: float | None = None


@dataclass(frozen=True)
class Plan:
    """One exposure: `signal_dn` is the green (or mono) level above black without any effect."""

    name: str
    kind: str  # "dark", "flat", "scene"
    exposure_time_s: float
    signal_dn: float
    frames: int
    light: float | None = None


@dataclass(frozen=True)
class Effect:
    """One hidden mechanism: its name in the vocabulary and the parameters of its planting."""

    kind: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A recording to plant.

    Attributes
    ----------
    seed, sensor_seed
        Of everything that is new in each frame, and of everything that is fixed in the sensor.
    response
        Relative signal of red, green and blue pixels (a mono sensor is all green).
    segments
        The base model, as it truly is; `dual_gain` among the effects adds one that camera.toml
        does not know.
    shot
        Law of the base model's shot noise, written to camera.toml.
    effects
        At most one of a kind.
    wrong
        Numbers of camera.toml that are off, by how many standard errors: "noise.slope",
        "noise.intercept", "black_level" (first segment), "noise.switch_dn" (in gaps of levels);
        sizes of effects that camera.toml knows, "effect.prnu.sigma_percent" say, by which share.
    known
        Kinds of those effects that are in camera.toml.
    """

    seed: int
    rows: int
    columns: int
    cfa: str
    black_level: float
    white_level: int
    bit_depth: int
    segments: tuple[Segment, ...]
    exposures: tuple[Plan, ...]
    effects: tuple[Effect, ...] = ()
    wrong: Mapping[str, float] = field(default_factory=dict)
    sensor_seed: int = 0
    response: tuple[float, float, float] = (1.0, 1.0, 1.0)
    shot: str = "gaussian"
    known: tuple[str, ...] = ()

    def having(self, *effects: Effect) -> Self:
        """Return the same recording with `effects` planted besides, or in place of their kind."""
        kinds = {effect.kind for effect in effects}
        kept = tuple(e for e in self.effects if e.kind not in kinds)
        return replace(self, effects=(*kept, *effects))

    def without(self, kind: str) -> Self:
        """Return the same recording without one effect."""
        return replace(self, effects=tuple(e for e in self.effects if e.kind != kind))

    def planted(self, kind: str) -> Mapping[str, Any] | None:
        """Return the parameters of an effect, None where it is not planted."""
        return next((e.parameters for e in self.effects if e.kind == kind), None)

    @property
    def true_segments(self) -> tuple[Segment, ...]:
        """The read-out paths that light truly meets: those of camera.toml and a hidden one."""
        hidden = self.planted("dual_gain")
        if hidden is None:
            return self.segments
        if len(self.segments) > 1:
            message = "dual_gain is planted into cameras of one segment"
            raise ValueError(message)
        first = replace(self.segments[0], upper_dn=hidden["switch_dn"])
        return (first, Segment(hidden["slope"], hidden["intercept"]))

    @property
    def full_scale_dn(self) -> float:
        """Largest signal above black."""
        return self.white_level - self.black_level

    def channels(self) -> dict[str, tuple[slice, slice]]:
        """Return the planes of the mosaic by name: mono, or R Gr Gb B."""
        if self.cfa == "MONO":
            return {"mono": (slice(None), slice(None))}
        planes = {}
        for i, letter in enumerate(self.cfa):
            row, column = divmod(i, 2)
            beside_red = "R" in self.cfa[2 * row : 2 * row + 2]
            name = letter if letter != "G" else ("Gr" if beside_red else "Gb")
            planes[name] = (slice(row, None, 2), slice(column, None, 2))
        return planes

    def response_map(self) -> np.ndarray:
        """Return the relative signal of every pixel, float32 (row, column)."""
        weights = dict(zip("RGB", self.response, strict=True))
        image = np.full((self.rows, self.columns), weights["G"], np.float32)
        for name, place in self.channels().items():
            image[place] = weights.get(name[0], weights["G"])
        return image

    def to_json(self) -> str:
        """Return the case as one line of JSON, keys sorted."""
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the case that `to_json` wrote."""
        values = json.loads(text)
        values["segments"] = tuple(Segment(**s) for s in values["segments"])
        values["exposures"] = tuple(Plan(**p) for p in values["exposures"])
        values["effects"] = tuple(Effect(**e) for e in values["effects"])
        values["response"] = tuple(values["response"])
        values["known"] = tuple(values.get("known", ()))
        return cls(**values)
