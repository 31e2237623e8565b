"""The vocabulary of physics: every file of this folder holds the effects of one mechanism.

A new file is found by itself: its effects load from TOML, are simulated, pass the contract test of
the registry and are documented. Effects never import one another.
"""

import inspect
from functools import cache, reduce
from importlib import import_module
from operator import or_
from pkgutil import iter_modules
from typing import Annotated, Any

from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, ReadOut, Stage
from dsis.model import Elsewhere

__all__ = [
    "Effect",
    "Exposure",
    "Image",
    "OperatingPoint",
    "ReadOut",
    "Stage",
    "any_effect",
    "registry",
]


_OF_THE_BASE_MODEL = {"dual_gain": "is no effect: write a second [[noise.segment]]"}


@cache
def registry() -> dict[str, type[Effect]]:
    """Return every effect by its kind, in alphabetical order."""
    found: dict[str, type[Effect]] = {}
    for module in iter_modules(__path__):
        for value in vars(import_module(f"{__name__}.{module.name}")).values():
            if (
                inspect.isclass(value)
                and issubclass(value, Effect)
                and not inspect.isabstract(value)
            ):
                kind = value.model_fields["kind"].default
                if found.setdefault(kind, value) is not value:
                    message = f"two effects of kind {kind}: {found[kind]} and {value}"
                    raise TypeError(message)
    return dict(sorted(found.items()))


def any_effect() -> Any:
    """Return the type of a value that is one of the effects, told apart by `kind`."""
    kinds = reduce(or_, registry().values())
    return Annotated[kinds, Field(discriminator="kind"), Elsewhere(_OF_THE_BASE_MODEL)]
