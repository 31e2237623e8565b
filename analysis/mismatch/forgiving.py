"""Which dropped effects may be tried once more: something else was wrong, or missing, then."""

from collections.abc import Mapping, Sequence

from analysis.mismatch.judge import INSTEAD, LITTLE
from analysis.mismatch.named import Named


def to_forgive(
    refused: Mapping[str, str], dropped: Sequence[Named], named: Sequence[Named]
) -> list[Named]:
    """Return the effects that explained too little of what they change, or went for another.

    That other went as well. What was dropped last was judged beside nothing that is wrong: where
    others were dropped before it, these are tried first, alone.

    Parameters
    ----------
    refused
        Names and reasons, in the order in which they were dropped.
    dropped
        Effects that were dropped.
    named
        What stays.
    """
    order = list(refused)
    found = [one for one in dropped if _worth(refused.get(one.name, ""), named)]
    found.sort(key=lambda one: order.index(one.name))
    return found[:-1] if len(found) > 1 and order[-1] == found[-1].name else found


def _worth(why: str, named: Sequence[Named]) -> bool:
    stays = any(why == f"{INSTEAD} {other.name} explains better" for other in named)
    return why.startswith(LITTLE) or (why.startswith(INSTEAD) and not stays)
