"""What a search has taken in, and its parameters: fitted together, and as they are in the end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.apart import Apart, apart_of_users, with_apart
from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.candidates.patterns import of_any_shape
from analysis.mismatch.credited import given_back
from analysis.mismatch.displaced import displaced
from analysis.mismatch.forms import other_form
from analysis.mismatch.lightfield import measured_light
from analysis.mismatch.named import Named, camera_without, renewed
from analysis.mismatch.own import Own, called, explained, refitted, resized, sizes, without_own
from analysis.mismatch.polish import polish, with_effects
from analysis.mismatch.predict import Predictor
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.rank import LEAST_GAIN, Ranked
from analysis.mismatch.resolved import FAR_OFF, calls_alone, explains
from analysis.mismatch.segments import Path, second_path
from analysis.mismatch.state import Setting, State
from analysis.mismatch.uncertainty import settled
from dsis.camera import Camera
from dsis.effects import Effect

Step = Callable[[], None]
WEAK = 30.0  # gain below which an effect may be what others, fitted one by one, left over
_POLISHES = 3  # of what is strong
_LIGHT = "shading"
MAKE_ALIKE = frozenset({"brighter_fatter", "crosstalk", "readout_memory", "spatial_filtering"})


@dataclass
class Fitted:
    """Effects beside a base state, and sizes of the camera's own effects.

    Attributes
    ----------
    setting, step
        What was observed, and what to call on the way.
    camera
        The user's, its own effects of the sizes that the recording shows.
    base
        The state of the user's camera.
    vocabulary
        Effects that may be named.
    named
        Those taken in.
    ties
        Those that are put aside, for the recording does not tell one from the other.
    own
        Effects of the camera that have other sizes than the user's.
    sized
        Places of those whose size was fitted since an effect was taken in or dropped.
    polished
        The state that was fitted last.
    rough
        Whether a strong effect was taken in since.
    beside_path
        By the kinds of those taken in, and the level below it: whether a second path that was
        denied stands beside them.
    changes
        What effects taken in change in the numbers, by name, of a large recording: in the end they
        change what they did before all was settled.
    whole, of_whole
        All frames of a small recording: they say whether anything differs. The model of these that
        was asked last.
    """

    setting: Setting
    camera: Camera
    base: State
    vocabulary: frozenset[str]
    step: Step
    named: list[Named] = field(default_factory=list)
    ties: list[tuple[Ranked, Ranked | Path]] = field(default_factory=list)
    own: list[Own] = field(default_factory=list)
    sized: set[int] = field(default_factory=set)
    polished: State | None = None
    rough: bool = False
    beside_path: dict[tuple[str, ...], bool] = field(default_factory=dict)
    whole: Setting | None = None
    of_whole: State | None = None
    changes: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    unlike: Apart | None = None  # dark currents of the user's camera, otherwise than it has them
    left: State | None = None  # by the user's effects of other sizes, as all frames say

    def lit(self, state: State) -> State:
        """Return the state in the light that flats show, where no shape of few numbers has it.

        What was measured in other frames before is measured again, and what was a shape of few
        numbers makes way for it.
        """
        state = self._apart(state)
        if _LIGHT not in self.vocabulary:
            return state
        before = [one for one in self.named if one.kind == _LIGHT]
        known = [one.effect for one in before if one.effect is not None]
        bare = camera_without(state.camera, known, self.camera)
        users = any(own.kind == _LIGHT for own in self.camera.effect)
        if users and not before:  # of another size it may be all there is
            state = self._resized(state, [o for o in self._sizes() if o.effect.kind == _LIGHT])
            bare = state.camera
        found = measured_light(replace(state.clues(), camera=bare), beside=users)
        light = None if found is None else found.light
        camera = None if light is None else with_effects(bare, [light])
        if found is None or camera is None:
            return state
        self.named = [found, *(one for one in self.named if one not in before)]
        return State.of(self.setting, camera, self.step, draft=True, near=state)

    def _apart(self, state: State) -> State:
        """Return the state with the user's dark currents as far apart as pixels show."""
        found = apart_of_users(state, self.camera, self.unlike)
        if found is None:
            return state
        self.unlike = found
        self.camera = with_apart(self.camera, found)
        camera = with_apart(state.camera, found)
        return State.of(self.setting, camera, self.step, draft=True, near=state)

    def settle(self, state: State) -> State:
        """Return the state with final parameters; their errors go into the effects named.

        Light falls by a shape that is fitted as well. Where it is not clear, whether light falls at
        all is asked of the fall alone, see `unclear`.
        """
        state = self._in_form(self._resized(state, self._called(state)))
        self.named = [
            n if n.proposal is None else replace(n, proposal=of_any_shape(n.proposal))
            for n in self.named
        ]
        bare, mine = self._parts(state)
        if not mine:
            return state
        found = settled(state, bare, mine)
        camera = self._fitted(bare, found.effects, found.errors)
        if camera is None:
            return state
        plain = iter(found.plain[len(self.own) :])
        self.named = [
            n if n.proposal is None else replace(n, plain=next(plain)) for n in self.named
        ]
        # Beside what is named now, the user's sizes may do.
        good = [own.users for own in self.own if not own.contradicted]
        self.own = [own for own in self.own if own.contradicted]
        self.camera = resized(self.camera, good)
        return State.of(self.setting, resized(camera, good), self.step, near=state)

    def _in_form(self, state: State) -> State:
        """Return the state with each effect in the form beside which the user's numbers hold."""
        for i, named in enumerate(self.named):
            effect = named.effect
            found = None if effect is None else other_form(state, self.camera.noise, effect)
            if found is not None and named.proposal is not None:
                self.named[i] = renewed(named, named.proposal, found[0], named.errors)
                state = State.of(self.setting, found[1], self.step, near=state)
        return state

    def of_all(self, camera: Camera) -> State:
        """Return the state of all frames of a small recording beside a camera."""
        setting = self.whole or self.setting
        self.of_whole = State.of(setting, camera, self.step, near=self.of_whole)
        return self.of_whole

    def _parts(self, state: State) -> tuple[Camera, list[Proposal]]:
        """Return a state's camera without what is fitted, and that: own sizes, effects named."""
        mine = [named.proposal for named in self.named if named.proposal is not None]
        bare = camera_without(state.camera, [p.effect for p in mine], self.camera)
        return without_own(bare, self.own), [*(own.proposal for own in self.own), *mine]

    def _fitted(
        self, bare: Camera, effects: Sequence[Effect], errors: Sequence[dict[str, float]]
    ) -> Camera | None:
        """Take in what was fitted, and return the camera with it; None: it cannot have them."""
        if with_effects(bare, effects) is None:
            return None
        fitted = iter(zip(effects, errors, strict=True))
        self.own = [
            replace(own, effect=e, errors=se)
            for own, (e, se) in zip(self.own, fitted, strict=False)
        ]
        self.named = [
            n if n.proposal is None else renewed(n, n.proposal, *next(fitted)) for n in self.named
        ]
        self.camera = resized(self.camera, self.own)
        some = [named.proposal.effect for named in self.named if named.proposal is not None]
        return bare.model_copy(update={"effect": (*self.camera.effect, *some)})

    def without(self, state: State, named: Named) -> Camera:
        """Return a state's camera without one of the effects named.

        Without a second read-out path it has none of what needs one, either.
        """
        if named.proposal is None:
            camera = state.camera.model_copy(update={"noise": self.base.camera.noise})
            able = [own for own in camera.effect if not own.unfit_for(camera.read_out)]
            return camera.model_copy(update={"effect": tuple(able)})
        left = camera_without(state.camera, [named.proposal.effect], self.camera)
        return given_back(left, named.proposal.effect, self.setting.given, self.setting.layout)

    def _beside(self, named: Named) -> set[str]:
        """Return the kinds of the other effects named, and of the camera's own of other sizes."""
        return self._named_beside(named) | {one.effect.kind for one in self.own}

    def _named_beside(self, named: Named) -> set[str]:
        return {n.kind for n in self.named if n is not named and n.proposal is not None}

    def explained_by(
        self, named: Named, state: State, bare: State, asked: State | None = None
    ) -> bool:
        """Return whether a state with an effect explains half of something that one without leaves.

        Or what called for it alone: at first, beside the user's effects of other sizes, or in all
        frames, as they were `asked` last.
        """
        beside = self._beside(named)
        called = [(self.base, beside), (self.left, self._named_beside(named)), (asked, beside)]
        return any(
            explains(state, bare, base, calls_alone(named.kind, others))
            for base, others in called
            if base is not None
        )

    def fitted_without(self, state: State, named: Named) -> Camera:
        """Return the camera without one of the effects named, its base numbers fitted once more.

        No physics is credited with what better numbers give.
        """
        camera = self.without(state, named)
        effect = None if named.proposal is None else named.proposal.effect
        if effect is not None and not effect.changes & {"level", "pixel_variance"}:
            return camera  # levels and variances know nothing of it
        return self.setting.calibrated(camera, state.calibrated).model.camera

    def _feigned(self, state: State, gain: float) -> bool:
        """Return whether an effect of some gain may be what others, fitted one by one, left over.

        Of a large recording, only if it is weak: there to fit all together takes long.
        """
        if not self.rough or self.setting.large:
            return self.rough and gain < WEAK
        return gain < WEAK or self._depart(state, FAR_OFF)

    def _own(self, named: Named) -> Own | None:
        """Return the camera's own effect that one named is like, as large as both; None: none."""
        effect = None if named.proposal is None else named.proposal.effect
        like = (own.beside(effect) for own in self._sizes() if effect and own.like(effect))
        return next(like, None)

    def _sizes(self) -> list[Own]:
        """Return the camera's own effects that have a size, as they are now."""
        fitted = {own.place: own for own in self.own}
        found = [fitted.get(own.place, own) for own in sizes(self.camera)]
        # Light that was measured beside the user's has all that this leaves.
        lit = any(one.light is not None for one in self.named)
        return [own for own in found if not (lit and own.effect.kind == _LIGHT)]

    def _called(self, state: State, *, less: bool = False) -> list[Own]:
        """Return own effects that mismatches call for, but those that tie with others.

        `less`: by showing less than the model.
        """
        tied = {one.kind for pair in self.ties for one in pair}
        left = [o for o in self._sizes() if o.place not in self.sized and o.effect.kind not in tied]
        if not left:
            return []
        return called(left, [m for m in state.mismatches if not less or m.z < 0])

    def _resized(self, state: State, some: Sequence[Own], least: float = 0.0) -> State:
        """Return the state with own effects of the sizes that the recording shows, if others.

        Only if they gain at least so much.
        """
        self.sized |= {own.place for own in some}
        before = state
        while found := refitted(state, some):
            if state is before and max(own.gain for own in found) < least:
                break
            effects, camera = state.camera.effect, resized(state.camera, found)
            anew = State.of(self.setting, camera, self.step, near=state)
            if not explained(found, state, anew):  # it stands in for something else
                break
            kept = {own.place: own for own in [*self.own, *found]}
            self.own = [kept[place] for place in sorted(kept)]
            self.camera = resized(self.camera, found)
            state = anew
            # Far from where it was, a change is not known well enough to tell little from none.
            some = [own for own in found if own.fell_from(effects[own.place])]
            if not some:
                break
        if state is before or self.named or self.whole is None:
            return state
        self.left = replace(state, mismatches=self.of_all(self.camera).mismatches)
        return self.left

    def _polished(self, state: State) -> State:
        """Fit the parameters of all effects together, and judge the result once more.

        What is strong is far off by a small share of it: as long as that much is gained, and what
        calls for an effect still departs, once more, about the parameters found.
        """
        self.rough = False
        if state is self.polished:
            return state
        for _ in range(1 if self.setting.large else _POLISHES):
            state, gain = self._polished_once(state)
            if gain < LEAST_GAIN or not self._depart(state):
                break
        self.polished = state
        return state

    def _polished_once(self, state: State) -> tuple[State, float]:
        """Return the state with parameters fitted about the present ones, and what that gained."""
        bare, mine = self._parts(state)
        if not mine:
            return state, 0.0
        sparse = replicates_for(self.setting, [p.effect for p in mine])
        predictor = state.predictor(max(self.setting.polishing, sparse))
        # Of a large recording each simulation tells much and costs much: `settle` steps once more.
        rounds = 1 if self.setting.large else 2
        polished = polish(predictor, bare, mine, rounds, self._slopes(state))
        camera = None if polished is None else self._fitted(bare, polished.effects, polished.errors)
        if polished is None or camera is None:
            return state, 0.0
        gain = polished.loglik - predictor.loglik(state.null.mean)
        return State.of(self.setting, camera, self.step, near=state), gain

    def path(self, state: State) -> Path | None:
        """Return a second read-out path that variances show; None: they do not, or it is denied.

        What neighbours share was fitted without it, and may feign a bend or hide where it begins:
        a strong one that is denied stands where it does once all is fitted beside it.
        """
        found = second_path(state)
        if found is None or not displaced(state, found.kind, found.mean):
            return found
        kinds = tuple(sorted(one.kind for one in self.named))
        if found.gain < WEAK or MAKE_ALIKE.isdisjoint(kinds):
            return None
        kinds = (*kinds, f"{found.gap[0]:.0f}")
        if kinds not in self.beside_path:
            kept = self.named, self.own, self.camera, self.polished, self.rough
            made = State.of(self.setting, found.camera, self.step, draft=True, near=state)
            made = self._polished(made)
            self.named, self.own, self.camera, self.polished, self.rough = kept
            denial = displaced(made, found.kind, made.null.mean, state.null.mean)
            self.beside_path[kinds] = denial is None
        return found if self.beside_path[kinds] else None

    def fitted_anew(self, state: State) -> State:
        """Return the state with all parameters fitted once more, where what calls for any departs.

        What was dropped may have had a part of what others explain.
        """
        return self._polished(state) if self._depart(state) else state

    def _depart(self, state: State, least: float = 0.0) -> bool:
        """Return whether statistics differ for certain that call for effects taken in.

        By `least` standard deviations or more.
        """
        calls = {name for one in self.named if one.kind in CANDIDATES
                 for name in CANDIDATES[one.kind].calls}  # fmt: skip
        return any(m.statistic in calls and abs(m.z) >= least for m in state.mismatches)

    def _slopes(self, state: State) -> Callable[[Effect], Predictor]:
        """Return what tells how numbers move with an effect: few simulations, where they do."""

        def asked(effect: Effect) -> Predictor:
            setting = self.setting
            least = setting.replicates if setting.alike(effect) else setting.polishing
            return state.predictor(max(least, replicates_for(self.setting, [effect])))

        return asked

    def rebased(self, whole: State) -> State:
        """Return the state before physics was added, its own effects of the sizes recorded.

        `whole` is what is asked whether anything differs: no physics is credited with better sizes.
        """
        if not self.own and self.unlike is None:
            return whole
        whole = State.of(whole.setting, self.camera, self.step, near=whole)
        large = self.base.setting.large
        base = self.base
        base = whole if large else State.of(base.setting, self.camera, self.step, near=base)
        self.base = replace(base, mismatches=whole.mismatches)
        return whole
