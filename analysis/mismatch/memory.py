"""What a search remembers of effects that it tried: contributions of different physics add."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect

Array = NDArray[np.float64]
_ALIKE = 0.05  # relative difference of parameters up to which a proposal is an earlier one
_UNIT, _ONE_NOISE = "pixel_variance", 0.05  # relative change, from which units are others
_SHARED = 0.1  # share of an effect's change that may lie where the model moved since


@dataclass
class Memory:
    """What proposals changed beside earlier models: contributions of different physics add.

    Attributes
    ----------
    changes
        Effect, the numbers' means then, and its change of them.
    gains
        What each kind gained when it was tried last, by the words of its parameters: halves of a
        sensor say nothing of its even and odd rows.
    """

    changes: list[tuple[Effect, Array, Array]] = field(default_factory=list)
    gains: dict[str, dict[tuple[str, ...], float]] = field(default_factory=dict)

    def gained(self, kind: str, unknown: float) -> float:
        """Return what a kind gained at most; `unknown`: it was never tried."""
        return max(self.gains.get(kind, {}).values(), default=unknown)

    def gains_at_least(self, kind: str, effect: Effect, gain: float) -> None:
        """Take what whole frames gain by an effect, where numbers gain less."""
        of_words = self.gains.setdefault(kind, {})
        of_words[words(effect)] = max(of_words.get(words(effect), gain), gain)

    def recalled(self, effect: Effect, state: State) -> Array | None:
        """Return the numbers with an effect added, as remembered; None: it must be simulated."""
        null = state.null
        for known, means, change in self.changes:
            if not _near(known, effect, state.camera):
                continue
            size = np.where(null.known, np.abs(change) / null.sd, 0.0)
            moved = np.where(null.known, np.abs(null.mean - means) / null.sd, 0.0) > 1.0
            if size[moved].sum() <= _SHARED * size.sum() and _of_one_noise(state, means):
                return null.mean + change
        return None

    def keep(self, effect: Effect, state: State, mean: Array) -> None:
        """Remember what an effect changed."""
        means = state.null.mean
        self.changes.append((effect, means, np.nan_to_num(mean - means)))


def _of_one_noise(state: State, means: Array) -> bool:
    """Return whether pixels are as noisy as they were: most numbers are in units of that."""
    own = [i for i, key in enumerate(state.vector.keys) if key.statistic == _UNIT]
    apart = np.abs(state.null.mean[own] - means[own])
    return not bool((apart > _ONE_NOISE).any())


def words(effect: Effect) -> tuple[str, ...]:
    """Return those of an effect's parameters that are words: an edge, the regions of amplifiers."""
    values = effect.model_dump(exclude={"kind"}).values()
    return tuple(value for value in values if isinstance(value, str))


def _near(one: Effect, other: Effect, camera: Camera) -> bool:
    """Return whether two effects have the same words, and numbers that are nearly the same.

    A full well matters by its distance from a level in standard deviations of the noise there.
    """
    if type(one) is not type(other):
        return False
    a, b = dict(one), dict(other)  # all fields: some are written only where they say something
    for name, value in a.items():
        if not (isinstance(value, float) and isinstance(b[name], float)):
            if value != b[name]:
                return False
            continue
        size = abs(value)
        if name == "full_well_dn":
            size = float(camera.segments.variance_dn2(np.array([value], np.float32))[0]) ** 0.5
        if abs(value - b[name]) > _ALIKE * size:
            return False
    return True
