"""Proposals of a search: what they predict as they are proposed, and as they are fitted."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.apart import known_at_once
from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.credited import together
from analysis.mismatch.memory import Memory
from analysis.mismatch.model import side_by_side
from analysis.mismatch.polish import Polished, polish, with_effects
from analysis.mismatch.predict import Predictor
from analysis.mismatch.state import Setting, State
from dsis.camera import Camera
from dsis.effects import Effect

Array = NDArray[np.float64]
Fresh = tuple[int, Effect, Camera | None, Predictor]
"""Number of a proposal that is to be simulated, effect, camera with it, and by what."""

_SPARSE = 4  # times as many simulations
_BY_FRAME = frozenset({"frame_variance"})
# A sign: half of the pairs of frames show nothing, half show it twice. A band: one bin's phase.
# Pink noise and bands of rows: most of it in a frame's mean and in the first few bins. Gains that
# neighbours share: in few patches. Hot pixels: the few brightest ones.
_BY_DRAW = frozenset(
    {"bistable_pattern", "hot_pixels", "line_flicker", "pink_noise", "row_banding", "smooth_prnu"}
)
_BY_BIN = frozenset({"periodic_noise"})  # of few frames: the noise of one bin comes on top
STRONG = 30.0  # gain of log-likelihood beside which what gained little before needs no new trial
WORTH_IT = 0.3  # share of it


def beside_credited(state: State, proposal: Proposal) -> tuple[Camera, list[Proposal]]:
    """Return a state's camera, and what is fitted in it of a proposal: see `together`."""
    return together(state.camera, proposal, state.setting.given, state.setting.layout)


def replicates_for(setting: Setting, effects: Iterable[Effect]) -> int:
    """Return how many simulations tell what effects change.

    Of one number or sign a frame, few frames of few simulations may hold next to nothing.
    """
    if any(_sparse(setting, effect) for effect in effects):
        return min(_SPARSE * setting.replicates, setting.drafts)
    return setting.replicates


def _sparse(setting: Setting, effect: Effect) -> bool:
    few = not setting.large and effect.kind in _BY_BIN
    return few or effect.changes == _BY_FRAME or effect.kind in _BY_DRAW


def means_of(
    state: State, some: Sequence[Proposal], memory: Memory, step: Callable[[], None], best: float
) -> list[Array | None]:
    """Return the numbers with each effect added, remembered or simulated; None: it is no camera.

    `best` is what another is known to gain.
    """
    effects = [proposal.effect for proposal in some]
    predictor = state.predictor(state.setting.screening)
    by_frame = state.predictor(replicates_for(state.setting, effects))
    fits = [beside_credited(state, proposal) for proposal in some]
    alone = [len(starts) == 1 for _, starts in fits]  # else the change is another's too
    found = [
        memory.recalled(effect, state) if own else None
        for effect, own in zip(effects, alone, strict=True)
    ]
    fresh = [
        (
            i,
            effect,
            with_effects(fits[i][0], [start.effect for start in fits[i][1]]),
            by_frame if _sparse(state.setting, effect) else predictor,
        )
        for i, effect in enumerate(effects)
        if found[i] is None
    ]
    if state.setting.large:
        fresh = _screened(predictor, fresh, [proposal.of_pixels for proposal in some], best)
    for asked in (predictor, by_frame):
        asked.ready(camera for _, _, camera, own in fresh if own is asked)
    for i, effect, camera, asked in fresh:
        step()
        if camera is not None:
            mean = asked.mean(camera)
            if alone[i] and (asked is by_frame or not _sparse(state.setting, effect)):
                memory.keep(effect, state, mean)
            found[i] = mean
    return found


def _screened(
    predictor: Predictor, fresh: Sequence[Fresh], of_pixels: Sequence[float | None], best: float
) -> list[Fresh]:
    """Return what is to be simulated, by few where these leave it far behind the best.

    More simulations of a large recording, which take long, are for what may be worth a fit.
    `of_pixels` are what single pixels gain by each proposal.
    """
    predictor.ready(camera for _, _, camera, _ in fresh)
    gains = [
        -np.inf if camera is None else predictor.gain(predictor.mean(camera), of_pixels[i])
        for i, _, camera, _ in fresh
    ]
    best = max(best, *gains, 0.0)
    behind = [best > STRONG and gain < WORTH_IT * best for gain in gains]
    return [
        (*one[:3], predictor if far else one[3]) for one, far in zip(fresh, behind, strict=True)
    ]


def all_fitted(state: State, some: Sequence[Proposal], far: float) -> list[Polished | None]:
    """Return effects fitted beside the camera's, each by itself; None: it is no camera.

    Of a large recording, where steps are long and sure and each simulation takes long, those that
    are `far` behind the best of them after a first step go no further, nor what that did not move.
    """
    setting = state.setting
    made = side_by_side(partial(_fitted, state), [(own, None) for own in some], setting.jobs)
    if not setting.large:
        return made
    sane = [
        own.loglik
        for own in made
        if own is not None and CANDIDATES[own.effects[0].kind].sane(setting.layout, own.effects[0])
    ]
    least = max(sane, default=np.inf) - far
    near = [
        i
        for i, own in enumerate(made)
        if own is not None and own.loglik >= least and own.effects[0] != some[i].effect
    ]
    work = [(some[i], made[i]) for i in near]
    for i, own in zip(near, side_by_side(partial(_fitted, state), work, setting.jobs), strict=True):
        made[i] = own
    return made


def _fitted(state: State, which: tuple[Proposal, Polished | None]) -> Polished | None:
    """Return a proposal as fitted, or fitted further; None: it is no camera."""
    proposal, before = which
    own = state.predictor(replicates_for(state.setting, [proposal.effect]))
    rounds = 0 if known_at_once(proposal.effect) else 1 + len(proposal.free)
    if state.setting.large:
        rounds = min(rounds, 1)
    bare, starts = beside_credited(state, proposal)
    if before is not None:
        found = zip(starts, before.effects, strict=True)
        starts = [replace(start, effect=effect) for start, effect in found]
    return polish(own, bare, starts, rounds=rounds)
