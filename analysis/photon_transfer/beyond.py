"""Physics beyond the affine model that photon transfer measures anyway, as effects of a camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.quantity import Quantity
from dsis.effects import Effect, registry

LEAST_Z = 3.0  # standard errors from which a variance or a growth is taken for real


@dataclass(frozen=True)
class FittedEffect:
    """One effect of one parameter, in the unit that the parameter's name says.

    Attributes
    ----------
    kind, parameter
        Names of the vocabulary of physics.
    value, standard_error
        Over all channels; the error is 0 where the value is a count.
    """

    kind: str
    parameter: str
    value: float
    standard_error: float

    @property
    def effect(self) -> Effect:
        """The link of a camera's chain."""
        return registry()[self.kind].model_validate({self.parameter: self.value})


def effects_of(
    darks: Mapping[str, DarkLine | None], figures: Sequence[Sequence[Quantity]], step_dn: int
) -> tuple[FittedEffect, ...]:
    """Return dark current, DSNU, PRNU and coarse codes as far as they are certain.

    Parameters
    ----------
    darks
        The dark line of each channel; dark currents are pooled by their errors.
    figures
        EMVA 1288's figures of each channel; non-uniformities are pooled as mean squares.
    step_dn
        Greatest common step of the codes, DN.
    """
    found = [
        _dark_current(darks),
        _pattern("dsnu", "sigma_dn", ("DSNU1288", "DN"), figures),
        _pattern("prnu", "sigma_percent", ("PRNU1288", "%"), figures),
        FittedEffect("quantisation", "step_dn", float(step_dn), 0.0) if step_dn > 1 else None,
    ]
    return tuple(effect for effect in found if effect is not None)


def _dark_current(darks: Mapping[str, DarkLine | None]) -> FittedEffect | None:
    known = [
        (dark.current_dn_per_s, dark.current_se_dn_per_s)
        for dark in darks.values()
        if dark is not None and dark.current_dn_per_s is not None and dark.current_se_dn_per_s
    ]
    if not known:
        return None
    value, error = np.array(known, float).T
    weight = 1 / error**2
    mean, mean_se = float((weight * value).sum() / weight.sum()), float(weight.sum() ** -0.5)
    if mean < LEAST_Z * mean_se:
        return None
    return FittedEffect("dark_current", "dn_per_s", mean, mean_se)


def _pattern(
    kind: str, parameter: str, figure: tuple[str, str], figures: Sequence[Sequence[Quantity]]
) -> FittedEffect | None:
    found = [q for channel in figures for q in channel if (q.name, q.unit) == figure]
    known = [(q.value, q.standard_error) for q in found if q.value and q.standard_error]
    if not known:
        return None
    value, error = np.array(known, float).T
    # A channel without a value has a variance that noise explains: it counts as 0.
    square = float((value**2).sum()) / len(found)
    square_se = float(np.sqrt(((2 * value * error) ** 2).sum())) / len(found)
    if square < LEAST_Z * square_se:
        return None
    root = float(np.sqrt(square))
    return FittedEffect(kind, parameter, root, square_se / (2 * root))
