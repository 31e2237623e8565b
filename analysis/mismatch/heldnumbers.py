"""What the bank's numbers gain on the locked frames: the second witness beside the pixels.

By the chain rule ln p(locked | rest) = ln p(all) - ln p(rest). Both are taken of one sum of the
numbers, weighted by what the effect changes; its law with and without the effect is simulated, on
the same draws. So a fixed pattern that locked frames share with the rest counts, as it should.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.finding import Gain
from analysis.mismatch.layout import Layout
from analysis.mismatch.model import simulate
from analysis.mismatch.observe import Observation, observe
from analysis.mismatch.recalibrate import Calibrated
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from analysis.mismatch.vector import vector
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
_SIMULATIONS = 16
_FEW = 5  # where simulations are large
_LARGE = 2.5e7  # samples
_CLEAR = 3.0  # standard errors from which a simulated change counts
_NORMAL = 1.96


@dataclass(frozen=True)
class HeldNumbers:
    """The numbers of all frames beside those of the frames that were not locked.

    Attributes
    ----------
    recording, split, source
        The frames.
    setting
        Of the diagnosis.
    kept
        Numbers of simulated recordings, by camera and frames.
    """

    recording: Recording
    split: Split
    source: Source
    setting: Setting
    kept: dict[tuple[str, int], Array] = field(default_factory=dict)

    @cached_property
    def whole(self) -> tuple[Layout, Observation]:
        """Layout and observation of all frames of the exposures that were fitted."""
        numbers = {
            e.name: tuple(sorted((*e.numbers, *self.split.locked.get(e.name, ()))))
            for e in self.setting.layout.exposures
        }
        layout = layout_of(self.recording, numbers, self.source.frames)
        return layout, observe(
            layout, lambda name: self.source.frames(name, numbers[name]), keep=True
        )

    def gain(self, final: State, without: Camera) -> tuple[Gain, float]:
        """Return the gain of the final model over a camera without an effect, and its chance size.

        The gain is per locked frame, with its interval by the parametric bootstrap: recordings of
        the final model, as simulated. Chance gains more than the second in 2.5 % of recordings
        without the effect at most, and it is not below zero.
        """
        frames = sum(len(self.split.locked.get(e.name, ())) for e in self.setting.layout.exposures)
        if not frames:
            return Gain(0.0, (-np.inf, np.inf)), np.inf
        own, made, chance = self._ratios(final, without, *self.whole)
        less, made_less, chance_less = self._ratios(
            final, without, self.setting.layout, self.setting.seen
        )
        total = own - less
        error = float(np.std(made - made_less, ddof=1)) / frames
        without_it = chance - chance_less
        clear = float(without_it.mean() + _NORMAL * without_it.std(ddof=1)) / frames
        value = total / frames
        return Gain(value, (value - _NORMAL * error, value + _NORMAL * error)), max(clear, 0.0)

    def _ratios(
        self, final: State, without: Camera, layout: Layout, seen: Observation
    ) -> tuple[float, Array, Array]:
        """Return ln p(with) - ln p(without): as recorded, of recordings with it, and without."""
        of = _numbers_of(final.calibrated, layout)
        one, other = (self._made(final, camera, layout) for camera in (final.camera, without))
        recorded = of(seen)
        weights = _weights(one, other, recorded)
        if not weights.any():
            return 0.0, np.zeros(len(one)), np.zeros(len(other))
        first, second, value = (np.nan_to_num(x) @ weights for x in (one, other, recorded))
        places = first.mean(), second.mean()
        spread = max(float(first.std(ddof=1)), float(second.std(ddof=1)))
        dof = 2 * (len(first) - 1)

        def ratio(x: Array | float) -> Array:
            law = scipy.stats.t(dof)
            wide = spread * np.sqrt(1 + 1 / len(first))
            return np.asarray(
                law.logpdf((x - places[0]) / wide) - law.logpdf((x - places[1]) / wide)
            )

        return float(ratio(float(value))), ratio(first), ratio(second)

    def _made(self, final: State, camera: Camera, layout: Layout) -> Array:
        """Return the numbers of simulated recordings of a camera: (recording, number)."""
        frames = sum(len(e.numbers) for e in layout.exposures)
        yardstick = final.camera.model_dump_json()
        key = (f"{yardstick} {camera.model_dump_json()}", frames)
        if key not in self.kept:
            count = _SIMULATIONS if frames * layout.rows * layout.columns <= _LARGE else _FEW
            model = final.calibrated.model.with_camera(camera)
            setting, of = self.setting, _numbers_of(final.calibrated, layout)
            made = simulate(model, layout, range(count), setting.seed + 3, setting.jobs)
            self.kept[key] = np.stack([of(one) for one in made])
        return self.kept[key]


def _numbers_of(calibrated: Calibrated, layout: Layout) -> Callable[[Observation], Array]:
    # One yardstick for all: the final model's base numbers.
    return lambda one: vector(layout, one, calibrated.refit(layout, one.levels)).values


def _weights(one: Array, other: Array, recorded: Array) -> Array:
    """Return the weight of each number: its change in units of its variance, where clear."""
    known = np.isfinite(one).all(0) & np.isfinite(other).all(0) & np.isfinite(recorded)
    difference = np.where(known, np.nan_to_num(one) - np.nan_to_num(other), 0.0)
    change = difference.mean(0)
    error = difference.std(0, ddof=1) / np.sqrt(len(one))
    variance = (np.where(known, one, 0.0).var(0, ddof=1) + np.where(known, other, 0.0).var(0)) / 2
    clear = known & (np.abs(change) > _CLEAR * error) & (variance > 0)
    middle = float(np.median(variance[clear])) if clear.any() else 0.0
    return np.where(clear, change / (variance + 1e-6 * middle + 1e-300), 0.0)
