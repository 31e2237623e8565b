"""Effects that were taken in and to which, in the end, nothing that differed is put down."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES, calls_of
from analysis.mismatch.explain import because, changes, explained
from analysis.mismatch.finding import Gain
from analysis.mismatch.instance import LINES
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.rank import SURE_GAIN
from analysis.mismatch.state import State
from analysis.mismatch.trial import Trial

Array = NDArray[np.float64]
IDLE = "all that called for it is left, and nothing that differed is explained by it alone or best"
SOME_LEFT = "what calls for it is left, and nothing that differed is explained by it alone or best"
UNCALLED = "it explains nothing that differs in all frames, and frames leave it open"
HOLLOW = "nothing that differed is explained by it alone or best"
DOUBTFUL = 30.0  # gain of log-likelihood below which locked frames may not confirm an effect


def idle(
    search: Search, base: State, final: State, known: Mapping[str, Array] | None = None
) -> tuple[Named, str] | None:
    """Return an effect to which nothing that differed is put down; None: there is none.

    It gained little, and all that called for it is left: it fits beside something else, that no
    effect explains. Of a large recording, where the weakest is far above chance and no law is
    exact, some of it. Lines, and what else is measured, are shown by whole frames: where spectra
    peak only the strongest is located. `known` is what each effect changes in the numbers of
    `base`, if that was asked for already.
    """
    some, why = (True, SOME_LEFT) if search.setting.large else (False, IDLE)
    first, left = ({m.statistic for m in own.mismatches} for own in (base, final))
    asked = [
        n
        for n in search.named
        if n.gain < DOUBTFUL and n.kind in CANDIDATES and not (n.kind in LINES or n.measured)
        if (calls := left.intersection(CANDIDATES[n.kind].calls))
        and (some or calls >= first.intersection(CANDIDATES[n.kind].calls))
    ]
    return _explaining_nothing(search, base, final, asked, why, known)


def _explaining_nothing(
    search: Search,
    base: State,
    final: State,
    asked: Sequence[Named],
    why: str,
    known: Mapping[str, Array] | None = None,
    *,
    whatever_left: bool = False,
) -> tuple[Named, str] | None:
    """Return the first of some effects to which nothing that differed is put down, and why.

    None: there is none. `known` is as in `idle`, `whatever_left` as in `explained`.
    """
    if not asked:
        return None
    if known is None:
        known = changes(base, final, search.named, partial(search.without, final))
    own = {n.name: known[n.name] for n in search.named}
    told = explained(base, final, own, whatever_left=whatever_left)
    nothing = next((n for n in asked if not because(told, n.name)), None)
    return None if nothing is None else (nothing, why)


def uncalled(
    search: Search,
    base: State,
    final: State,
    gains: Mapping[str, Gain],
    trial: Trial,
    some: Sequence[Named],
) -> tuple[Named, str] | None:
    """Return one of some effects for which nothing calls in all frames, nor locked ones; or None.

    What hides behind another is called for by nothing at first: locked frames must show it then,
    whatever hinted at it. A line that explains nothing must be shown by all frames, at odds that
    take an effect in: peaks are many, of one axis or of another's.
    """
    first = {m.statistic for m in base.mismatches}
    asked = [
        n
        for n in some
        if n.kind in CANDIDATES and n.name in gains
        if n.kind in LINES or first.isdisjoint(CANDIDATES[n.kind].calls)
        if _unshown(n, gains[n.name], trial)
    ]
    return _explaining_nothing(search, base, final, asked, UNCALLED)


def _unshown(named: Named, gain: Gain, trial: Trial) -> bool:
    """Return whether frames leave open an effect that explains nothing that differs."""
    if named.kind in LINES and named.effect is not None:
        return trial.lines.gain(named.effect) - 1 < SURE_GAIN
    return not named.measured and gain.ci95[0] <= 0


def hollow(search: Search, base: State, final: State) -> tuple[Named, str] | None:
    """Return an effect that draws at random, to which nothing that differed is put down, or None.

    Frames gain by whatever spreads their samples where numbers of the model are off beside it: more
    noise, longer tails or codes of other widths. Of something that differed it must explain most,
    whatever is left of that. Of two effects that the same calls for one may explain all of it
    better, and of what nothing called for see `uncalled`.
    """
    first = {m.statistic for m in base.mismatches}
    called = {n.name: first.intersection(calls_of(n.kind)) for n in search.named}
    asked = [
        n
        for n in search.named
        if n.kind in CANDIDATES and n.effect is not None and n.effect.draws
        if not (n.kind in LINES or n.measured) and called[n.name]
        if all(called[n.name].isdisjoint(own) for name, own in called.items() if name != n.name)
    ]
    return _explaining_nothing(search, base, final, asked, HOLLOW, whatever_left=True)
