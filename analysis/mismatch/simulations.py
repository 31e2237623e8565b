"""Numbers of simulated recordings, by camera: each recording is simulated once."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.model import Model, each, simulate, simulated
from analysis.mismatch.observe import Observation
from analysis.mismatch.relit import relit
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
        Gives the bank's numbers of an observation.
    seed, jobs
        Of the simulations.
    kept
        Numbers by camera, in the order of the replicates. Those that need sums which the effects in
        which it differs from the model's cannot change are unknown.
    """

    layout: Layout
    model: Model
    numbers_of: Callable[[Observation], Array]
    seed: int
    jobs: int
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
        if self.jobs < 2 or len(missing) < 2:
            return

        work = [(self._model(own := wanted[key]), i, self._made(own)) for key, i in missing]
        made = each(partial(simulated, self.layout, self.seed), work, self.jobs)
        ahead: dict[str, list[Array]] = {}
        for (key, _), seen in zip(missing, made, strict=True):
            ahead.setdefault(key, []).append(self.numbers_of(seen))
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
            made = self._made(camera)
            some = simulate(*which) if made == ALL_SUMS else simulate(*which, made=made)
            known = [*known, *(self.numbers_of(one) for one in some)]
            self.kept[key] = known
        return np.stack(known[:replicates])

    def _model(self, camera: Camera) -> Model:
        return relit(self.model, camera, self.layout)

    def _made(self, camera: Camera) -> frozenset[str]:
        """Return the sums that a camera's numbers need: all, unless it differs by few effects."""
        own = self.model.camera
        effects = differing(camera, own)
        alike = camera.model_copy(update={"effect": own.effect}) == own
        return sums_for(effects) if effects and alike else ALL_SUMS


def _key(camera: Camera) -> str:
    """Return what tells cameras apart; effects of different kinds are in no order."""
    ordered = sorted(camera.effect, key=lambda effect: effect.kind)
    return camera.model_copy(update={"effect": tuple(ordered)}).model_dump_json()
