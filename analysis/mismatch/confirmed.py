"""What a search found, confirmed or dropped: by all frames together, and by the locked ones."""

from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from functools import partial
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.allframes import shown_by_all
from analysis.mismatch.candidates import CANDIDATES, calls_of
from analysis.mismatch.explain import changes
from analysis.mismatch.explaining import DOUBTFUL, UNCALLED, hollow, idle, uncalled
from analysis.mismatch.finding import Gain
from analysis.mismatch.fixedforetold import FIXED_LINES
from analysis.mismatch.framebyframe import SIZES
from analysis.mismatch.instance import LINES, same_place
from analysis.mismatch.judge import NOTHING, Judge
from analysis.mismatch.locate import FAMILY
from analysis.mismatch.model import side_by_side
from analysis.mismatch.name import Search
from analysis.mismatch.named import APART, Named, told_by_itself, unclear, vague
from analysis.mismatch.relit import relit
from analysis.mismatch.resolved import explains
from analysis.mismatch.state import State
from analysis.mismatch.trial import Gained, Trial, denied
from dsis.camera import Camera

Array = NDArray[np.float64]
NO_FRAME = "no locked frame can show it: there is none, or code 0 or white cuts off too much"
_QUARTER = 0.25  # of what an effect explains, that may be left beside one of no clear size
_LITTLE = 0.3  # of what a number differs by, that an effect changes


def undenied(search: Search, final: State) -> State:
    """Drop, one by one, effects that are denied."""
    while (denied := search.denied(final)) is not None:
        final = search.drop(final, *denied)
    return final


def denied_by_rest(search: Search, state: State, base: State) -> tuple[Named, str] | None:
    """Return the effect that all frames together deny, by what they leave; None: they deny none.

    `base` is the state without any.
    """
    first = frozenset(m.statistic for m in base.mismatches)
    judge = Judge(state, partial(search.without, state), search.setting.nulls)
    return _unless_needed(search, state, lambda some: judge.denied_by_rest(some, first))


def _unless_needed(
    search: Search, state: State, denied_of: Callable[[Sequence[Named]], tuple[Named, str] | None]
) -> tuple[Named, str] | None:
    """Return the effect that is denied among some, and why; None: none is.

    Whether one explains anything is asked of the state without it, beside the others: a few
    simulated recordings hardly tell what is just certain, and at first what hides is not seen.
    """
    some = list(search.named)
    while (denied := denied_of(some)) is not None and denied[1] in (NOTHING, UNCALLED):
        bare = State.of(state.setting, search.without(state, denied[0]), search.step, near=state)
        if not explains(state, bare, bare, ()):
            break
        some.remove(denied[0])
    return denied


def undenied_by_all(
    search: Search, final: State, gains: dict[str, Gain], trial: Trial, whole: State
) -> tuple[State, dict[str, Gain], State | None]:
    """Drop, one by one, what all frames of a small recording deny; see `denied_by_rest` and below.

    The last is the final state of all frames; None where nothing is named.
    """
    while search.named:
        everything = search.of_all(final.camera)
        denied = denied_by_rest(search, everything, whole)
        denied = denied or idle(search, whole, everything)
        calling = partial(uncalled, search, whole, everything, gains, trial)
        denied = denied or _unless_needed(search, everything, calling)
        denied = denied or hollow(search, whole, everything)
        denied = denied or unsized(search, everything)
        if denied is None:
            return final, gains, everything
        final = search.fitted_anew(search.further(search.drop(final, *denied)))
        final, gains = proven(search, search.settle(final), trial, judged=False)
    return final, gains, None


def undenied_by_many(search: Search, final: State, whole: State) -> State:
    """Drop, one by one, what all frames of a large recording deny, as some did not.

    What each effect that is left changes in the numbers is kept.
    """
    final = undenied(search, final)
    while (denied := denied_by_rest(search, final, whole)) is not None:
        final = search.drop(final, *denied)
    while True:
        known = changes(whole, final, search.named, partial(search.without, final))
        nothing = idle(search, whole, final, known)
        if nothing is None:
            search.changes = {name: own * whole.null.sd for name, own in known.items()}
            return final
        final = undenied(search, search.drop(final, *nothing))


