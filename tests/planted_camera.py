"""Recordings made by plain numpy with a camera that is known, so that a fit can be judged."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from analysis.photon_transfer import Fit
from analysis.photon_transfer.lines import Points
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import registry
from dsis.grid import PixelGrid

Z_MAX = 5.0
LEVELS_DN = (0.0, 0.0, 60.0, 200.0, 500.0, 1100.0, 1800.0, 3000.0, 6000.0, 12000.0)


@dataclass(frozen=True)
class Sensor:
    name: str
    cfa: Cfa
    black_level: float
    white_level: float
    bit_depth: int


@dataclass(frozen=True)
class Exposure:
    name: str
    kind: str
    exposure_time_s: float
    light: float | None
    stack: np.ndarray

    @property
    def frames(self) -> np.ndarray:
        return self.stack


@dataclass(frozen=True)
class Recording:
    sensor: Sensor
    exposures: tuple[Exposure, ...]

    def frames(self, exposure: Exposure) -> Iterator[np.ndarray]:
        return iter(exposure.stack)

    def where(self, keep: object) -> "Recording":
        return replace(self, exposures=tuple(e for e in self.exposures if keep(e)))  # type: ignore[operator]


def camera(
    *segments: tuple[float | None, float, float], cfa: Cfa = Cfa.MONO, **more: object
) -> Camera:
    values = {"black_level": 256.0, "white_level": 16383.0, "bit_depth": 14} | more
    pieces = tuple(Segment(upper_dn=u, slope=m, intercept=t) for u, m, t in segments)
    return Camera(name="planted", cfa=cfa, noise=BaseNoise(segment=pieces), **values)  # type: ignore[arg-type]


def record(
    made: Camera,
    seed: int,
    *,
    levels: tuple[float, ...] = LEVELS_DN,
    frames: int = 4,
    size: tuple[int, int] = (48, 64),
    gains: tuple[tuple[float, float], tuple[float, float]] = ((0.6, 1.0), (1.0, 0.7)),
    time_per_dn: float = 1e-5,
    dark_dn_per_s: float = 0.0,
    sensor_seed: int = 99,
) -> Recording:
    """Return a recording of uniform flats; level 0 is a dark. Colours differ by `gains`."""
    grid = PixelGrid(*size, made.cfa)
    shares = np.ones(size, np.float32)
    if made.cfa is not Cfa.MONO:
        shares = np.tile(np.array(gains, np.float32), (size[0] // 2, size[1] // 2))
    exposures = []
    for number, level in enumerate(levels):
        seconds = 0.01 * (number + 1) if level == 0 else level * time_per_dn
        clean = (shares * np.float32(level) + np.float32(dark_dn_per_s * seconds)).astype(
            np.float32
        )
        draw = Draw(seed, (f"{number}",))
        codes = [
            made.expose(clean, draw, Draw(sensor_seed), t, grid, exposure_time_s=seconds)
            for t in range(frames)
        ]
        stack = (np.stack(codes) + made.black_level).astype(np.uint16)
        kind = "flat" if level else "dark"
        exposures.append(Exposure(f"{kind}-{number:02}", kind, seconds, level or None, stack))
    sensor = Sensor("planted", made.cfa, 240.0, made.white_level, made.bit_depth)
    return Recording(sensor, tuple(exposures))


ONE = camera((None, 1.7, 30.0))
TWO = camera((800.0, 1.7, 30.0), (None, 1.7, 700.0))  # a step of 16 errors at 1100 DN


def patterned(made: Camera) -> Camera:
    """Return the camera with a fixed pattern of pixels, columns and gains."""
    effects = (("dsnu", "sigma_dn", 5.0), ("prnu", "sigma_percent", 1.0),
               ("column_fpn", "sigma_dn", 3.0))  # fmt: skip
    links = tuple(registry()[kind].model_validate({key: value}) for kind, key, value in effects)
    return made.model_copy(update={"effect": links})


def misses(fit: Fit, made: Camera) -> dict[str, float]:
    """Return how far each parameter is off, in its own standard errors; nan where not found."""
    found = {"black": (fit.black_dn - made.black_level) / (fit.black_se_dn or np.nan)}
    for k, (line, true) in enumerate(zip(fit.segments.lines, made.noise.segment, strict=True)):
        found[f"slope {k}"] = (line.slope_dn - true.slope) / line.slope_se_dn
        found[f"intercept {k}"] = (line.intercept_dn2 - true.intercept) / line.intercept_se_dn2
    fitted = {effect.kind: effect for effect in fit.effects}
    for true_effect in made.effect:
        kind, found_effect = true_effect.kind, fitted.get(true_effect.kind)
        if found_effect is None:
            found[kind] = np.nan
            continue
        true_value = getattr(true_effect, found_effect.parameter)
        found[kind] = (found_effect.value - true_value) / found_effect.standard_error
    return found


def points_of(variance: np.ndarray, x: np.ndarray, relative: float) -> Points:
    size = x.size
    return Points.of(
        x_dn=x,
        variance_dn2=variance,
        relative_se=np.full(size, relative),
        x_se_dn=np.full(size, 0.01),
        channel=np.full(size, "MONO"),
        black_share=np.full(size, -1.0),
    )
