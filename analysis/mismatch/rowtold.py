"""Bands of rows and 1/f noise: which of them is claimed, as whole frames tell them apart."""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import hypot, isfinite, log

from analysis.mismatch.burst import TAILS
from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.forms import OTHER_LEVELS
from analysis.mismatch.instance import LINES
from analysis.mismatch.jumptold import PIXELS, as_pixels_show, standing_still, unlike_pixels
from analysis.mismatch.mapped import as_maps_show
from analysis.mismatch.named import Named
from analysis.mismatch.nofield import no_field
from analysis.mismatch.paired import STEADY
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.polish import with_effects
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.rank import LEAST_GAIN, TOLD_APART, Ranked, alike
from analysis.mismatch.repeated import OFFSETS
from analysis.mismatch.segments import Path
from analysis.mismatch.sidedneighbours import SHARED
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.pink_noise import PinkNoise
from dsis.effects.row_noise import RowNoise
from dsis.effects.rts import Rts

_OTHER = {"pink_noise": "row_banding", "row_banding": "pink_noise"}
EITHER = frozenset(_OTHER)
# Nats: odds of 9. Of 500 simulated recordings those told at between 9 and 20 were told wrong in 4
# of 33, those at more in 1 of 370: benchmarks/mismatch_row_odds.py.
LIKELIER = log(9)
AS_WELL = "whole frames may as well show"
SINGLE_ROWS = "row_noise"
_COMES_FIRST = "noise of single rows comes first, which is there with either of bands and 1/f noise"
_WORDS = {"pink_noise": "1/f noise", "row_banding": "bands of rows"}


