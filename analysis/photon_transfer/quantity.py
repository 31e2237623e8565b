"""A measured quantity as tables and JSON show it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One figure of merit.

    Attributes
    ----------
    name, unit
        The field's name, and its unit.
    value, standard_error
        None where the recording does not tell.
    means
        How it is defined, in one line.
    """

    name: str
    unit: str
    value: float | None
    standard_error: float | None
    means: str
