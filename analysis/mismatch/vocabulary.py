"""The effects that a diagnosis may name."""

import difflib
from collections.abc import Iterable

from dsis.effects import registry
from dsis.errors import Fault, InputError

DUAL_GAIN = "dual_gain"
"""No effect of the chain: a second read-out segment of the camera model."""


def vocabulary() -> frozenset[str]:
    """Return the names of all effects that can be found."""
    return frozenset(registry()) | {DUAL_GAIN}


def vocabulary_without(names: Iterable[str]) -> frozenset[str]:
    """Return the vocabulary less some names; raise `InputError` for those it does not hold."""
    known, left_out = vocabulary(), tuple(dict.fromkeys(names))
    faults = []
    for name in left_out:
        if name not in known:
            near = difflib.get_close_matches(name, sorted(known), 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            fact = f"is {name!r}{hint}, must be one of: {', '.join(sorted(known))}"
            faults.append(Fault("--without", "", fact))
    if faults:
        raise InputError(faults)
    return known - set(left_out)
