"""Effects that cannot be told from the best one."""

from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from math import log

from analysis.mismatch.advantage import odds
from analysis.mismatch.basenumbers import preferred
from analysis.mismatch.instance import frequency_of, same_line
from analysis.mismatch.memory import Memory
from analysis.mismatch.rank import SURE_GAIN, TOLD_APART, Ranked, alike, ranked
from analysis.mismatch.segments import Path
from analysis.mismatch.smooth import smooth_as_well
from analysis.mismatch.state import State
from dsis.camera import BaseNoise
from dsis.effects import Effect
from dsis.effects.readout_memory import ReadoutMemory

# That greens differ is seen; what amplifiers of even and odd rows make of red and blue is not, nor
# what charge that leaks makes of neighbours. Memory of a sample is that of a residue whose steps
# lie beyond the noise.
_SAYS_LESS = {
    "channel_imbalance": ("tap_mismatch", "crosstalk"),
    "readout_memory": ("adc_memory",),
}
_BY_CODES = "quantisation"
_FAR_AHEAD = 25.0  # nats, that no numbers have by chance
_KEEPS_VARIANCE = ("spatial_filtering", {"spatial_filtering", "readout_memory"})
_OF_LAGS = "readout_memory"
_OF_LEVELS = frozenset({"dual_gain_mismatch", "nonlinearity"})
_SOME = 0.2  # cosine of what two effects change, above which one may hide in the other
_TWINS = {
    "dual_gain_mismatch": ("nonlinearity",),
    "nonlinearity": ("dual_gain_mismatch",),
    "tap_mismatch": ("channel_imbalance",),
    "readout_memory": ("crosstalk", "spatial_filtering"),
    "spatial_filtering": ("readout_memory",),
    "crosstalk": ("spatial_filtering",),
    "adc_memory": ("readout_memory", "spatial_filtering"),
    "heavy_tailed_read_noise": ("read_noise_spread",),
    "read_noise_spread": ("heavy_tailed_read_noise",),
    "rts": ("read_noise_spread", "heavy_tailed_read_noise"),
}


