"""What all frames together show of an effect that the locked ones leave open.

What draws one number a frame shows as many in the locked frames as these are: two of an exposure,
where it may be seen in one exposure only. The odds of locked frames alone then scatter by more than
they are worth. Those of all frames are their product with those of the frames before: asked for is
what takes an effect into a search, once the numbers that were chosen are paid for.

Few pixels that jump are as rarely seen: most stay where they are in two frames. Of what each pixel
has for good locked frames are a few more, which say little by themselves: where they gain by it at
odds that tell two effects apart, those of all frames count.
"""

from analysis.mismatch.candidates import calls_of
from analysis.mismatch.instance import LINES, same_place
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.rank import SURE_GAIN, TOLD_APART
from analysis.mismatch.resolved import gained
from analysis.mismatch.state import State
from analysis.mismatch.trial import Trial
from dsis.camera import Camera
from dsis.effects import Effect

_OF_FRAMES = frozenset({"frame_variance"})
_JUMPS = "rts"
_MAPS = frozenset({"dsnu", "prnu"})
_ONE_PHASE = LINES | {"line_flicker"}


def shown_by_all(
    search: Search, final: State, named: Named, without: Camera, trial: Trial, nats: float
) -> bool:
    """Return whether all frames of a small recording show an effect, at odds that take it in.

    `without` is the camera without it; `nats` what locked frames gain by it in all. Of maps beside
    which something is left that calls for them nothing is said.
    """
    own = named.proposal
    if own is None or search.whole is None:
        return False
    if own.effect.kind == _JUMPS:
        known = any(one.kind == _JUMPS for one in without.effect)
        lines = trial.lines
        return not known and (lines.jumping(search.least_odds) or lines.jump_rather(SURE_GAIN))
    kind, left = own.effect.kind, {m.statistic for m in final.mismatches}
    borne_out = kind in _MAPS and nats >= TOLD_APART and left.isdisjoint(calls_of(kind))
    if not (borne_out or once_a_frame(own.effect)):
        return False
    alone = not any(same_place(own.effect, one, search.whole.layout) for one in without.effect)
    # Of its amplitude; its place is paid for.
    if alone and trial.lines.gain(own.effect) - 1 >= SURE_GAIN:
        return True
    if own.effect.kind in LINES:  # one number of the bank says less of them than frames do
        return False
    state = search.of_all(final.camera)
    bare = State.of(search.whole, without, search.step, near=state)
    replicates = replicates_for(search.setting, [own.effect])
    return gained(state, bare, own.effect, replicates) - own.price >= SURE_GAIN


def once_a_frame(effect: Effect) -> bool:
    """Return whether an effect draws one number a frame: a level, a sign, a phase."""
    return effect.changes == _OF_FRAMES or effect.kind in _ONE_PHASE
