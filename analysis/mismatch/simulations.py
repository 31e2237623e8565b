"""Numbers of simulated recordings, by camera: each recording is simulated once."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.model import Model, each, simulate
from analysis.mismatch.observe import Observation
from analysis.mismatch.relit import relit
from analysis.mismatch.together import Work, most_together, shared_links, simulated_together
from analysis.mismatch.touches import ALL_SUMS, differing, sums_for
from dsis.camera import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Simulations:
    """Simulated recordings of cameras beside one model, all on the same draws.

    Attributes
    ----------
    layout, model
        What is simulated; every camera has the model's levels, see `relit`.
    numbers_of
        Gives the bank's numbers of an observation; processes are sent it.
    seed, jobs
        Of the simulations.
    sums
        That all numbers need, beside those of `ALL_SUMS`.
    kept
        Numbers by camera, in the order of the replicates. Those that need sums which the effects in
        which it differs from the model's cannot change are unknown.
    """

    layout: Layout
    model: Model
    numbers_of: Callable[[Observation], Array]
    seed: int
    jobs: int
    sums: frozenset[str] = frozenset()
    kept: dict[str, list[Array]] = field(default_factory=dict)

    def keep(self, camera: Camera, numbers: Sequence[Array]) -> None:
        """Take numbers of a camera's first replicates that were found elsewhere."""
        self.kept[_key(camera)] = list(numbers)

    def ready(self, cameras: Iterable[Camera], replicates: int) -> None:
        """Simulate side by side what will be asked for: few recordings of each of many cameras."""
        wanted = {_key(camera): camera for camera in cameras}
        # By replicates: cameras of one share draws, which are kept for a while.
        missing = [
            (key, number)
            for number in range(replicates)
            for key in wanted
            if number >= len(self.kept.get(key, ()))
        ]
        if len(missing) < 2:
            return

        own = self.model.camera
        parting = {key: shared_links(own, one) for key, one in wanted.items()}
        groups = _groups(missing, parting, most_together(self.layout), self.jobs)
        work: list[Work] = [
            ([(self._model(wanted[key]), self._made(wanted[key])) for key in keys], number)
            for keys, number in groups
        ]
        one = partial(simulated_together, self.layout, self.seed, self.numbers_of)
        made = each(one, work, self.jobs)
        ahead: dict[str, list[Array]] = {}
        for (keys, _), some in zip(groups, made, strict=True):
            for key, numbers in zip(keys, some, strict=True):
                ahead.setdefault(key, []).append(numbers)
        for key, more in ahead.items():
            known = self.kept.get(key, [])
            self.kept[key] = [*known[: replicates - len(more)], *more]

    def of(self, camera: Camera, replicates: int) -> Array:
        """Return the numbers of a camera's first replicates: (replicate, number)."""
        key = _key(camera)
        known = self.kept.get(key, [])
        missing = range(len(known), replicates)
        if missing:
            which = self._model(camera), self.layout, missing, self.seed, self.jobs
            known = [*known, *simulate(*which, self.numbers_of, self._made(camera))]
            self.kept[key] = known
        return np.stack(known[:replicates])

    def _model(self, camera: Camera) -> Model:
        return relit(self.model, camera, self.layout)

    def _made(self, camera: Camera) -> frozenset[str]:
        """Return the sums that a camera's numbers need: all, unless it differs by few effects."""
        own = self.model.camera
        effects = differing(camera, own)
        alike = camera.model_copy(update={"effect": own.effect}) == own
        return self.sums | (sums_for(effects) if effects and alike else ALL_SUMS)


def _groups(
    missing: Sequence[tuple[str, int]], parting: Mapping[str, int], most: int, jobs: int
) -> list[tuple[list[str], int]]:
    """Return keys of cameras that are simulated side by side, at most so many, and the replicate.

    Those that part from the model behind as many links (`parting`) have most in common, those that
    part early take longest and come first; there are groups for all jobs.
    """
    found = []
    for number in sorted({number for _, number in missing}):
        keys = [key for key, own in missing if own == number]
        keys.sort(key=lambda key: -parting[key])
        count = min(-(-max(-(-len(keys) // most), 1) // jobs) * jobs, len(keys))
        ends = [len(keys) * i // count for i in range(count + 1)]
        found += [(keys[a:b], number) for a, b in pairwise(ends)][::-1]
    return found


def _key(camera: Camera) -> str:
    """Return what tells cameras apart; effects of different kinds are in no order."""
    ordered = sorted(camera.effect, key=lambda effect: effect.kind)
    return camera.model_copy(update={"effect": tuple(ordered)}).model_dump_json()
