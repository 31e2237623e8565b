"""Effects of one kind that come in forms: what a memory keeps, about what level pixels jump."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.mismatch.basenumbers import HOLD, WRONG, beside, chance
from analysis.mismatch.credited import joined
from analysis.mismatch.rank import TOLD_APART, Ranked, replicates_for
from analysis.mismatch.state import State
from dsis.camera import BaseNoise, Camera
from dsis.effects.readout_memory import ReadoutMemory
from dsis.effects.rts import Rts

_SMALL = 0.5  # share of noise beyond which there is no such share of the signal
_LEVELS = ("above", "either")


def in_form(state: State, users: Camera, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, each in the form that the recording shows.

    A memory is of the signal where the user's numbers say so. What is remembered of the noise alone
    adds to variances; a share of the signal that takes the place of as much of it lessens them, and
    correlates the same. Of samples of one colour nothing else tells the two apart: where numbers
    are wrong beside the first and hold beside the second, it is that. Of the nearest sample of a
    colour a filter says so, see `basenumbers.preferred`.

    Pixels that jump do so about the signal unless fixed patterns show, at odds of 20, that those
    which rest are as any other; asked where nothing explains more. Of two ways to do so that
    patterns do not tell apart it is that beside which the black level is nearer the user's.
    """
    found = [_remembered(state, users.noise, one) for one in fitted]
    return [_jumping(state, users, one) for one in found[:1]] + found[1:]


def _remembered(state: State, users: BaseNoise, ranked: Ranked) -> Ranked:
    effect, *others = ranked.polished.effects
    if not isinstance(effect, ReadoutMemory) or effect.remembers != "noise":
        return ranked
    apart = 1 if state.setting.layout.channels == ("MONO",) else 2
    mixed, filtered = effect.lag_pixels % apart, effect.lag_pixels == apart and effect.fraction > 0
    if mixed or filtered or abs(effect.fraction) >= _SMALL:
        return ranked
    if not chance(users, state.calibrated) < WRONG:
        return ranked
    share = effect.fraction / (1 + effect.fraction)  # of (1 - s, s), in proportion 1 to f
    signal = effect.model_copy(update={"fraction": share, "remembers": "signal"})
    polished = replace(ranked.polished, effects=(signal, *others))
    other = replace(ranked, polished=polished)
    wrong = beside(state, users, ranked) < WRONG
    return other if wrong and beside(state, users, other) > HOLD else ranked


def _jumping(state: State, users: Camera, ranked: Ranked) -> Ranked:
    effect, *others = ranked.polished.effects
    if not isinstance(effect, Rts) or effect.levels != "about":
        return ranked
    predictor = state.predictor(replicates_for(state.setting, [effect]))
    before = predictor.gain(ranked.mean)
    found: list[tuple[float, float, Ranked]] = []
    for levels in _LEVELS:
        effects = (effect.model_copy(update={"levels": levels}), *others)
        camera = joined(state.camera, effects, state.setting.given)
        if camera is None:
            continue
        mean = predictor.mean(camera)
        more = predictor.gain(mean) - before
        if more > TOLD_APART:
            polished = replace(
                ranked.polished, effects=effects, mean=mean, loglik=predictor.loglik(mean)
            )
            black = state.setting.calibrated(camera, state.calibrated).model.camera.black_level
            one = replace(ranked, gain=ranked.gain + more, polished=polished)
            found.append((more, abs(black - users.black_level), one))
    most = max((more for more, _, _ in found), default=0.0)
    near = [one for one in found if one[0] > most - TOLD_APART]
    return min(near, key=lambda one: one[1])[2] if near else ranked
