"""Physics beyond the affine model that photon transfer measures anyway, as effects of a camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pydantic import ValidationError

from analysis.currentspread import CLEAR_GAIN, current_spread
from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.parts import P_SEEN, Component
from analysis.photon_transfer.patterns import FixedPatterns, Growth
from dsis.effects import Effect, registry
from dsis.errors import InputError

LEAST_Z = 3.0  # standard errors from which a growth is taken for real


@dataclass(frozen=True)
class FittedEffect:
    """One effect of one fitted parameter, in the unit that the parameter's name says.

    Attributes
    ----------
    kind, parameter
        Names of the vocabulary of physics.
    value, standard_error
        Over all channels; the error is 0 where the value is a count.
    beside
        Further parameters.
    beside_error
        The standard error of the last of them; 0 where they are counts.
    """

    kind: str
    parameter: str
    value: float
    standard_error: float
    beside: Mapping[str, float] = field(default_factory=dict)
    beside_error: float = 0.0

    @property
    def effect(self) -> Effect:
        """The link of a camera's chain; raises `InputError` where no sensor is like that."""
        try:
            return registry()[self.kind].model_validate({self.parameter: self.value, **self.beside})
        except ValidationError as error:
            fact = f"was measured as {self.value:.4g}: {error.errors()[0]['msg'].lower()}; are the "
            fact += "flats lit all over, and is cfa right?"
            raise InputError.of("the fitted model", f"{self.kind}.{self.parameter}", fact) from None


def effects_of(
    current: FittedEffect | None, patterns: FixedPatterns, step_dn: int, phase_dn: int = 0
) -> tuple[FittedEffect, ...]:
    """Return dark current, fixed patterns by their parts and coarse codes, as far as certain.

    Parameters
    ----------
    current
        The dark current, see `pooled_current`.
    patterns
        Of darks and of gains; the channels' variances are pooled.
    step_dn
        Greatest common step of the codes, DN.
    phase_dn
        The lowest code on it, DN.
    """
    dark, gain = list(patterns.dark.values()), list(patterns.gain.values())
    found = [
        current,
        _part("dsnu", "sigma_dn", [p.pixel for p in dark]),
        _part("row_fpn", "sigma_dn", [p.row for p in dark], shared=True),
        _part("column_fpn", "sigma_dn", [p.column for p in dark], shared=True),
        _part("prnu", "sigma_percent", [p.pixel for p in gain], scale=100.0),
        _shading(patterns.falloff),
        _coarse(step_dn, phase_dn) if step_dn > 1 else None,
    ]
    return tuple(effect for effect in found if effect is not None)


def _coarse(step_dn: int, phase_dn: int) -> FittedEffect:
    beside = {"phase_dn": phase_dn} if phase_dn else {}
    return FittedEffect("quantisation", "step_dn", float(step_dn), 0.0, beside)


def pooled_current(darks: Mapping[str, DarkLine | None]) -> FittedEffect | None:
    """Return the channels' dark current, pooled by their errors; None where it is not certain."""
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


def with_spread(current: FittedEffect | None, growth: Mapping[str, Growth]) -> FittedEffect | None:
    """Return the dark current with how far it differs between pixels, where they show that."""
    if current is None or not growth:
        return current
    maps = [
        (own.dn_per_s, own.noise, np.zeros(own.dn_per_s.shape, bool)) for own in growth.values()
    ]
    shot = float(np.mean([own.shot for own in growth.values()]))
    spread = current_spread(maps, current.value, current.standard_error, shot)
    if spread is None or spread.gain < CLEAR_GAIN:
        return current
    # This one sensor's mean is that of its pixels.
    relative = np.expm1(spread.log_sigma**2) / sum(own.dn_per_s.size for own in growth.values())
    return replace(
        current,
        standard_error=float(np.hypot(current.standard_error, current.value * relative**0.5)),
        beside={"log_sigma": spread.log_sigma},
        beside_error=spread.error,
    )


def _part(
    kind: str,
    parameter: str,
    channels: Sequence[Component],
    *,
    scale: float = 1.0,
    shared: bool = False,
) -> FittedEffect | None:
    """Return the pooled standard deviation; None where noise and finer parts explain it.

    `shared`: two channels each have the lines in common, so half of them count for the error.
    """
    if not channels or min(c.p for c in channels) * len(channels) > P_SEEN:
        return None
    variance = float(np.mean([c.variance for c in channels]))
    independent = len(channels) / 2 if shared and len(channels) > 1 else len(channels)
    mean_square = np.mean([c.standard_error**2 for c in channels])
    error = float(np.sqrt(mean_square / independent))
    if variance <= 0:
        return None
    # The root of an unbiased variance is too small by its variance / 8: few lines make it seen.
    relative = error / variance
    sd = float(np.sqrt(variance)) * (1 + relative**2 / 8)
    return FittedEffect(kind, parameter, scale * sd, scale * sd * relative / 2)


def _shading(falloff: tuple[float, float] | None) -> FittedEffect | None:
    if falloff is None:
        return None
    return FittedEffect("shading", "falloff_percent", 100 * falloff[0], 100 * falloff[1])
