"""A recording beside one model of it: calibrated, simulated, judged."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.clues import Clues
from analysis.mismatch.combs import unknown_combs
from analysis.mismatch.finding import Mismatch
from analysis.mismatch.instance import Frequency
from analysis.mismatch.jumping import NAME as JUMPING
from analysis.mismatch.jumping import Jumping
from analysis.mismatch.layout import Layout
from analysis.mismatch.locate import located, tested
from analysis.mismatch.model import simulate
from analysis.mismatch.null import Null, null_of
from analysis.mismatch.observe import Observation
from analysis.mismatch.predict import Predictor, Reference
from analysis.mismatch.recalibrate import Calibrated, calibrate
from analysis.mismatch.replicates import Replicates, known, more, replicates, same_kinds
from analysis.mismatch.simulations import Simulations
from analysis.mismatch.touches import ALL_SUMS
from analysis.mismatch.untold import untold_order
from analysis.mismatch.vector import Vector, vector
from dsis.camera import Camera
from dsis.effects import Effect

Array = NDArray[np.float64]
SUREST = 64
FAR = 10.0  # standard deviations that more simulations leave far
_MEDIUM = 2e6  # samples from which one simulation tells what two of fewer do


@dataclass(frozen=True)
class Setting:
    """What stays the same throughout a diagnosis.

    Attributes
    ----------
    layout, seen
        The development frames and what was observed of them.
    interpolated
        The exposure that the re-calibration leaves out.
    seed, jobs
        Of the simulations.
    nulls, drafts, screening, replicates, polishing
        Simulations for a null, for that of a model on the way, for a first look at candidates, for
        their comparison and for the parameters of all effects together.
    large
        Whether the recording, of which this may be a part, is large: simulations take long.
    given
        How many effects the user's camera has: they come first, those taken in after them.
    surest
        Simulations for a null by which all that is left departs little, of all frames of a small
        recording; fewer than `nulls`: no more than these.
    asked_again
        Whether all frames will be asked what these leave undecided.
    jumping
        Pixels that jump, as all frames show them; None: they do not.
    noisy_rows
        By how much likelier all frames are with noise of single rows than without, whichever of
        bands and 1/f noise is beside it: nats.
    low_spikes_dn4
        By exposure, what spikes that were not put aside add to fourth moments.
    """

    layout: Layout
    seen: Observation
    interpolated: str | None
    seed: int
    jobs: int
    nulls: int
    drafts: int
    screening: int
    replicates: int
    polishing: int
    large: bool = False
    given: int = 0
    surest: int = 0
    asked_again: bool = False
    jumping: Jumping | None = None
    noisy_rows: Callable[[], float] = lambda: -inf
    low_spikes_dn4: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, layout: Layout, seen: Observation, interpolated: str | None, seed: int, jobs: int
    ) -> "Setting":
        """Return the setting of a recording: the more samples, the more one simulation tells."""
        if layout.large:
            return cls(layout, seen, interpolated, seed, jobs, 8, 4, 1, 1, 2, large=True)
        few = (1, 1, 2) if layout.samples > _MEDIUM else (2, 2, 4)
        return cls(layout, seen, interpolated, seed, jobs, 16, 8, *few)

    def alike(self, effect: Effect) -> bool:
        """Return whether one sensor tells how numbers move with the parameters of an effect.

        In a large recording, what draws nothing at random moves them alike on every sensor.
        """
        return self.large and not effect.drawn

    def calibrated(self, camera: Camera, near: Calibrated | None = None) -> Calibrated:
        """Return the model with base numbers fitted to what was observed; see `calibrate`."""
        return calibrate(
            camera,
            self.layout,
            self.seen,
            self.interpolated,
            seed=self.seed,
            jobs=self.jobs,
            near=near,
        )


@dataclass(frozen=True)
class State:
    """One model of the recording, and how far the recording is from it.

    Attributes
    ----------
    setting
        What was observed.
    calibrated
        The model.
    vector, null
        Recorded numbers, and their null.
    replicates
        Numbers of simulated recordings.
    departures, chances
        z and adjusted chances of numbers and contrasts.
    mismatches
        What is certain.
    simulations
        Of this model's cameras, kept.
    """

    setting: Setting
    calibrated: Calibrated
    vector: Vector
    null: Null
    replicates: Replicates
    departures: Array
    chances: Array
    mismatches: tuple[Mismatch, ...]
    simulations: Simulations

    @classmethod
    def of(
        cls,
        setting: Setting,
        camera: Camera,
        progress: Callable[[], None],
        *,
        draft: bool = False,
        near: "State | None" = None,
    ) -> "State":
        """Return the state of a camera after its base numbers were fitted again.

        `draft`: from fewer simulations; else from more where little departs. `near` has much the
        same camera: a start for its numbers.
        """
        nulls = setting.drafts if draft else setting.nulls
        layout, seen = setting.layout, setting.seen
        calibrated = setting.calibrated(camera, None if near is None else near.calibrated)
        tell = partial(_refitted, layout, calibrated)

        def made(which: range) -> list[tuple[BaseFit, Vector]]:
            model, sums = calibrated.model, ALL_SUMS | calibrated.sums
            found = []
            for one in simulate(model, layout, which, setting.seed, setting.jobs, tell, sums):
                found.append(one)
                progress()
            return found

        alike = (
            near is not None and near.setting.layout is layout and same_kinds(near.camera, camera)
        )
        kin = known(near.replicates, near.null) if near is not None and alike else None
        of_model = replicates(made, nulls, kin)
        own = vector(layout, seen, calibrated.residual)
        camera = calibrated.model.camera
        found = _beside(setting, camera, of_model, own)
        if not draft and setting.surest > nulls and found.nearly:
            of_model = more(made, setting.surest, of_model)
            found = _beside(setting, camera, of_model, own)
        simulations = Simulations(
            layout,
            calibrated.model,
            partial(numbers, layout, calibrated),
            setting.seed,
            setting.jobs,
            calibrated.sums,
        )
        its_own = [one.values for one in of_model.vectors[: of_model.own]]
        simulations.keep(camera, its_own)
        return cls(
            setting,
            calibrated,
            own,
            found.null,
            of_model,
            found.departures,
            found.chances,
            found.mismatches,
            simulations,
        )

    @property
    def simulated(self) -> Array:
        """Numbers of each simulated recording: (simulation, number)."""
        return np.stack([one.values for one in self.replicates.vectors])

    @property
    def camera(self) -> Camera:
        """The camera, re-calibrated."""
        return self.calibrated.model.camera

    @property
    def fit(self) -> BaseFit:
        """The base numbers."""
        return self.calibrated.fit

    def clues(self, settled: tuple[tuple[str, Frequency], ...] = ()) -> Clues:
        """Return what proposals start from; `settled` are lines that need no trial."""
        s = self.setting
        own = Clues(s.layout, s.seen, self.vector, self.fit, self.null, self.camera, settled)
        return own if s.jumping is None else replace(own, jumps=s.jumping.effect)

    def predictor(self, replicates: int | None = None) -> Predictor:
        """Return predictions of other cameras beside this one."""
        reference = Reference(self.camera, self.null, self.vector)
        count = replicates or self.setting.replicates
        return Predictor(self.simulations, reference, replicates=count)


@dataclass(frozen=True)
class _Judged:
    """What a recording is beside simulated ones; see `State`."""

    null: Null
    departures: Array
    chances: Array
    mismatches: tuple[Mismatch, ...]

    @property
    def nearly(self) -> bool:
        """Whether all that departs does so little that a better known scatter may deny it.

        Of what hangs on simulations: pixels that jump are seen in the frames themselves.
        """
        return nearly([m.z for m in self.mismatches if m.statistic != JUMPING])


def nearly(departures: Sequence[float]) -> bool:
    """Return whether there are departures, and none is so far that more simulations leave it."""
    return bool(departures) and all(abs(z) < FAR for z in departures)


def _beside(setting: Setting, camera: Camera, made: Replicates, own: Vector) -> _Judged:
    """Return what the recorded numbers are beside simulated ones of a camera."""
    layout = setting.layout
    null = null_of(layout, made.vectors, own, made.unsure)
    untold = unknown_combs(camera, layout, own.keys) | untold_order(camera, own.keys)
    null = replace(null, known=null.known & ~untold)
    z, chances = tested(layout, null, own)
    found = located(layout, setting.seen, null, z, chances)
    if setting.jumping is not None:
        found = setting.jumping.beside(found, camera.effect)
    return _Judged(null, z, chances, found)


def numbers(layout: Layout, calibrated: Calibrated, seen: Observation) -> Array:
    """Return the numbers of a simulated recording, its base numbers fitted as the recording's."""
    return judged(layout, calibrated, seen).values


def judged(layout: Layout, calibrated: Calibrated, seen: Observation) -> Vector:
    """Return the numbers of an observation, its base numbers fitted as the recording's."""
    return _refitted(layout, calibrated, seen)[1]


def _refitted(layout: Layout, calibrated: Calibrated, seen: Observation) -> tuple[BaseFit, Vector]:
    fit = calibrated.refit(layout, seen.levels)
    return fit, vector(layout, seen, fit)
