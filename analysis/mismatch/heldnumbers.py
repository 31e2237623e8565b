"""What the bank's numbers gain on the locked frames: the second witness beside the pixels.

Recordings with and without an effect are simulated on the same draws; what the locked frames add to
the others is judged by `given`. So a fixed pattern that locked frames share with the rest counts,
as it should.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.given import Numbers, Ratio, ratio
from analysis.mismatch.layout import Layout
from analysis.mismatch.model import simulate
from analysis.mismatch.observe import Observation, observe
from analysis.mismatch.recalibrate import Calibrated
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from analysis.mismatch.touches import touched
from analysis.mismatch.vector import Vector, vector
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
_SIMULATIONS = 16
_FEW = 5  # where simulations are large
_LARGE = 2.5e7  # samples


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

    @property
    def frames(self) -> int:
        """How many frames are locked."""
        return sum(len(self.split.locked.get(e.name, ())) for e in self.setting.layout.exposures)

    def gain(self, final: State, without: Camera) -> Ratio | None:
        """Return the gain of the final model over a camera without an effect, nats in all.

        None: the locked frames cannot tell.
        """
        if not self.frames:
            return None
        whole, rest = (
            self._numbers(final, without, *self.whole),
            self._numbers(final, without, self.setting.layout, self.setting.seen),
        )
        keys = final.vector.keys
        mine, theirs = Counter(final.camera.effect), Counter(without.effect)
        effects = list(((mine - theirs) + (theirs - mine)).keys())
        may = touched(keys, effects) if effects else np.ones(len(keys), bool)
        return ratio(whole, rest, [(key.statistic, key.scope) for key in keys], may)

    def _numbers(self, final: State, without: Camera, layout: Layout, seen: Observation) -> Numbers:
        """Return the numbers of some frames: as recorded, and simulated by both cameras."""
        own = _vector_of(final.calibrated, layout)(seen)
        one, other = (self._made(final, camera, layout) for camera in (final.camera, without))
        return Numbers(own.values, one, other, own.errors)

    def _made(self, final: State, camera: Camera, layout: Layout) -> Array:
        """Return the numbers of simulated recordings of a camera: (recording, number)."""
        frames = sum(len(e.numbers) for e in layout.exposures)
        yardstick = final.camera.model_dump_json()
        key = (f"{yardstick} {camera.model_dump_json()}", frames)
        if key not in self.kept:
            count = _SIMULATIONS if frames * layout.rows * layout.columns <= _LARGE else _FEW
            model = final.calibrated.model.with_camera(camera)
            setting, of = self.setting, _vector_of(final.calibrated, layout)
            made = simulate(model, layout, range(count), setting.seed + 3, setting.jobs)
            self.kept[key] = np.stack([of(one).values for one in made])
        return self.kept[key]


def _vector_of(calibrated: Calibrated, layout: Layout) -> Callable[[Observation], Vector]:
    # One yardstick for all: the final model's base numbers.
    return lambda one: vector(layout, one, calibrated.refit(layout, one.levels))