def plainest(state: State, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, before the best what says less and explains the same as well.

    In a mosaic whose light is of unknown colour amplifiers of even and odd rows show in nothing
    but the greens: that the greens differ holds whatever the cause; it is its alternative.
    """
    said = next((o for o in fitted[1:] if fitted[0].kind in _SAYS_LESS.get(o.kind, ())), None)
    if said is None or not (ties(state, fitted[0], said) or _of_greens(state, fitted[0], said)):
        return list(fitted)
    first = replace(said, gain=fitted[0].gain)
    return [first, *(one for one in fitted if one is not said)]


def _of_greens(state: State, best: Ranked, said: Ranked) -> bool:
    """Return whether charge that leaks explains the same as greens that differ, and little more.

    Neighbours that are alike would say so: without them the light's colours fit by chance.
    """
    near = said.gain > best.gain - SURE_GAIN
    return near and best.kind == "crosstalk" and alike(state, best.mean, said.mean)


def ties(state: State, best: Ranked, other: Ranked) -> bool:
    """Return whether another effect explains the same numbers nearly as well as the best.

    What is seen in them, and no more, ties with nothing that says the same and more; nor do steps
    of codes, which are told by those that never occur. Which of many lags it is costs nothing
    beside a twin that the same lag would be.
    """
    if best.kind == _BY_CODES or other.kind == best.told_from:
        return False
    gains = best.gain, other.gain
    if other.kind in _TWINS.get(best.kind, ()):
        gains = _unpriced(best), _unpriced(other)
    near = gains[1] > gains[0] - TOLD_APART and other.kind != best.kind
    near |= smooth_as_well(state, best.mean, best.kind, other.kind)
    if other.kind in _SAYS_LESS.get(best.kind, ()) or _other_line(state, best, other):
        return False
    if not alike(state, best.polished.mean, other.polished.mean):
        return False
    return near or _by_chance(state, best, other, gains[0] - gains[1])


def _by_chance(state: State, best: Ranked, other: Ranked, ahead: float) -> bool:
    """Return whether the best is ahead by what chance has in common of many numbers.

    What frames or single pixels say besides is not in numbers. Of a large recording few are
    simulated, and nothing is said.
    """
    if state.setting.large or other.kind == best.kind or ahead > _FAR_AHEAD:
        return False
    by_numbers, likelier = odds(state, best, other)
    return ahead - by_numbers < TOLD_APART and likelier < TOLD_APART


def bends_as_well(state: State, best: Ranked, path: Path | None) -> Path | None:
    """Return the second read-out path if neither it nor the best is told from the other."""
    if path is None or abs(path.gain - best.gain) >= TOLD_APART:
        return None
    return path if alike(state, best.mean, path.mean) else None


def twin(
    state: State, best: Ranked, vocabulary: Container[str], memory: Memory, step: Callable[[], None]
) -> Ranked | None:
    """Return the effect that the best cannot be told from, though it must not be named itself.

    Amplifiers of even and odd rows do nearly what greens that differ do to a mosaic whose light
    is of unknown colour: only the noise of each channel tells. Correlations have no side: memory of
    the sample before may be charge that neighbours exchange, or a filter, and such charge a filter,
    which makes read noise alike, too. Few levels beyond where a read-out path begins may bend there
    as all do. Noise that differs from pixel to pixel has heavy tails in all of them together;
    pixels that jump at every other frame are noisy ones. Where that explains more, and also what
    the best leaves alone, so much the more; but not where it leaves alone what the best explains,
    as charge of neighbours does what samples two apart have in common.
    """
    others = [kind for kind in _TWINS.get(best.kind, ()) if kind not in vocabulary]
    if not others:
        return None
    return next(
        (
            one
            for one in ranked(state, others, memory, step)
            if ties(state, best, one)
            or (one.gain > best.gain + TOLD_APART and alike(state, best.mean, one.mean, _SOME))
        ),
        None,
    )


def akin(pairs: Sequence[tuple[Ranked, Ranked | Path]]) -> frozenset[str]:
    """Return kinds that may be what one of a pair is, of pairs that tie: none is claimed alone.

    Of tails and of noise that differs from pixel to pixel neither is told; then pixels that jump,
    which explain less of the same, are no third. Memory that ties is told from memory of another
    lag: see `of_tied_lag`; a step where a path begins from what bends levels all over.
    """
    kinds = {one.kind for pair in pairs for one in pair}
    found = {kind for kind, own in _TWINS.items() if kinds.intersection(own)}
    return frozenset(found - (kinds & {_OF_LAGS}) - (_OF_LEVELS - kinds))


def of_tied_lag(pairs: Sequence[tuple[Ranked, Ranked | Path]], effect: Effect) -> bool:
    """Return whether an effect is memory of as many samples as one that ties with another effect.

    Along either axis: what neighbours share by a filter, they share along both.
    """
    fits = (one.proposal.effect for pair in pairs for one in pair if isinstance(one, Ranked))
    lags = {own.lag_pixels for own in fits if isinstance(own, ReadoutMemory)}
    return isinstance(effect, ReadoutMemory) and effect.lag_pixels in lags


def by_numbers(
    state: State, users: BaseNoise, fitted: Sequence[Ranked], rival: Ranked | Path
) -> list[Ranked] | None:
    """Return effects, first that of two that tie with which the user's numbers hold; None: none.

    Nothing is said of a rival that is named already. Nor for a filter beside a memory: one that
    takes from its own sample what it keeps of the last has less variance, as a filter has.
    """
    named = {own.kind for own in state.camera.effect}
    if not isinstance(rival, Ranked) or rival.kind in named:
        return None
    best, *others = fitted
    first = preferred(state, users, best, rival)
    if first is not None and (first.kind, {best.kind, rival.kind}) == _KEEPS_VARIANCE:
        return None
    if first is best:
        return list(fitted)
    behind = [one for one in others if one is not rival]
    if first is rival and len(behind) < len(others):
        return [replace(rival, gain=best.gain), best, *behind]
    return None


def _unpriced(one: Ranked) -> float:
    """Return what an effect gains before it is paid for that it is one of many."""
    return one.gain + log(one.proposal.best_of)


def _other_line(state: State, best: Ranked, other: Ranked) -> bool:
    """Return whether two effects are lines of different frequencies: a sensor may have both."""
    one, two = (frequency_of(ranked.proposal.effect) for ranked in (best, other))
    if one is None or two is None:
        return False
    layout = state.setting.layout
    return not same_line(one, two, layout.rows, layout.columns)
