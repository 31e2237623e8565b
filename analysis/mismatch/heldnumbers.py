"""What the bank's numbers gain on the locked frames: the second witness beside the pixels.

Recordings with and without an effect are simulated on the same draws; what the locked frames add to
the others is judged by `given`. So a fixed pattern that locked frames share with the rest counts,
as it should.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.given import Numbers, Ratio, ratio
from analysis.mismatch.layout import Layout
from analysis.mismatch.model import Model, each
from analysis.mismatch.observe import Observation, observe
from analysis.mismatch.pictures.album import Album
from analysis.mismatch.recalibrate import Calibrated
from analysis.mismatch.relit import relit
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State, judged, numbers
from analysis.mismatch.taking import layout_of
from analysis.mismatch.thinned import Stage, thinned
from analysis.mismatch.touches import ALL_SUMS, RECORDED, differing, sums_for, touched
from analysis.mismatch.vector import Vector
from dsis.camera import Camera
from dsis.recording import Recording

Array = NDArray[np.float64]
Simulated = Callable[[str], Iterable[NDArray[np.generic]]]
_SIMULATIONS = 16
_FEW = 5  # where simulations are large
_MOST_KEPT = 8e7  # samples of simulated frames, two bytes each
_MOST_EXPOSURES = 10  # of a large recording, that have no locked frames: both sides know them


@dataclass(frozen=True)
class HeldNumbers:
    """The numbers of all frames beside those of the frames that were not locked.

    Attributes
    ----------
    recording, split, source
        The frames.
    setting
        Of the diagnosis.
    kept
        Numbers of simulated recordings, by yardstick, camera and sums that were made.
    """

    recording: Recording
    split: Split
    source: Source
    setting: Setting
    kept: dict[str, tuple[Array, Array]] = field(default_factory=dict)

    @property
    def whole(self) -> tuple[Layout, Observation]:
        """Layout and observation of all frames of the exposures that were fitted."""
        return self._watched[:2]

    @property
    def album(self) -> Album:
        """What has watched the observation of all frames."""
        return self._watched[2]

    @cached_property
    def _watched(self) -> tuple[Layout, Observation, Album]:
        numbers = {
            e.name: tuple(sorted((*e.numbers, *self.split.locked.get(e.name, ()))))
            for e in self.rest[0].exposures
        }
        layout = layout_of(self.recording, numbers, self.source.frames)
        album = Album(layout)
        seen = observe(
            layout,
            lambda name: self.source.frames(name, numbers[name]),
            album,
            keep=True,
            threads=self.setting.jobs,
        )
        return layout, seen, album

    @cached_property
    def rest(self) -> tuple[Layout, Observation]:
        """Layout and observation of the frames before the locked ones.

        Of a large recording, few of the exposures that have no locked frames.
        """
        whole = self.setting.layout
        if not whole.large:
            return whole, self.setting.seen
        others = tuple(e for e in whole.exposures if not self.split.locked.get(e.name))
        most = max((len(e.numbers) for e in others), default=0)
        few = thinned(replace(whole, exposures=others), Stage(most, _MOST_EXPOSURES, 0.0))
        left_out = {e.name for e in others} - {e.name for e in few.exposures}
        if not left_out:
            return whole, self.setting.seen
        kept = tuple(e for e in whole.exposures if e.name not in left_out)
        layout, numbers = replace(whole, exposures=kept), {e.name: e.numbers for e in kept}
        seen = observe(
            layout,
            lambda name: self.source.frames(name, numbers[name]),
            threads=self.setting.jobs,
        )
        return layout, seen

    @property
    def frames(self) -> int:
        """How many frames are locked."""
        return sum(len(self.split.locked.get(e.name, ())) for e in self.setting.layout.exposures)

    def gain(self, final: State, without: Camera) -> Ratio | None:
        """Return the gain of the final model over a camera without an effect, nats in all.

        None: the locked frames cannot tell.
        """
        if not self.frames:
            return None
        yardstick, effects = _yardstick(final, without), differing(final.camera, without)
        made = yardstick.sums | (sums_for(effects) if effects else ALL_SUMS)
        one, other = self._made(yardstick, final, (final.camera, without), made)
        layout, seen = self.whole
        parts = ((layout, seen), self.rest)
        recorded = [judged(one, yardstick, own) for one, own in parts]
        keys, places = _shared(recorded)
        whole, rest = (
            Numbers(own.values[of], one[i][:, of], other[i][:, of], own.errors[of])
            for i, (own, of) in enumerate(zip(recorded, places, strict=True))
        )
        may = touched(keys, effects) if effects else np.ones(len(keys), bool)
        return ratio(whole, rest, [(key.statistic, key.scope) for key in keys], may)

    def _made(
        self,
        yardstick: Calibrated,
        final: State,
        cameras: Sequence[Camera],
        sums: frozenset[str],
    ) -> list[tuple[Array, Array]]:
        """Return each camera's numbers of all simulated frames, and without the locked ones.

        Each is (recording, number). `sums` are those that the numbers asked for need.
        """
        judges = f"{yardstick.model.camera.model_dump_json()} {final.camera.model_dump_json()}"
        keys = [f"{judges} {one.model_dump_json()} {sorted(sums)}" for one in cameras]
        missing = {k: c for k, c in zip(keys, cameras, strict=True) if k not in self.kept}
        whole, rest = self.whole[0], self.rest[0]
        count = _FEW if self.setting.large else _SIMULATIONS
        models = [relit(final.calibrated.model, camera, whole) for camera in missing.values()]

        work = partial(_two, whole, rest, (self.setting.seed + 3, sums), yardstick)
        # All side by side: a few of one camera would leave processes idle in the end.
        asked = [(model, number) for model in models for number in range(count)]
        made = each(work, asked, self.setting.jobs)
        for i, key in enumerate(missing):
            own = made[i * count : (i + 1) * count]
            first, second = (np.stack(part) for part in zip(*own, strict=True))
            self.kept[key] = first, second
        return [self.kept[key] for key in keys]


def _yardstick(final: State, without: Camera) -> Calibrated:
    """Return whose base numbers judge all: the final model's.

    Of a camera with fewer read-out segments, that one's: with a segment more, both would fit.
    """
    calibrated = final.calibrated
    segments = without.noise.segment
    if len(segments) == len(final.camera.noise.segment):
        return calibrated
    switches = tuple(s.upper_dn for s in segments if s.upper_dn is not None)
    return replace(calibrated, model=calibrated.model.with_camera(without), switches=switches)


def _shared(parts: Sequence[Vector]) -> tuple[list[Key], list[list[int]]]:
    """Return what all have a number of, and where each has it.

    More frames may tell apart more ranges of a scene's signal: those are other numbers.
    """
    places = [{key: i for i, key in enumerate(part.keys)} for part in parts]
    keys = [key for key in parts[0].keys if all(key in own for own in places)]
    return keys, [[own[key] for key in keys] for own in places]


def _two(
    whole: Layout,
    rest: Layout,
    how: tuple[int, frozenset[str]],
    yardstick: Calibrated,
    which: tuple[Model, int],
) -> tuple[Array, Array]:
    """Return the numbers of all frames of a simulated recording, and of those of `rest`.

    `how` are the seed, and which sums are made; `which` are the model and the replicate.
    """
    (seed, sums), (model, replicate) = how, which
    frames, again = (model.frames(own, replicate, seed) for own in (whole, rest))
    one, other = _observed(whole, rest, frames, again, sums)
    return numbers(whole, yardstick, one), numbers(rest, yardstick, other)


def _observed(
    whole: Layout,
    rest: Layout,
    frames: Simulated,
    again: Simulated,
    sums: frozenset[str] = RECORDED,
) -> tuple[Observation, Observation]:
    """Return what all simulated frames show, and what those of `rest` show.

    Frames are simulated once and kept, or again where there are too many to keep.
    """
    seen = partial(observe, places=False, made=sums)
    if rest.samples > _MOST_KEPT:
        return seen(whole, frames), seen(rest, again)
    numbers = {e.name: e.numbers for e in whole.exposures}
    wanted = {e.name: frozenset(e.numbers) for e in rest.exposures}
    kept: dict[str, list[NDArray[np.uint16]]] = {name: [] for name in wanted}

    def watched(name: str) -> Iterator[NDArray[np.generic]]:
        for number, codes in zip(numbers[name], frames(name), strict=True):
            if number in wanted[name]:
                kept[name].append(codes.astype(np.uint16))
            yield codes

    return seen(whole, watched), seen(rest, kept.pop)
