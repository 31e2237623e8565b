"""Who gets what: effects dealt over cases, evenly over the vocabulary."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from second.vocabulary import LISTED, UNLISTED, clash

TRIES = 1000


@dataclass(frozen=True)
class Hand:
    """What one case hides: listed effects, one on no list, and what camera.toml gets."""

    number: int
    listed: tuple[str, ...]
    unlisted: str | None
    wrong_number: bool
    known: bool


def deal(seed: int, count: int) -> list[Hand]:
    """Return a hand for each case.

    In 25 % nothing is hidden; 15 % have a wrong number in camera.toml, 15 % known effects there.
    """
    effects = _effects(seed, count)
    g = np.random.default_rng([seed, 4])
    some = round(0.15 * count)
    wrong = set(g.permutation(count)[:some].tolist())
    known = set(g.permutation(count)[:some].tolist())
    return [
        Hand(number, tuple(listed), unlisted, number in wrong, number in known)
        for number, (listed, unlisted) in enumerate(effects)
    ]


def deal_unlisted() -> list[Hand]:
    """Return a hand for each effect that is on no list: that alone."""
    return [Hand(number, (), kind, False, False) for number, kind in enumerate(UNLISTED)]


def _effects(seed: int, count: int) -> list[tuple[list[str], str | None]]:
    g = np.random.default_rng([seed, 1])
    nulls = round(0.25 * count)
    slots = _slots(seed, count, nulls)
    need = sum(slot["n"] for slot in slots)
    base = list(np.random.default_rng(11).permutation(len(LISTED)))
    if seed % 2 == 0:
        base.reverse()  # two seeds of unlike parity complete each other
    got: list[tuple[list[str], str | None]] = []
    for _ in range(TRIES):
        deck = [LISTED[base[k % len(base)]] for k in range(need)]
        deck = [deck[k] for k in g.permutation(need)]
        got, complete = _dealt(slots, deck)
        if complete:
            break
    got += [([], None)] * nulls
    return [got[k] for k in g.permutation(len(got))]


def _slots(seed: int, count: int, nulls: int) -> list[dict[str, Any]]:
    """Return how many listed effects each case has, and which one on no list."""
    twos, threes = round(0.25 * count), round(0.10 * count)
    ones = count - nulls - twos - threes
    outside = round(0.125 * count)
    alone = outside // 2
    slots: list[dict[str, Any]] = [{"n": 1} for _ in range(ones)]
    slots += [{"n": 2} for _ in range(twos)] + [{"n": 3} for _ in range(threes)]
    order = np.random.default_rng(7).permutation(len(UNLISTED))
    for k in range(outside):
        kind = UNLISTED[order[(outside * (seed % 3) + k) % len(order)]]
        if k < alone:
            slots[k].update(n=0, u=kind)
        else:
            slots[[ones - 1, ones - 2, ones, ones + 1][(k - alone) % 4]]["u"] = kind
    return slots


def _dealt(
    slots: list[dict[str, Any]], deck: list[str]
) -> tuple[list[tuple[list[str], str | None]], bool]:
    """Fill the fullest slots first; say whether every card found a place."""
    got, complete = [], True
    for slot in sorted(slots, key=lambda s: -s["n"]):
        mine: list[str] = []
        outside = [slot["u"]] if slot.get("u") else []
        for _ in range(slot["n"]):
            fits = [j for j, kind in enumerate(deck) if not clash([*mine, kind, *outside])]
            if fits:
                mine.append(deck.pop(fits[0]))
            else:
                complete = False
        got.append((mine, slot.get("u")))
    return got, complete
