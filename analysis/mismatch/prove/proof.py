"""The proof: how much better the final model predicts the locked frames than the base model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.finding import Change, Gain
from analysis.mismatch.model import each
from analysis.mismatch.prove.classifier import Auc, auc_of
from analysis.mismatch.prove.gain import heldout_gain
from analysis.mismatch.prove.held import MOST_SEEN, Held, hold
from analysis.mismatch.prove.learning import Bases
from analysis.mismatch.prove.likelihood import (
    Loglik,
    frame_loglik,
    likelihood_model,
    mean_per_pixel,
)
from analysis.mismatch.prove.virtual import Signals, filled
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
Numbers = Mapping[str, Sequence[int]]


@dataclass(frozen=True)
class ProofNumbers:
    """What the locked frames say of two models.

    Attributes
    ----------
    loglik_before, loglik_after
        Log-likelihood of each locked frame, nats: by exposure, (frame,).
    gain
        After less before, per frame.
    loglik_per_pixel
        Means per pixel and frame, nats.
    auc
        Of the classifier that tells locked frames from simulated ones; None: too few patches.
    auc_before, auc_after
        The same with their intervals.
    left_out
        Exposures that were not used: clipped.
    window
        Rows and columns that were used; the whole sensor unless it is large.
    """

    loglik_before: Mapping[str, Array]
    loglik_after: Mapping[str, Array]
    gain: Gain
    loglik_per_pixel: Change
    auc: Change | None
    auc_before: Auc | None
    auc_after: Auc | None
    left_out: tuple[str, ...]
    window: tuple[int, int]


def prove(
    recording: Recording,
    training: Numbers,
    locked: Numbers,
    before: Camera,
    after: Camera,
    signals: Signals,
    *,
    seed: int,
    jobs: int = 1,
) -> ProofNumbers:
    """Compare two camera models on the locked frames of a recording.

    Parameters
    ----------
    recording
        The recording.
    training, locked
        Numbers of frames by exposure, from 0.
    before, after
        Base model, re-calibrated, and final model.
    signals
        Clean signal of each flat and dark, DN above black, by rows 0, 1 and columns 0, 1: (2, 2).
    seed
        Fixes every number.
    jobs
        The two models need no more than two: processes where there are, see `each`.

    The result does not depend on `jobs`. A large sensor is seen through a window at its centre, and
    gains are those of the window; the classifier's is larger, most often the whole sensor.
    """
    held = hold(recording, training, locked)
    seen = hold_seen(recording, training, locked, held)
    return prove_held(held, before, after, signals, seed=seed, jobs=jobs, seen=seen)


def hold_seen(recording: Recording, training: Numbers, locked: Numbers, held: Held) -> Held:
    """Return the frames that a classifier looks at: of a large sensor more than is `held`."""
    if held.shape == (recording.rows, recording.columns):
        return held
    return hold(recording, training, locked, MOST_SEEN)


def prove_held(
    held: Held,
    before: Camera,
    after: Camera,
    signals: Signals,
    *,
    seed: int,
    jobs: int = 1,
    seen: Held | None = None,
    known: Loglik | None = None,
) -> ProofNumbers:
    """Compare two camera models on frames that were read before; see `prove`.

    `seen` are those that the classifier looks at; None: the same. `known` is the log-likelihood
    under `after`; None: it was not asked for yet.
    """
    judged = partial(_judged, held, held if seen is None else seen, signals, seed)
    cameras = [(after, known)] if after == before else [(before, None), (after, known)]
    made = each(judged, cameras, jobs)
    (one, told), (two, told_after) = made[0], made[-1]
    change = Change(told.value, told_after.value) if told and told_after else None
    return ProofNumbers(
        one.per_frame,
        two.per_frame,
        heldout_gain(one, two, seed=seed),
        Change(mean_per_pixel(one, held), mean_per_pixel(two, held)),
        change,
        told,
        told_after,
        held.left_out,
        held.shape,
    )


def _judged(
    held: Held, seen: Held, signals: Signals, seed: int, which: tuple[Camera, Loglik | None]
) -> tuple[Loglik, Auc | None]:
    """Return what locked frames say of a camera; last its log-likelihood, if that is known."""
    camera, known = which
    told = loglik_of(held, camera, signals, seed=seed) if known is None else known
    return told, auc_of(seen, camera, signals, seed=seed)


def loglik_of(
    held: Held, camera: Camera, signals: Signals, *, seed: int, bases: Bases | None = None
) -> Loglik:
    """Return the log-likelihood of the locked frames under a camera; see `law_of`."""
    told = frame_loglik(likelihood_model(camera, held, signals, seed, bases))
    return replace(told, filled=filled(camera, held, signals))


def gain_of(held: Held, with_: Camera, without: Camera, signals: Signals, *, seed: int) -> Gain:
    """Return what one camera model gains over another on the locked frames."""
    one = loglik_of(held, without, signals, seed=seed)
    return heldout_gain(one, loglik_of(held, with_, signals, seed=seed), seed=seed)
