"""The locked frames: what they say of the base model, the final model and every effect."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.finding import Change, Gain, Proof
from analysis.mismatch.model import simulate
from analysis.mismatch.observe import Observation, observe
from analysis.mismatch.prove.gap import gap_closed
from analysis.mismatch.prove.held import Held, hold
from analysis.mismatch.prove.proof import gain_of, prove_held
from analysis.mismatch.recalibrate import Calibrated, layout_of
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import State
from analysis.mismatch.vector import vector
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
_REPLICATES = 6


@dataclass(frozen=True)
class Trial:
    """The proof of one recording.

    Attributes
    ----------
    recording, split
        The frames.
    held
        What the likelihood reads of them; None where no frame is locked.
    seed
        Of everything random.
    """

    recording: Recording
    split: Split
    held: Held | None
    seed: int

    @classmethod
    def of(cls, recording: Recording, split: Split, base: State, seed: int) -> "Trial":
        """Return the trial of a recording."""
        del base
        held = hold(recording, split.development, split.locked) if split.locked else None
        return cls(recording, split, held, seed)

    def gain(self, final: State, without: Camera) -> Gain:
        """Return what the final model gains over one without an effect, per locked frame."""
        if self.held is None:
            return Gain(float("nan"), (float("-inf"), float("inf")))
        signals = final.calibrated.model.signals
        return gain_of(self.held, final.camera, without, signals, seed=self.seed)

    def proof(self, base: State, final: State, step: Callable[[], None], source: Source) -> Proof:
        """Return base and final model side by side."""
        nothing = Change(float("nan"), float("nan"))
        counts = Change(len(base.mismatches), len(final.mismatches))
        chi2 = Change(_chi2(base), _chi2(final))
        if self.held is None:
            return Proof({}, nothing, counts, None, None, chi2)
        signals = final.calibrated.model.signals
        numbers = prove_held(self.held, base.camera, final.camera, signals, seed=self.seed)
        step()
        gap = self._gap(base, final, source) if base.mismatches else None
        locked = dict(self.split.locked)
        return Proof(locked, numbers.loglik_per_pixel, counts, gap, numbers.auc, chi2)

    def _gap(self, base: State, final: State, source: Source) -> float | None:
        layout = layout_of(self.recording, self.split.locked, source.frames)
        if not any(e.kind != "scene" for e in layout.exposures):
            return None
        numbers = {e.name: e.numbers for e in layout.exposures}
        seen = observe(layout, lambda name: source.frames(name, numbers[name]))
        setting = base.setting

        def values(calibrated: Calibrated, one: Observation) -> Array:
            # One yardstick for all: the final model's base numbers.
            return vector(layout, one, calibrated.refit(layout, one.levels)).values

        def simulated(state: State) -> Array:
            model = state.calibrated.model
            made = simulate(model, layout, range(_REPLICATES), setting.seed + 2, setting.jobs)
            return np.stack([values(final.calibrated, one) for one in made])

        return gap_closed(values(final.calibrated, seen), simulated(base), simulated(final))


def _chi2(state: State) -> float:
    """Return the mean squared departure of the variances from the line."""
    own = [
        i
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "pixel_variance" and key.scope == "exposure" and state.null.known[i]
    ]
    return float((state.departures[own] ** 2).mean()) if own else float("nan")
