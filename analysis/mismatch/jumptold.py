"""Pixels whose read noise differs and pixels that jump: which of them whole frames show."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.rank import LEAST_GAIN, SURE_GAIN, TOLD_APART, Ranked
from dsis.camera import Camera
from dsis.effects import Effect

_OTHER = {"read_noise_spread": "rts", "rts": "read_noise_spread"}
_HOT = "hot_pixels"  # what jumps seldom stays where it is in few frames
_RIVALS = {**_OTHER, _HOT: "rts", "heavy_tailed_read_noise": "rts"}
PIXELS = frozenset(_RIVALS)
_OF_MAPS = "outlying_pixels"
_WORDS = {"read_noise_spread": "pixels whose read noise differs", "rts": "pixels that jump"}


def as_pixels_show(frames: WholeFrames | None, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, the best first, where the frames of single pixels had their say.

    They are asked where the best is one of both, and numbers, which are sums over pixels, do not
    tell it from the other, or by less than frames do.
    """
    first = fitted[0] if fitted else None
    if frames is None or first is None or first.kind not in _OTHER:
        return list(fitted)
    near = [one for one in fitted if one.kind == _OTHER[first.kind]]
    odds = frames.spread_rather(SURE_GAIN) if near else 0.0
    preferred = "read_noise_spread" if odds > 0 else "rts"
    behind = 0.0 if preferred == first.kind else abs(odds) - TOLD_APART
    near = [one for one in near if one.gain > first.gain - max(TOLD_APART, behind)]
    if odds == 0 or not near:
        return list(fitted)
    top = next(one for one in (first, *near) if one.kind == preferred)
    limit = max(first.gain - abs(odds), LEAST_GAIN)
    placed = [
        replace(one, gain=min(one.gain, limit)) if one.kind == _OTHER[preferred] else one
        for one in fitted
        if one is not top
    ]
    return sorted([replace(top, gain=first.gain), *placed], key=lambda one: -one.gain)


def standing_still(frames: WholeFrames | None, best: Ranked, off: frozenset[str]) -> Denial | None:
    """Return how jumps that only maps call for are denied by frames that show none; None: not.

    `off` are statistics that differ. What stands out of a map and stays there is a defect or a hot
    pixel: one that jumps between two levels makes frames differ as well.
    """
    if best.kind != "rts" or frames is None or frames.telegraph is None:
        return None
    if off.intersection(CANDIDATES[best.kind].calls) - {_OF_MAPS} or frames.telegraph.jumping > 0:
        return None
    return Denial(0.0, "pixels stand out of maps, and nothing is seen of any that jumps")


def unlike_pixels(
    camera: Camera,
    frames: WholeFrames | None,
    best: Ranked,
    others: Sequence[Ranked],
    explained: Callable[[Effect], float],
) -> Denial | None:
    """Return how single pixels deny the best of ranked effects; None: they do not.

    They do where they are sure of another, which was not fitted or has no word: of the other of
    both, or, of hot pixels and of tails, that pixels jump. These explain some of the numbers: jumps
    as frames tell them, fitted to no number, must explain more of the same numbers, with what
    frames gain by them.
    Beside that other, which the camera has, it is no rival; but pixels do not jump either where
    frames are sure that they do not.

    Parameters
    ----------
    camera
        Without the best.
    frames
        Whole frames.
    best, others
        The effects.
    explained
        Gives what numbers gain by another effect, nats.
    """
    other = _RIVALS.get(best.kind)
    there = {own.kind for own in camera.effect} | {one.kind for one in others}
    if frames is None or other is None:
        return None
    if other in there:
        still = best.kind == "rts" and frames.no_jumps(SURE_GAIN)
        return (
            Denial(0.0, "frames of single pixels show noisy ones that do not jump")
            if still
            else None
        )
    odds = frames.spread_rather(SURE_GAIN)
    against = odds if other == "read_noise_spread" else -odds
    if against > 0 and best.kind not in _OTHER and frames.jumps is not None:
        # Single pixels of maps, which say more of hot ones, were not asked about jumps.
        of_maps = best.proposal.of_pixels is not None
        own = explained(best.polished.effects[0]) if of_maps else best.gain
        against += explained(frames.jumps) - own
    if against <= TOLD_APART:
        return None
    return rival(against, f"frames of single pixels rather show {_WORDS[other]}")
