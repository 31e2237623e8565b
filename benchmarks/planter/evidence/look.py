"""A recording in memory, and what several statistics need of it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planter.case import Case
from planter.chain import stack


@dataclass(frozen=True)
class Evidence:
    """Independent pieces of evidence for one effect.

    Attributes
    ----------
    values
        One number per exposure, channel, lag ...
    nuisance
        (values, n): what a re-fit of the base model can do to them; nothing of that counts.
    """

    values: np.ndarray
    nuisance: np.ndarray | None = None


class Look:
    """The frames of a case, as numbers (frame, row, column), made when asked for."""

    def __init__(self, case: Case) -> None:
        self.case = case

    @cached_property
    def stacks(self) -> list[np.ndarray]:
        """Codes of every exposure, float32."""
        return [stack(self.case, e).astype(np.float32) for e in range(len(self.case.exposures))]

    @cached_property
    def means(self) -> list[np.ndarray]:
        """Mean over frames of every exposure (row, column)."""
        return [frames.mean(0) for frames in self.stacks]

    @cached_property
    def residuals(self) -> list[np.ndarray]:
        """Frames less their mean."""
        return [f - m for f, m in zip(self.stacks, self.means, strict=True)]

    def exposures(self, *kinds: str) -> list[int]:
        """Return the numbers of the exposures of some kinds."""
        plans = enumerate(self.case.exposures)
        return [i for i, plan in plans if plan.kind in (kinds or ("dark", "flat"))]

    def by_channel(self, value: Callable[[int, tuple[slice, slice]], float]) -> np.ndarray:
        """Return a value of every exposure (without scenes) and channel, exposures first."""
        planes = self.case.channels().values()
        return np.array([value(e, place) for e in self.exposures() for place in planes])

    def signals(self) -> np.ndarray:
        """Return the planned signal of every exposure and channel, as `by_channel` orders them."""
        response = self.case.response_map()
        return self.by_channel(
            lambda e, place: self.case.exposures[e].signal_dn * float(response[place][0, 0])
        )

    def variance(self, exposure: int, place: tuple[slice, slice]) -> float:
        """Return the mean temporal variance of a channel's pixels, DN^2."""
        residual = self.residuals[exposure][:, place[0], place[1]]
        frames = residual.shape[0]
        return float(np.mean(np.square(residual), dtype=float) * frames / (frames - 1))
