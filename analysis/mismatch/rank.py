"""Effects that could explain what is off, each with fitted parameters, the best first."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.polish import Polished, polish, with_effects
from analysis.mismatch.predict import Predictor
from analysis.mismatch.state import State

_MOST = 4  # kinds that are fitted, after all were tried as proposed
_FAR = 15.0  # of log-likelihood behind the best as proposed: fitting does not make up for it


@dataclass(frozen=True)
class Ranked:
    """An effect with fitted parameters, and its gain of log-likelihood less its free parameters."""

    gain: float
    kind: str
    proposal: Proposal
    polished: Polished


def ranked(state: State, kinds: Iterable[str], step: Callable[[], None]) -> list[Ranked]:
    """Return the effects among `kinds` that mismatches call for, fitted one at a time."""
    predictor = state.predictor()
    before = predictor.loglik(state.null.mean)
    tried = _tried(state, predictor, kinds, step)
    best = max((value for value, _, _ in tried), default=0.0)
    found = []
    for value, kind, proposal in tried[:_MOST]:
        if value < best - _FAR:
            continue
        polished = polish(predictor, state.camera, [proposal], rounds=1 + len(proposal.free))
        if polished is not None:
            gain = polished.loglik - before - len(proposal.free)
            found.append(Ranked(gain, kind, proposal, polished))
        step()
    return sorted(found, key=lambda one: -one.gain)


def _tried(
    state: State, predictor: Predictor, kinds: Iterable[str], step: Callable[[], None]
) -> list[tuple[float, str, Proposal]]:
    """Return the best proposal of each kind as it is proposed, the most likely first."""
    off = {m.statistic for m in state.mismatches}
    clues = state.clues()
    tried = []
    for kind in sorted(kinds):
        candidate = CANDIDATES.get(kind)
        if candidate is None or not off & set(candidate.calls):
            continue
        own = []
        for proposal in candidate.propose(clues):
            built = with_effects(state.camera, [proposal.effect])
            if built is not None:
                own.append((predictor.loglik(predictor.mean(built)), kind, proposal))
        if own:
            tried.append(max(own, key=lambda one: one[0]))
        step()
    return sorted(tried, key=lambda one: -one[0])