def proven(
    search: Search, final: State, trial: Trial, *, judged: bool
) -> tuple[State, dict[str, Gain]]:
    """Drop, one by one, effects that are denied, or whose gain is within its uncertainty.

    `judged`: all frames were asked already which are denied.
    """
    while True:
        final = final if judged else undenied(search, final)
        gained = _gained(search, final, trial)
        _simulated(search, final)
        sizes = [(one, small(search, final, one, gained.get(one.name))) for one in search.named]
        least = next((pair for pair in sizes if pair[1]), None)
        if least is not None:
            final = _without(search, final, least, judged=judged)
            continue
        weak = [
            named
            for named in search.named
            if named.name in gained and not gained[named.name].certain
        ]
        if not weak:
            return final, {name: one.gain for name, one in gained.items()}
        worst = min(weak, key=lambda named: gained[named.name].gain.nats_per_frame)
        nats = gained[worst.name].gain.nats_per_frame
        chance = f"gains {nats:.3g} nats per locked frame, no more than chance"
        why = chance if isfinite(nats) else NO_FRAME
        if _calls_left(search, final, worst) and gained[worst.name].gain.ci95[0] <= 0 < nats:
            why += " may where what calls for it is left"
        final = _without(search, final, (worst, why), judged=judged)


def small(search: Search, state: State, named: Named, told: Gained | None) -> str:
    """Return why an effect is not told from none by its own size; empty: it is, or frames bear it.

    What draws at random is known by what frames gain, whatever its size, unless a statistic that
    calls for it is left: then something else is there, by which frames would gain as well. Where
    locked frames leave it open, one of its sizes must exceed its error.
    """
    if named.effect is not None and named.effect.draws:
        if _calls_left(search, state, named):
            return unclear(named, at_random=True)
        plain = named.kind in LINES or named.measured or _borne_out(told)
        return "" if plain else vague(named)
    return "" if _borne_out(told) else unclear(named)


def unsized(search: Search, everything: State) -> tuple[Named, str] | None:
    """Return an effect of no clear size beside which all frames leave much open; None: none is.

    Of small recordings: in many frames what is sure has errors of its form that are larger.
    """
    asked = ((one, _unsized(search, everything, one)) for one in search.named)
    return next((pair for pair in asked if pair[1]), None)


def _unsized(search: Search, state: State, named: Named) -> str:
    """Return why an effect has no clear size, where much is left; empty: it has, or little is.

    Where its logarithm is told, that is left of what calls for it alone: frames that wander are
    none the less for rows that differ.
    """
    if named.kind in LINES or named.measured or not (why := vague(named, APART, unknown=True)):
        return ""
    calls = calls_of(named.kind) if told_by_itself(named) else None
    much = _much_left(search, state, named, calls)
    return f"{why}, and much is left unexplained beside it" if much else ""


def _much_left(
    search: Search, state: State, named: Named, calls: Container[str] | None = None
) -> bool:
    """Return whether what is left is off by a quarter of what an effect explains, or more.

    Of the statistics `calls`; None: of all.
    """
    left = max(
        (abs(m.z) for m in state.mismatches if calls is None or m.statistic in calls), default=0.0
    )
    if not left or named.proposal is None:
        return False
    null, without = state.null, state.predictor().mean(search.without(state, named))
    known = null.known & np.isfinite(without)
    change, seen = (
        np.where(known, own - without, 0.0) / null.sd for own in (null.mean, state.vector.values)
    )
    explains = np.minimum(np.abs(change), np.abs(seen))[change * seen > 0]
    return left >= _QUARTER * float(explains.max(initial=0.0))


def _borne_out(told: Gained | None) -> bool:
    """Return whether locked frames bear an effect out, whatever the error of its size."""
    return told is not None and told.certain and told.gain.ci95[0] > 0


def _without(search: Search, final: State, which: tuple[Named, str], *, judged: bool) -> State:
    """Return the state without an effect; unless all is `judged`, what it hid is looked for.

    What is found only once that is gone stands in its place: of two that explain the same frames
    the worse is no better, whatever others say of the first.
    """
    final = search.drop(final, *which)
    if judged or not final.mismatches:
        return final
    known = [*search.named, *search.own]
    least = search.least
    search.least = max(least, which[0].gain)
    final = search.fitted_anew(search.further(final))
    search.least = least
    return search.settle(final) if known != [*search.named, *search.own] else final


def _gained(search: Search, final: State, trial: Trial) -> dict[str, Gained]:
    """Return the gains of all effects; of those that chance could feign, where one of them fails.

    What gained little when it was taken in is asked first: the others change with it. Where the
    locked frames leave open an effect that moves whole frames, each frame is judged by all others;
    of what else they gain by, if within their error, all frames may show it.
    """
    found: dict[str, Gained] = {}
    little = [named for named in search.named if named.gain < DOUBTFUL]
    for some in (little, [named for named in search.named if named not in little]):
        cameras = _fitted_without(search, final, some)
        told = trial.gains(final, cameras)
        for named in some:
            one = told[named.name] = _believed(search, final, named, told[named.name])
            if one.certain:
                continue
            other = _foretold(search, named, cameras[named.name], trial, one)
            if other.certain:
                told[named.name] = other
                continue
            moved = _frame_by_frame(search, final, named, cameras[named.name], trial, one)
            if moved is not None:
                told[named.name] = moved
            elif max(one.gain.nats_per_frame, other.gain.nats_per_frame) > 0 and shown_by_all(
                search, final, named, cameras[named.name], trial, one.nats
            ):
                best = max(one, other, key=lambda own: own.gain.nats_per_frame)
                told[named.name] = replace(best, certain=True)
        found |= told
        if not all(one.certain for one in found.values()):
            break
    return found


