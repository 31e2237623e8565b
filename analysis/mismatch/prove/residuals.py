"""Residuals of a virtual sensor: its fresh frames less what its training frames tell."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.mismatch.prove.cells import converted
from analysis.mismatch.prove.held import Held
from analysis.mismatch.prove.law import Law, Sensed, pixel_variance, sense
from analysis.mismatch.prove.sites import means_of_most, spread_over
from analysis.mismatch.prove.teeth import blurred
from analysis.mismatch.prove.virtual import Stack, sensor_draw
from dsis.effects import Image


@dataclass(frozen=True)
class Residuals:
    """A virtual sensor as its law sees it.

    Attributes
    ----------
    law
        The law, as far as it is known.
    sensed
        What the training frames tell.
    residuals
        Fresh frames less their own mean and the pattern, by exposure: float32 (frame, row, column).
    """

    law: Law
    sensed: Sensed
    residuals: Mapping[str, Image]

    def standardised(self, name: str, held: Held) -> Image:
        """Return residuals in units of their predicted standard deviation."""
        if name not in self._sds:
            pattern, groups = self.sensed.patterns[name], self.sensed.groups
            variance = pixel_variance(self.law, name, pattern, groups, held)
            self._sds[name] = np.sqrt(variance).astype(np.float32)
        return np.asarray(self.residuals[name] / self._sds[name], np.float32)

    @cached_property
    def _sds(self) -> dict[str, Image]:
        """Predicted standard deviations that were asked for, by exposure."""
        return {}


def residuals_of(
    law: Law, held: Held, stacks: Mapping[str, Stack], seed: int, teeth: Mapping[str, Image]
) -> Residuals:
    """Return a virtual sensor with what its training frames tell under a law.

    `teeth` of single electrons are blurred, see `blurred`.
    """
    maps, variances = {}, {}
    for e in held.exposures:
        training = stacks[e.name].training
        zeros = np.zeros(held.shape)
        maps[e.name] = training.mean(0, dtype=np.float64) if e.trained else zeros
        variances[e.name] = zeros
        if e.trained > 1:
            sensor = sensor_draw(seed)
            codes = [converted(law.camera, frame, held.grid, sensor) for frame in training]
            variances[e.name] = np.var(np.stack(codes), axis=0, ddof=1, dtype=np.float64)
    sensed = sense(law, held, maps, variances)
    residuals = {}
    for e in held.exposures:
        fresh = stacks[e.name].fresh
        left = fresh - sensed.patterns[e.name].astype(np.float32)
        most = means_of_most(left, held.cfa, law.cells.step_dn)
        means = spread_over(most, held.shape, held.cfa)
        residuals[e.name] = blurred((left - means).astype(np.float32), teeth, e.name, seed)
    return Residuals(law, sensed, residuals)
