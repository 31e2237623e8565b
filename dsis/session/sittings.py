"""Viewing sessions: how the test of an observer is cut so that none lasts too long.

BT.500 asks for sessions of up to half an hour, with presentations at the start of each whose votes
do not count ("dummies"): about five in the first and about three in each later one (quoted from
memory; `docs/session.md`). Here the spec's number opens the first session, and at most
`LATER_DUMMIES` each later one.
"""

from collections.abc import Sequence
from typing import Protocol, TypeVar

from dsis.errors import InputError
from dsis.manifest import MANIFEST
from dsis.session.steps import presentation_s
from dsis.spec import Session

LATER_DUMMIES = 3
T = TypeVar("T")


class _Placed(Protocol):
    @property
    def session(self) -> int: ...


def dummies_in(number: int, session: Session) -> int:
    """Return how many dummies open viewing session `number`, from 1."""
    return session.dummies if number == 1 else min(session.dummies, LATER_DUMMIES)


def sittings(order: Sequence[T], training: int, session: Session) -> list[list[T]]:
    """Cut `order` into as few viewing sessions as there must be, of lengths as equal as can be.

    Parameters
    ----------
    order
        Scored presentations in order.
    training
        Training presentations before the first session's dummies.
    session
        Durations, dummies and `session_minutes_max`.

    Raises
    ------
    InputError
        `session_minutes_max` has no room for a scored presentation.
    """
    room = _room(session)

    def lead(number: int) -> int:
        return dummies_in(number, session) + (training if number == 1 else 0)

    least = max(lead(1), lead(2)) + 1
    if room < least:
        fact = (
            f"is {session.session_minutes_max:g}, must be at least "
            f"{least * presentation_s(session) / 60:.3g}: training, dummies and one presentation"
        )
        raise InputError.of(MANIFEST, "session.session_minutes_max", fact)
    count = 1
    while sum(room - lead(number) for number in range(1, count + 1)) < len(order):
        count += 1
    parts, first = [], 0
    for number in range(1, count + 1):
        later = range(number + 1, count + 1)
        left = len(order) - first
        even = round((left + sum(map(lead, range(number, count + 1)))) / (len(later) + 1))
        must = left - sum(room - lead(other) for other in later)
        size = min(max(even - lead(number), must, 1), room - lead(number), left)
        parts.append(list(order[first : first + size]))
        first += size
    return parts


def begins_another(plan: Sequence[_Placed], more: int, session: Session) -> bool:
    """Tell whether `more` presentations at the end of `plan` exceed its last viewing session."""
    held = sum(p.session == plan[-1].session for p in plan)
    return held + more > _room(session)


def _room(session: Session) -> int:
    """Return how many presentations a viewing session has time for."""
    # A sum of decimal fractions may exceed a limit that it equals.
    return int(60 * session.session_minutes_max / presentation_s(session) + 1e-9)
