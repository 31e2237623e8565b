"""A finding with the spikes that were put aside before it."""

from dataclasses import replace

import numpy as np

from analysis.mismatch.finding import Finding, FittedParameter, Gain, Mismatch, OmittedEffect, Where
from analysis.mismatch.spikes.law import SpikeLaw, heldout_gain, law_of
from analysis.mismatch.spikes.population import STRONG, Spikes
from analysis.mismatch.split import Split
from dsis.camera import Camera
from dsis.effects.impulse import Impulse
from dsis.recording import Recording

STATISTIC = "one_off_outliers"
_KIND = "impulse"
_SHOWN = 8  # pixels
_LARGEST = 1e6  # a score that is said
_HIGHEST = 1e5  # per megapixel and frame, that the effect may have


def told_besides(words: frozenset[str], spikes: Spikes | None) -> frozenset[str]:
    """Return the effects that are looked for in what is left: spikes are found already."""
    return words if spikes is None else words - {_KIND}


def with_spikes(
    found: Finding,
    spikes: Spikes | None,
    recording: Recording,
    split: Split,
    words: frozenset[str],
) -> Finding:
    """Return a finding with spikes among what differs; the effect is named where frames prove it.

    Parameters
    ----------
    found
        What the rest of the recording says.
    spikes
        None: there are none.
    recording
        As it was recorded.
    split
        Which frames are locked; spikes of the others are proven on them.
    words
        Effects that may be named.
    """
    if spikes is None:
        return found
    mismatch = _mismatch(spikes, recording)
    everything = {e.name: range(len(e.frames)) for e in recording.exposures}
    law = law_of(spikes, recording, everything)
    others = {
        n: [k for k in own if k not in split.locked.get(n, ())] for n, own in everything.items()
    }
    gain = heldout_gain(spikes, recording, law_of(spikes, recording, others), split.locked)
    named = law is not None and _KIND in words and gain.ci95[0] > 0
    mismatch = replace(mismatch, explained_by=_KIND if named else None)
    omitted, left, camera = found.omitted_physics, found.unexplained, found.camera
    if named and law is not None:
        omitted = tuple(sorted((*omitted, _omitted(law, gain)), key=_by_gain))
        camera = _with_effect(camera, law)
    else:
        left = tuple(sorted((*left, mismatch), key=_by_size))
    counts = found.proof.discrepancies
    counts = replace(counts, before=counts.before + 1, after=counts.after + (not named))
    return replace(
        found,
        verdict="omitted_physics" if omitted else "unexplained",
        mismatches=tuple(sorted((*found.mismatches, mismatch), key=_by_size)),
        omitted_physics=omitted,
        unexplained=left,
        proof=replace(found.proof, discrepancies=counts),
        camera=camera,
        remarks=(*found.remarks, _remark(spikes)),
    )


def _by_size(mismatch: Mismatch) -> float:
    return -abs(mismatch.z)


def _by_gain(effect: OmittedEffect) -> float:
    return -effect.heldout_gain.nats_per_frame


def _omitted(law: SpikeLaw, gain: Gain) -> OmittedEffect:
    parameters = {
        "per_megapixel_frame": FittedParameter(law.share * 1e6, law.share_error * 1e6),
        "mean_dn": FittedParameter(law.mean_dn, law.mean_error_dn),
    }
    return OmittedEffect(_KIND, parameters, (STATISTIC,), gain)


def _with_effect(camera: Camera, law: SpikeLaw) -> Camera:
    rate = min(law.share * 1e6, _HIGHEST)
    effect = Impulse(per_megapixel_frame=rate, mean_dn=law.mean_dn)
    return camera.model_copy(update={"effect": (*camera.effect, effect)})


def _mismatch(spikes: Spikes, recording: Recording) -> Mismatch:
    """Return what differs; its score is the strongest spike's height in noises of its pixel."""
    hits = spikes.hits
    names = [recording.exposures[number].name for number in np.unique(hits.exposure)]
    kinds = {recording.exposures[number].kind for number in np.unique(hits.exposure)}
    strong = int((hits.ratio > STRONG).sum())
    places = ", ".join(names[:4]) + (" ..." if len(names) > 4 else "")
    says = (
        f"{hits.frame.size} samples stand far above what their pixels have in all other frames, "
        f"{strong} of them by more than {STRONG:.0f} standard deviations, the highest by "
        f"{hits.ratio[0]:.3g} ({hits.height_dn[0]:.3g} DN): no law of noise makes so few so high "
        f"({places})."
    )
    where = Where(
        exposures=tuple(names),
        kind=kinds.pop() if len(kinds) == 1 else None,
        frames=tuple(int(k) for k in np.unique(hits.frame)),
        pixels=tuple(
            (int(y), int(x)) for y, x in zip(hits.row[:_SHOWN], hits.column[:_SHOWN], strict=True)
        ),
    )
    return Mismatch(STATISTIC, min(float(hits.ratio[0]), _LARGEST), 0.0, where, says)


def _remark(spikes: Spikes) -> str:
    samples = spikes.replaced.frame.size
    return (
        f"{samples} samples that spikes hit, or that follow one, are taken as their pixels are in "
        "the other frames: all else that is said here is said without them."
    )
