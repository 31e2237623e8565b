"""The locked frames: what they say of the base model, the final model and every effect."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bandgain import foretold
from analysis.mismatch.finding import Change, Gain, Proof
from analysis.mismatch.fixedforetold import fixed_foretold
from analysis.mismatch.framebyframe import frame_by_frame
from analysis.mismatch.given import Ratio
from analysis.mismatch.heldnumbers import HeldNumbers
from analysis.mismatch.instance import frequency_of
from analysis.mismatch.lineforetold import line_foretold
from analysis.mismatch.model import Model, each, simulate
from analysis.mismatch.null import null_of
from analysis.mismatch.observe import observe
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.prove.gain import gain_of, heldout_gain, telling
from analysis.mismatch.prove.gap import gap_closed
from analysis.mismatch.prove.held import Held, hold
from analysis.mismatch.prove.learning import Bases
from analysis.mismatch.prove.likelihood import Loglik
from analysis.mismatch.prove.proof import hold_seen, loglik_of, prove_held
from analysis.mismatch.prove.virtual import Signals
from analysis.mismatch.rank import SURE_GAIN, TOLD_APART
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State, judged
from analysis.mismatch.taking import layout_of
from analysis.mismatch.touches import ALL_SUMS
from analysis.mismatch.vector import Vector
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.line_flicker import LineFlicker
from dsis.errors import InputError
from dsis.recording import Recording

Array = NDArray[np.float64]
_REPLICATES = 8
_BARE = 1.0  # nats
_TOTAL = 4.6  # nats: chance gains as much in 1 % of recordings at most, whatever the frames
_NORMAL = 1.96
_ERRORS = 2.2  # standard errors from a gain to the end of its interval, of few frames


@dataclass(frozen=True)
class Gained:
    """A gain per locked frame with its interval, whether chance is ruled out, and nats in all."""

    gain: Gain
    certain: bool
    nats: float


def exceeds(gain: Gain) -> bool:
    """Return whether a gain is more than its own standard error."""
    return gain.nats_per_frame > (gain.nats_per_frame - gain.ci95[0]) / _ERRORS


def _of_pixels(gain: Gain, frames: int) -> Gained:
    """Return the gain of the locked frames' pixels.

    Chance is ruled out where the gain exceeds its own uncertainty, and either its interval is above
    zero or the ratio of likelihoods is above 100: of a model fixed before, chance exceeds that in
    1 % of recordings at most (Markov's inequality). A nat in all is not worth more than a bare
    mention (Kass & Raftery, Journal of the American Statistical Association 90, 1995).
    """
    total = gain.nats_per_frame * frames
    sure = exceeds(gain) and total > _BARE and (gain.ci95[0] > 0 or total > _TOTAL)
    return Gained(gain, sure, total)


def denied(gain: Gain, frames: int) -> bool:
    """Return whether the pixels of the locked frames are sure that an effect makes it worse.

    Intervals tell how frames scatter. They do not know that parameters were fitted to others: of an
    effect that pixels hardly show, that costs a nat or two in all.
    """
    sure = gain.ci95[1] < 0 and gain.nats_per_frame * frames < -_TOTAL
    return sure or not np.isfinite(gain.nats_per_frame)


def _logliks_of(held: Held, signals: Signals, seed: int, cameras: Sequence[Camera]) -> list[Loglik]:
    bases = Bases(held, signals, seed)
    return [loglik_of(held, camera, signals, seed=seed, bases=bases) for camera in cameras]


def _key(camera: Camera, signals: Signals) -> tuple[str, bytes]:
    """Return what tells log-likelihoods apart."""
    light = b"".join(name.encode() + own.tobytes() for name, own in sorted(signals.items()))
    return camera.model_dump_json(), light


def _per_frame(told: Ratio, frames: int) -> Gain:
    value, error = told.nats / frames, _NORMAL * told.error / frames
    return Gain(value, (value - error, value + error))


@dataclass(frozen=True)
class Trial:
    """The proof of one recording.

    Attributes
    ----------
    recording, split
        The frames.
    held
        What the likelihood reads of them; None where no frame is locked, or all are clipped.
    numbers
        The bank's numbers of all frames: a witness where single pixels see too little.
    seed
        Of everything random.
    likely
        Log-likelihoods by camera and signals: the final camera is asked again and again.
    """

    recording: Recording
    split: Split
    held: Held | None
    numbers: HeldNumbers
    seed: int
    likely: dict[tuple[str, bytes], Loglik] = field(default_factory=dict)

    @classmethod
    def of(cls, recording: Recording, split: Split, source: Source, setting: Setting) -> "Trial":
        """Return the trial of a recording."""
        held = hold(recording, split.development, split.locked) if split.locked else None
        held = held if held is not None and held.locked else None  # darks of which half is at 0
        numbers = HeldNumbers(recording, split, source, setting)
        return cls(recording, split, held, numbers, setting.seed)

    @cached_property
    def lines(self) -> WholeFrames:
        """What all frames show of lines, the locked ones too."""
        layout = self.numbers.whole[0]
        numbers = {e.name: e.numbers for e in layout.exposures}
        source = self.numbers.source
        jobs = self.numbers.setting.jobs
        return WholeFrames(layout, lambda name: source.frames(name, numbers[name]), jobs)

    def foretold(self, effect: Effect) -> Gained | None:
        """Return what locked frames gain by what the others foretell; None: nothing.

        By bands of light, and by lines. Exposures scatter as what they gain does, were it nothing
        in the mean.
        """
        lines, locked = self.lines, self.split.locked
        whole, frequency = (lines.layout, lines.frames_of), frequency_of(effect)
        if isinstance(effect, LineFlicker):
            cycles = lines.layout.seen_cycles(effect.cycles_per_frame)
            nats = foretold(*whole, cycles, locked)
        elif frequency is not None:
            kept = effect.kind == "bistable_pattern"
            nats = line_foretold(*whole, frequency, locked, kept=kept)
        else:
            return None
        frames = sum(len(locked.get(e.name, ())) for e in lines.layout.uniform)
        if not (nats.size and frames):
            return None
        told = Ratio(float(nats.sum()), float(np.sqrt(nats @ nats)), certain=False)
        found = _of_pixels(_per_frame(told, frames), frames)
        if isinstance(effect, LineFlicker):
            return found
        # The locked frames had a say in where the line is: chance gains some nats by that.
        if told.nats <= _BARE:
            return None
        return replace(found, certain=found.certain and told.nats > _TOTAL)

    def fixed_foretold(self, bare: State, effect: Effect) -> Gained | None:
        """Return what locked frames gain by a fixed deviation of lines; None: nothing.

        `bare` is the model of all frames without it. What is fixed is drawn once, for each line:
        of the same draws locked frames are a few more, which say little by themselves. Where they
        gain by it, the odds of all frames count that take an effect into a search, once its size is
        paid for.
        """
        odds = fixed_foretold(bare, self.numbers.rest[1], effect)
        nats, frames = odds.added, self.numbers.frames
        if not (nats.size and frames):
            return None
        told = Ratio(float(nats.sum()), float(np.sqrt(nats @ nats)), certain=False)
        found = _of_pixels(_per_frame(told, frames), frames)
        shown = told.nats > _BARE and float(odds.all.sum()) - 1 >= SURE_GAIN
        return replace(found, certain=shown and float(odds.own.sum()) >= TOLD_APART)

    def frame_by_frame(self, bare: Model, effect: Effect) -> Gained | None:
        """Return what each frame gains by an effect that moves whole frames, told by the others.

        None: nothing is locked, or told. `bare` is the model without it. All frames had a
        say in what is looked for: chance is ruled out at the odds that take an effect into a
        search, by frames of which no single one decides.
        """
        if self.held is None:
            return None
        layout, frames_of = self.lines.layout, self.lines.frames_of
        told = frame_by_frame(layout, frames_of, bare, effect, self.seed)
        frames = sum(own.size for own in told.gains)
        if not frames:
            return None
        gain = gain_of(told.gains, np.zeros(0), seed=self.seed)
        nats = gain.nats_per_frame * frames
        sure = nats >= SURE_GAIN and told.least >= TOLD_APART
        return Gained(gain, gain.ci95[0] > 0 and sure, nats)

    def gains(self, final: State, without: Mapping[str, Camera]) -> dict[str, Gained]:
        """Return what the final model gains over cameras without an effect, by effect."""
        if self.held is None:
            nothing = Gain(float("nan"), (float("-inf"), float("inf")))
            return {kind: Gained(nothing, certain=False, nats=0.0) for kind in without}
        if not without:
            return {}
        cameras = [final.camera, *without.values()]
        whole, *rest = self._logliks(self.held, cameras, final.calibrated.model.signals)
        found = {}
        for (kind, camera), less in zip(without.items(), rest, strict=True):
            frames = sum(whole.frames[name].size for name in telling(less, whole))
            found[kind] = _of_pixels(heldout_gain(less, whole, seed=self.seed), frames)
            # Where the pixels are sure that it is worse, sums of numbers do not overrule them.
            if not found[kind].certain and not denied(found[kind].gain, frames):
                told = self.numbers.gain(final, camera)
                if told is not None and told.certain:
                    by_numbers = _per_frame(told, self.numbers.frames)
                    found[kind] = Gained(by_numbers, certain=True, nats=told.nats)
        return found

    def _logliks(self, held: Held, cameras: Sequence[Camera], signals: Signals) -> list[Loglik]:
        """Return the log-likelihood of the locked frames under each camera."""
        keys = [_key(camera, signals) for camera in cameras]
        missing = {k: c for k, c in zip(keys, cameras, strict=True) if k not in self.likely}
        jobs = self.numbers.setting.jobs
        # The frames are sent once to each process: they are large.
        shares = [list(missing)[i::jobs] for i in range(min(jobs, len(missing)))]
        likely = partial(_logliks_of, held, signals, self.seed)
        made = each(likely, [[missing[key] for key in share] for share in shares], jobs)
        for share, some in zip(shares, made, strict=True):
            self.likely.update(zip(share, some, strict=True))
        return [self.likely[key] for key in keys]

    def proof(self, base: State, final: State, step: Callable[[], None], source: Source) -> Proof:
        """Return base and final model side by side."""
        nothing = Change(float("nan"), float("nan"))
        counts = Change(len(base.mismatches), len(final.mismatches))
        chi2 = Change(_chi2(base), _chi2(final))
        if self.held is None:
            return Proof({}, nothing, counts, None, None, chi2)
        signals = final.calibrated.model.signals
        frames = self.split.development, self.split.locked
        seen = hold_seen(self.recording, *frames, self.held)
        models = base.camera, final.camera, signals
        jobs = self.numbers.setting.jobs
        known = self.likely.get(_key(final.camera, signals))
        numbers = prove_held(self.held, *models, seed=self.seed, jobs=jobs, seen=seen, known=known)
        step()
        gap = self._gap(base, final, source) if base.mismatches else None
        locked = dict(self.split.locked)
        return Proof(locked, numbers.loglik_per_pixel, counts, gap, numbers.auc, chi2)

    def _gap(self, base: State, final: State, source: Source) -> float | None:
        signals = final.calibrated.model.signals
        both = {name: own for name, own in self.split.locked.items() if name in signals}
        try:
            layout = layout_of(self.recording, both, source.frames)
        except InputError:
            return None  # no exposure has two locked frames
        numbers = {e.name: e.numbers for e in layout.exposures}
        setting = base.setting
        seen = observe(
            layout, lambda name: source.frames(name, numbers[name]), threads=setting.jobs
        )

        # One yardstick for all: the final model's base numbers.
        vector_of = partial(judged, layout, final.calibrated)

        def simulated(state: State) -> list[Vector]:
            model = state.calibrated.model
            which = model, layout, range(_REPLICATES), setting.seed + 2, setting.jobs
            return list(simulate(*which, vector_of, ALL_SUMS | final.calibrated.sums))

        own, before, after = vector_of(seen), simulated(base), simulated(final)
        nulls = [null_of(layout, [*after[:i], *after[i + 1 :]], one) for i, one in enumerate(after)]
        sd = np.stack([np.where(null.known, null.sd, np.nan) for null in nulls])
        return gap_closed(own.values, _values(before), _values(after), sd)


def _values(made: Sequence[Vector]) -> Array:
    return np.stack([one.values for one in made])


def _chi2(state: State) -> float:
    """Return the mean squared departure of the variances from the line."""
    own = [
        i
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "pixel_variance" and key.scope == "exposure" and state.null.known[i]
    ]
    return float((state.departures[own] ** 2).mean()) if own else float("nan")