def _believed(search: Search, state: State, named: Named, told: Gained) -> Gained:
    """Return a gain, which is chance where only a model that is wrong makes it certain.

    Odds that an interval does not bear out are those of a model that is right but for the effect.
    Where statistics that call for the effect are left unexplained beside it, the model is not:
    whatever gives frames another spread or other tails may gain by that. Whole frames may still
    show it.
    """
    if told.gain.ci95[0] > 0 or not _calls_left(search, state, named):
        return told
    return replace(told, certain=False)


def _calls_left(search: Search, state: State, named: Named) -> bool:
    """Return whether a statistic that calls for an effect is left unexplained beside it.

    Of numbers that it changes: what darks differ by with time is no matter of a bend.
    """
    off, unseen = _left_off(state, named)
    if unseen or not off:
        return unseen
    null = state.null
    change = search.changes.get(named.name)
    if change is None:
        change = null.mean - state.predictor().mean(search.without(state, named))
    change = np.where(null.known & np.isfinite(change), change, 0.0) / null.sd
    both = np.concatenate([change, null.contrasts.matrix @ change / null.contrast_sd])
    return bool((np.abs(both[off]) > _LITTLE * np.abs(state.departures[off])).any())


def _left_off(state: State, named: Named) -> tuple[list[int], bool]:
    """Return which numbers are off of statistics left that call for an effect.

    And whether one is left that no number shows, or of which no simulation is to be asked.
    """
    if named.kind not in CANDIDATES:
        return [], False
    left = {m.statistic for m in state.mismatches}.intersection(CANDIDATES[named.kind].calls)
    if not left or named.proposal is None:
        return [], bool(left)
    keys = state.null.keys
    off = [int(i) for i in np.flatnonzero(state.chances < FAMILY) if keys[i].statistic in left]
    # All frames may show what no number of these does.
    return off, bool(left - {keys[i].statistic for i in off})


def _simulated(search: Search, state: State) -> None:
    """Simulate side by side what `small` asks for one by one."""

    def asked(one: Named) -> bool:
        off, unseen = _left_off(state, one)
        return bool(off) and not unseen and one.name not in search.changes

    drawn = [one for one in search.named if one.effect is not None and one.effect.draws]
    some = [one for one in drawn if asked(one)]
    if len(some) > 1:
        state.predictor().ready(search.without(state, one) for one in some)


def _foretold(search: Search, named: Named, without: Camera, trial: Trial, told: Gained) -> Gained:
    """Return what locked frames gain by bands or lines that the others foretell; else `told`.

    Pixels know nothing of a phase that moves on or is kept, nor that few exposures show it; but
    what they are sure of is not asked again. `without` is the camera without the effect: beside
    one that it has at the same place nothing is said.
    """
    if named.proposal is None or denied(told.gain, trial.numbers.frames):
        return told
    effect, layout = named.proposal.effect, trial.numbers.whole[0]
    if any(same_place(effect, one, layout) for one in without.effect):
        return told
    if effect.kind in FIXED_LINES and search.whole is not None:
        bare = State.of(search.whole, without, search.step, near=search.of_whole)
        return trial.fixed_foretold(bare, effect) or told
    return trial.foretold(effect) or told


def _frame_by_frame(
    search: Search, final: State, named: Named, without: Camera, trial: Trial, known: Gained
) -> Gained | None:
    """Return what frames of a small recording gain, each told by the others; None: nothing sure.

    Nothing is said where what calls for the effect is left, beside one of its kind, nor where no
    locked frame says anything; `known` is what these gain.
    """
    effect = named.effect
    if effect is None or effect.kind not in SIZES or search.whole is None:
        return None
    beside = any(one.kind == effect.kind for one in without.effect)
    if beside or _calls_left(search, final, named) or not isfinite(known.gain.nats_per_frame):
        return None
    told = trial.frame_by_frame(
        relit(final.calibrated.model, without, final.setting.layout), effect
    )
    return told if told is not None and told.certain else None


def _fitted_without(search: Search, final: State, some: Sequence[Named]) -> dict[str, Camera]:
    """Return the cameras without each of some effects, fitted side by side."""
    fitted = side_by_side(partial(search.fitted_without, final), some, search.setting.jobs)
    return {named.name: camera for named, camera in zip(some, fitted, strict=True)}
