"""Effects of one kind that come in forms: what a memory keeps, about what level pixels jump."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from analysis.mismatch.basenumbers import HOLD, WRONG, beside, chance, far_off
from analysis.mismatch.credited import joined
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.rank import TOLD_APART, Ranked
from analysis.mismatch.state import State
from dsis.camera import BaseNoise, Camera
from dsis.effects import Effect
from dsis.effects.readout_memory import ReadoutMemory
from dsis.effects.rts import Rts

_MOST = 0.5  # of the signal; of the noise, less: beyond it there is no other form
_NEARLY = 0.25  # of what a number is off by: sizes of effects have errors, too
OTHER_LEVELS = ("above", "either")


def in_form(
    state: State, users: Camera, fitted: Sequence[Ranked], jumps: Callable[[Rts], Rts] = lambda e: e
) -> list[Ranked]:
    """Return ranked effects, each in the form that the recording shows.

    What a memory keeps of the noise alone adds to variances; a share of the signal that takes the
    place of as much of it lessens them, and correlates the same; samples of another colour mix. It
    is of the one that the numbers of the recording tell at odds of 20, or else of the signal where
    the user's numbers are wrong beside the first and hold beside the second. Of the nearest sample
    of a colour a filter says so, see `basenumbers.preferred`.

    Pixels that jump do so about the signal unless fixed patterns show, at odds of 20, that those
    which rest are as any other. Of two ways to do so that patterns do not tell apart it is that
    beside which the black level is nearer the user's. `jumps` gives them the sizes that frames
    show: by others that are as likely by sums they would be of another form. One that is not the
    best keeps its gain.
    """
    found = [_jumping(state, users, _remembered(state, users.noise, one), jumps) for one in fitted]
    behind = zip(found[1:], fitted[1:], strict=True)
    return found[:1] + [own if one is own else replace(one, gain=own.gain) for one, own in behind]


def _remembered(state: State, users: BaseNoise, ranked: Ranked) -> Ranked:
    effect, *others = ranked.polished.effects
    if not isinstance(effect, ReadoutMemory) or effect.before_line == "black":
        return ranked
    apart = _apart(state)
    mixed, filtered = effect.lag_pixels % apart, effect.lag_pixels == apart and effect.fraction > 0
    other = _other(effect)
    if other is None or filtered or (effect.exchanges and not mixed):
        return ranked
    effects = (other, *others)
    twin = replace(ranked, polished=replace(ranked.polished, effects=effects))
    if mixed:
        predictor = state.predictor(replicates_for(state.setting, [effect]))
        means = [predictor.mean(_camera(state, own)) for own in (ranked, twin)]
        ahead = predictor.gain(means[1]) - predictor.gain(means[0])
        polished = replace(twin.polished, mean=means[1], loglik=predictor.loglik(means[1]))
        twin = replace(twin, polished=polished, gain=ranked.gain + max(ahead, 0.0))
        if abs(ahead) > TOLD_APART:
            return twin if ahead > 0 else ranked
    noise, signal = (twin, ranked) if effect.exchanges else (ranked, twin)
    if not chance(users, state.calibrated) < WRONG:
        return noise
    wrong = beside(state, users, noise) < WRONG
    return signal if wrong and beside(state, users, signal) > HOLD else noise


def other_form(state: State, users: BaseNoise, effect: Effect) -> tuple[Effect, Camera] | None:
    """Return a memory in its other form, and the camera with it; None: it has the one it should.

    What is named since may have been what made the user's numbers wrong: of the form beside which
    they are wrong, and beside the other hold, or are nearly right, it is not.
    """
    if not isinstance(effect, ReadoutMemory) or effect.before_line == "black":
        return None
    apart = _apart(state)
    other = _other(effect)
    if other is None or effect.lag_pixels % apart or effect.lag_pixels == apart:
        return None  # told otherwise, see `in_form`
    if not chance(users, state.calibrated) < WRONG:
        return None
    first = state.setting.given  # the user's come first
    effects = tuple(
        other if i >= first and own == effect else own for i, own in enumerate(state.camera.effect)
    )
    camera = state.camera.model_copy(update={"effect": effects})
    calibrated = state.setting.calibrated(camera, state.calibrated)
    nearer = far_off(users, calibrated) < _NEARLY * far_off(users, state.calibrated)
    return (other, camera) if nearer or chance(users, calibrated) > HOLD else None


def _apart(state: State) -> int:
    """Return how far apart samples of one colour are, pixels."""
    return 1 if state.setting.layout.channels == ("MONO",) else 2


def _other(effect: ReadoutMemory) -> ReadoutMemory | None:
    """Return the memory of the other form that correlates the same; None: there is none.

    Kernels (1 - s, s) and (1, f) are in proportion where s = f / (1 + f).
    """
    share = effect.fraction
    if effect.exchanges:
        return _with(effect, share / (1 - share), "noise") if share < _MOST else None
    return _with(effect, share / (1 + share), "signal") if share > -_MOST else None


def _with(effect: ReadoutMemory, fraction: float, remembers: str) -> ReadoutMemory:
    return effect.model_copy(update={"fraction": fraction, "remembers": remembers})


def _camera(state: State, ranked: Ranked) -> Camera:
    camera = joined(state.camera, ranked.polished.effects, state.setting.given)
    return state.camera if camera is None else camera


def _jumping(state: State, users: Camera, ranked: Ranked, jumps: Callable[[Rts], Rts]) -> Ranked:
    effect, *others = ranked.polished.effects
    if not isinstance(effect, Rts) or effect.levels != "about":
        return ranked
    predictor = state.predictor(replicates_for(state.setting, [effect]))
    effect = jumps(effect)
    as_shown = replace(ranked, polished=replace(ranked.polished, effects=(effect, *others)))
    before = predictor.gain(predictor.mean(_camera(state, as_shown)))
    found: list[tuple[float, Ranked]] = []
    for levels in OTHER_LEVELS:
        effects = (effect.model_copy(update={"levels": levels}), *others)
        one = replace(ranked, polished=replace(ranked.polished, effects=effects))
        mean = predictor.mean(_camera(state, one))
        more = predictor.gain(mean) - before
        polished = replace(one.polished, mean=mean, loglik=predictor.loglik(mean))
        found.append((more, replace(one, gain=ranked.gain + more, polished=polished)))
    most = max(more for more, _ in found)
    if most <= TOLD_APART:
        return ranked
    near = [one for more, one in found if more > most - TOLD_APART]
    return near[0] if len(near) == 1 else min(near, key=lambda one: _off_black(state, users, one))


def _off_black(state: State, users: Camera, ranked: Ranked) -> float:
    """Return how far the black level beside an effect is from the user's, DN."""
    calibrated = state.setting.calibrated(_camera(state, ranked), state.calibrated)
    return abs(calibrated.model.camera.black_level - users.black_level)
