"""Random orders in which no two neighbours are alike, all such orders equally likely.

A word (an order of contents) is built content by content: the n items of the next content are cut
into k blocks, and each block is pushed into a gap of the word so far. A block in a gap between two
alike neighbours parts them; a block of m items makes m - 1 new alike neighbours. So the number of
ways to end with a given number of alike neighbours follows from that number alone, by dynamic
programming in exact integers, and one pass through the contents draws a word with exactly equal
chances: it ends after as many steps as there are contents, whatever the generator gives.
"""

from collections.abc import Iterator, Mapping
from math import comb

import numpy as np


def unavoidable(counts: Mapping[str, int], previous: str | None = None) -> int:
    """Return the least number of alike neighbours in any order of `counts` items after `previous`.

    Of n items, n_c of content c need n_c - 1 others between them; after a `previous` of the same
    content, n_c others.
    """
    n = sum(counts.values())
    return max(0, *(2 * m - n - (content != previous) for content, m in counts.items()), 0)


def arrange(
    counts: Mapping[str, int], rng: np.random.Generator, previous: str | None = None
) -> list[str]:
    """Return one of the orders with the least number of alike neighbours, all equally likely.

    Parameters
    ----------
    counts
        How many items of each content.
    rng
        Source of randomness.
    previous
        The content shown just before, to which the first item is a neighbour too.
    """
    contents = sorted(c for c, m in counts.items() if m and c != previous)
    sizes = [counts[content] for content in contents]
    word = [previous] * (1 + (counts.get(previous, 0) if previous is not None else 0))
    ways = _ways(sizes, len(word), unavoidable(counts, previous))
    for place, (content, size) in enumerate(zip(contents, sizes, strict=True)):
        alike = [i for i in range(1, len(word)) if word[i - 1] == word[i]]
        blocks, parted = _drawn(size, len(word), len(alike), ways[place + 1], rng)
        differing = sorted(set(range(1, len(word) + 1)) - set(alike))
        gaps = _some(alike, parted, rng) + _some(differing, blocks - parted, rng)
        cuts = sorted(_some(list(range(1, size)), blocks - 1, rng))
        lengths = np.diff([0, *cuts, size]).tolist()
        for gap, length in sorted(zip(gaps, lengths, strict=True), reverse=True):
            word[gap:gap] = [content] * length
    return [content for content in word[1:] if content is not None]


def _moves(size: int, length: int, alike: int) -> Iterator[tuple[int, int, int, int]]:
    """Yield (blocks, alike neighbours parted, alike neighbours then, ways) of one insertion.

    A word of `length` items has as many gaps: one after each.
    """
    for blocks in range(1, size + 1):
        for parted in range(min(blocks, alike) + 1):
            ways = (
                comb(size - 1, blocks - 1)
                * comb(alike, parted)
                * comb(length - alike, blocks - parted)
            )
            if ways:
                yield blocks, parted, alike - parted + size - blocks, ways


def _ways(sizes: list[int], length: int, wanted: int) -> list[dict[int, int]]:
    """Return, before each insertion and after the last, {alike neighbours: ways to `wanted`}."""
    table: list[dict[int, int]] = [{wanted: 1}]
    rest = 0
    for place in reversed(range(len(sizes))):
        rest += sizes[place]
        most = sum(size - 1 for size in sizes[:place]) + length - 1
        long = length + sum(sizes[:place])
        found = {}
        for alike in range(min(most, wanted + rest) + 1):
            moves = _moves(sizes[place], long, alike)
            found[alike] = sum(ways * table[0].get(then, 0) for _, _, then, ways in moves)
        table.insert(0, found)
    return table


def _drawn(
    size: int, length: int, alike: int, ways_then: Mapping[int, int], rng: np.random.Generator
) -> tuple[int, int]:
    """Return (blocks, alike neighbours parted), drawn in proportion to the words they lead to."""
    moves = [
        (blocks, parted, ways * ways_then.get(then, 0))
        for blocks, parted, then, ways in _moves(size, length, alike)
    ]
    ticket = _below(sum(weight for _, _, weight in moves), rng)
    for blocks, parted, weight in moves:
        ticket -= weight
        if ticket < 0:
            return blocks, parted
    message = "no order has so few alike neighbours"
    raise AssertionError(message)


def _below(n: int, rng: np.random.Generator) -> int:
    """Return a whole number of 0..n-1, n of any size: 128 more bits than n make it uniform."""
    size = n.bit_length() // 8 + 17
    return int.from_bytes(rng.bytes(size), "little") % n


def _some(items: list[int], count: int, rng: np.random.Generator) -> list[int]:
    return [items[i] for i in rng.permutation(len(items))[:count]]
