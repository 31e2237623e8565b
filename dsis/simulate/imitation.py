"""The clean signals that make a camera model reproduce the levels of a recording."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dsis.camera import Camera
from dsis.draw import Draw
from dsis.effects import Image
from dsis.grid import PixelGrid
from dsis.recording import RecordedExposure, Recording
from dsis.simulate.levels import (
    CLIPPED_SHARE,
    Levels,
    Sites,
    black_dn,
    levels_of,
    mean_frame,
    site_means,
)
from dsis.simulate.maps import SensorMaps
from dsis.simulate.shot import Shot, dark, tiled

_STEPS_MAX = 8
_STEP_DN, _STEP_SHARE = 0.02, 1e-5  # far below the standard error of any recorded level


@dataclass(frozen=True)
class Imitation:
    """Finds the clean signal of each exposure of a recording.

    A flat is uniform: each colour filter site has the mean that the recording has above black.
    What the camera's own effects do to a mean (dark current, shading, non-linearity ...: all that
    state the measure `level`) is taken off: the signal is sought that, seen through these effects,
    has the recorded mean. Where a flat is clipped or fills the pixels (`saturation_dn`), its signal
    follows from the brightest flat that does not, in proportion to light (to exposure time where no
    light is stated).
    """

    camera: Camera
    recording: Recording
    sensor: Draw
    maps: SensorMaps | None = None
    threads: int = 1

    def shots(self) -> tuple[Shot, ...]:
        """Return every exposure with its clean signal; scenes are read when their turn comes."""
        return tuple(self._shot(exposure) for exposure in self.recording.exposures)

    def _shot(self, exposure: RecordedExposure) -> Shot:
        plan = exposure.plan
        if plan.kind == "dark":
            return dark(plan.name, frames=plan.frames, exposure_time_s=plan.exposure_time_s)
        if plan.kind == "scene":
            return Shot(plan, lambda _: self._scene(exposure))
        signal = self._flats[plan.name]
        return Shot(plan, lambda grid: tiled(signal, grid))

    @cached_property
    def _levels(self) -> Levels:
        return levels_of(self.recording, self.threads)

    @cached_property
    def _flats(self) -> dict[str, Sites]:
        """The clean signal of each flat, DN above black."""
        flats = self.recording.of_kind("flat")
        clipped = {
            e.name: (self._levels.clipped[e.name] > CLIPPED_SHARE) | self._full(e) for e in flats
        }
        found = {e.name: self._solved(e, clipped[e.name]) for e in flats}
        for e in flats:
            for row, column in np.argwhere(clipped[e.name]):
                place = (int(row), int(column))
                sound = [f for f in flats if not clipped[f.name][place]]
                expected = _in_proportion(e, place, sound, found)
                found[e.name][place] = max(found[e.name][place], expected)
        return found

    def _above_black(self, exposure: RecordedExposure) -> Sites:
        black = black_dn(self.recording, self._levels, exposure.exposure_time_s)
        return np.maximum(self._levels.mean_dn[exposure.name] - black, 0.0)

    def _full(self, exposure: RecordedExposure) -> NDArray[np.bool_]:
        """Tell where the light would give more charge than a pixel holds."""
        saturation, time = self.camera.saturation_dn, exposure.exposure_time_s
        if saturation is None:
            return np.zeros((2, 2), bool)
        # Light that just fills a pixel has half its shot noise cut: a mean of s / sqrt(2 pi) less.
        cut = np.sqrt(_shot_variance_dn2(self.camera, saturation) / (2 * np.pi))
        mean = np.full((2, 2), saturation - cut)
        if self._reshaping.effect:
            offset = self._own_dark(time) if self.recording.of_kind("dark") else np.zeros((2, 2))
            mean = self._seen(np.full((2, 2), saturation), time) - offset - cut
        return np.asarray(self._above_black(exposure) >= mean)

    def _solved(self, exposure: RecordedExposure, clipped: NDArray[np.bool_]) -> Sites:
        """Return the signal whose mean, seen through the camera, is the recorded one.

        A clipped site keeps its mean: no signal could be told from it.
        """
        wanted = self._above_black(exposure)
        if not self._reshaping.effect:
            return wanted
        time = exposure.exposure_time_s
        offset = self._own_dark(time) if self.recording.of_kind("dark") else np.zeros((2, 2))
        signal = wanted.copy()
        for _ in range(_STEPS_MAX):
            step = np.where(clipped, 0.0, wanted - (self._seen(signal, time) - offset))
            signal = np.maximum(signal + step, 0.0)
            if (np.abs(step) <= _STEP_DN + _STEP_SHARE * wanted).all():
                break
        return signal

    def _scene(self, exposure: RecordedExposure) -> Image:
        """Return the mean frame above black; the error of that mean stays in it."""
        time = exposure.exposure_time_s
        black = black_dn(self.recording, self._levels, time)
        if not self.recording.of_kind("dark"):
            black = black + self._own_dark(time)
        signal = mean_frame(self.recording, exposure) - tiled(black, self.recording.grid)
        if self.maps is not None:
            signal = (signal - self.maps.dsnu_dn) / self.maps.prnu_gain
        return signal.astype(np.float32)

    @cached_property
    def _reshaping(self) -> Camera:
        """The camera with the effects that change a mean; noise of 1 DN dithers the codes."""
        effects = tuple(e for e in self.camera.effect if "level" in e.changes)
        segments = tuple(
            s.model_copy(update={"slope": 0.0, "intercept": 1.0}) for s in self.camera.noise.segment
        )
        noise = self.camera.noise.model_copy(update={"shot": "gaussian", "segment": segments})
        return self.camera.model_copy(update={"effect": effects, "noise": noise})

    def _own_dark(self, exposure_time_s: float) -> Sites:
        """Return what the camera's effects add without light, DN above its black level."""
        if not self._reshaping.effect:
            return np.zeros((2, 2))
        return self._seen(np.zeros((2, 2)), exposure_time_s)

    def _seen(self, signal: Sites, exposure_time_s: float) -> Sites:
        grid = PixelGrid(self.recording.rows, self.recording.columns, self.camera.cfa)
        image = self._reshaping.expose(
            tiled(signal, grid),
            self.sensor.within("level"),
            self.sensor,
            0,
            grid,
            exposure_time_s=exposure_time_s,
            threads=self.threads,
        )
        means = site_means(image)
        return np.full((2, 2), means.mean()) if self.camera.cfa == "MONO" else means


def _shot_variance_dn2(camera: Camera, signal_dn: float) -> float:
    """Return the variance of the base model's shot noise, DN^2."""
    segments = camera.segments
    i = segments.index(np.array([signal_dn], np.float32))[0]
    return float(max(segments.slope_dn[i] * signal_dn + min(segments.intercept_dn2[i], 0), 0))


def _in_proportion(
    exposure: RecordedExposure,
    site: tuple[int, int],
    sound: list[RecordedExposure],
    signals: dict[str, Sites],
) -> float:
    """Return what a clipped flat would have had, from the brightest of the sound ones; or 0."""
    lit = exposure.light is not None
    alike = [e for e in sound if (e.light is not None) == lit]
    if not alike:
        return 0.0
    model = max(alike, key=lambda e: signals[e.name][site])
    if exposure.light is not None and model.light is not None:
        ratio = exposure.light / model.light
    else:
        ratio = exposure.exposure_time_s / model.exposure_time_s
    return float(signals[model.name][site] * ratio)