def as_shown(state: State, frames: WholeFrames | None, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, the best first, where maps of the gain and whole frames had their say.

    Frames are asked where the best is one of both and the other was fitted as well. The numbers of
    both are much alike, and simulated: what frames say decides, at odds of 9; below that both tie.
    """
    fitted = as_pixels_show(frames, as_maps_show(state, fitted))
    odds = None if not fitted else _odds(state, frames, fitted[0])
    if odds is None:
        return list(fitted)
    best, other = fitted[0], _OTHER[fitted[0].kind]
    second = next((one for one in fitted if _of_rows(one) == other), None)
    if second is None:
        return list(fitted)
    first = best
    if abs(odds) <= LIKELIER:
        tie = alike(state, best.polished.mean, second.polished.mean)
        second = replace(second, gain=best.gain if tie else second.gain)
    else:
        if odds < 0:
            first, second = replace(second, gain=best.gain), best
        behind = min(second.gain, best.gain - abs(odds))
        second = replace(second, gain=max(behind, LEAST_GAIN))
        first = replace(first, told_from=second.kind)
    rest = [one for one in fitted if _of_rows(one) is None]
    return sorted([first, second, *rest], key=lambda one: -one.gain)


def unlike_frames(
    state: State,
    frames: WholeFrames | None,
    best: Ranked,
    others: Sequence[Ranked],
    left: Container[str] = (),
) -> Denial | None:
    """Return how whole frames, pixels, or the gain's map deny the best of ranked effects.

    None: they do not. Frames do where the other of both, which was not fitted or has no word, is as
    likely; and where neither is told, but noise of single rows is, as long as it is `left`.
    """
    if frames is not None and (denial := _of_frames(state, frames, best)) is not None:
        return denial
    if best.kind in PIXELS:
        off = frozenset(m.statistic for m in state.mismatches)
        return standing_still(frames, best, off) or unlike_pixels(
            state.camera, frames, best, others, partial(_explained, state)
        )
    if (denial := no_field(state, best.polished.effects[0])) is not None:
        return denial
    odds = _odds(state, frames, best)
    if odds is None or odds > LIKELIER:
        return None
    if odds > -LIKELIER and SINGLE_ROWS in left and _noisy_rows(state):
        return Denial(1 / 2, _COMES_FIRST)
    other = _OTHER[best.kind]
    return None if _any(others, other) else rival(-odds, f"{AS_WELL} {_WORDS[other]}")


def as_likely(refused: Mapping[str, str], left: Container[str]) -> dict[str, str]:
    """Return bands and 1/f noise, each with the other, where one was refused for frames show both.

    `refused` are effects by name, and why; `left` are statistics that are unexplained: what calls
    for one of both must be among them.
    """
    found: dict[str, str] = {}
    for kind, other in _OTHER.items():
        doubted = refused.get(kind, "").startswith(AS_WELL)
        if doubted and any(statistic in left for statistic in CANDIDATES[kind].calls):
            found |= {kind: other, other: kind}
    return found


def _noisy_rows(state: State) -> bool:
    """Return whether frames show noise of single rows besides, which the camera has not yet."""
    there = any(own.kind == SINGLE_ROWS for own in state.camera.effect)
    return not there and state.setting.noisy_rows() > TOLD_APART


def beside_undecided(
    named: Named, ties: Iterable[tuple[Ranked | Path, ...]], size_dn: Callable[[], float | None]
) -> Named:
    """Return noise of single rows with an error that allows for what else makes rows differ.

    Where bands and 1/f noise tie neither is taken in, and the size of what is has a part of theirs.
    `size_dn` is what frames say it has beside either.
    """
    tied = any({one.kind for one in pair} == _OTHER.keys() for pair in ties)
    if not tied or named.kind != SINGLE_ROWS or not isinstance(named.effect, RowNoise):
        return named
    own = size_dn()
    if own is None or "sigma_dn" not in named.errors:
        return named
    error = hypot(named.errors["sigma_dn"], named.effect.sigma_dn - own)
    return replace(named, errors={**named.errors, "sigma_dn": error})


def _of_frames(state: State, frames: WholeFrames, best: Ranked) -> Denial | None:
    """Return how frames deny what lasts, tails, codes, or offsets that are fixed; None: not.

    Of offsets nothing is said beside lines, which may last as long as an exposure does.
    """
    kind = best.kind
    if kind in STEADY:
        return frames.pairs.denial(kind)
    if kind in SHARED:
        return frames.sided.denial(kind)
    if kind == "adc_dnl":
        return None if frames.column_codes is None else frames.column_codes.denial()
    if kind in TAILS:
        there = frozenset(own.kind for own in state.camera.effect)
        if frames.located is not None:
            there |= {"rts"}  # that they jump is said for itself
        few = frames.bursts.denial(kind) or frames.ring.even(kind, there)
        return few or frames.ring.denial(best.polished.effects[0], _read_dn2(state))
    if kind not in OFFSETS or any(own.kind in LINES for own in state.camera.effect):
        return None
    lined = any("spectral_peak" in own.statistic for own in state.mismatches)
    own = None if lined else frames.repeats.get(kind)
    return None if own is None else own.denial


def _read_dn2(state: State) -> float:
    """Return the variance of a state's read noise, DN^2."""
    return state.camera.noise.segment[0].intercept


def _explained(state: State, effect: Effect) -> float:
    """Return what a state's numbers gain by an effect as it is, nats.

    By pixels that jump, in the form that explains most.
    """
    levels = ("about", *OTHER_LEVELS) if isinstance(effect, Rts) else ()
    forms = [effect.model_copy(update={"levels": own}) for own in levels] or [effect]
    predictor = state.predictor(replicates_for(state.setting, [effect]))
    cameras = [one for own in forms if (one := with_effects(state.camera, [own])) is not None]
    predictor.ready(cameras)
    before = predictor.loglik(state.null.mean)
    gains = [predictor.loglik(predictor.mean(camera)) - before for camera in cameras]
    return max((gain for gain in gains if isfinite(gain)), default=0.0)


def _odds(state: State, frames: WholeFrames | None, best: Ranked) -> float | None:
    """Return by how much frames prefer one of both, nats; None: it is none, or not asked.

    Beside the other, which the camera has, it is no rival; nor is noise along columns, which rows
    do not show.
    """
    kind = _of_rows(best)
    if frames is None or kind is None:
        return None
    there = frozenset(own.kind for own in state.camera.effect)
    if _OTHER[kind] in there:
        return None
    return frames.rows.odds(kind, _OTHER[kind], there)


def _any(fitted: Sequence[Ranked], kind: str) -> bool:
    return any(_of_rows(one) == kind for one in fitted)


def _of_rows(one: Ranked) -> str | None:
    """Return which of both an effect is; None: none, or one that goes along columns."""
    effect = one.proposal.effect
    if isinstance(effect, PinkNoise) and effect.along == "columns":
        return None
    return one.kind if one.kind in _OTHER else None
