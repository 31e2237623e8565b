"""Sixteen pixels of a row, demosaicked bilinearly in LLVM's vector instructions.

A compiler that vectorises the loop by itself neither prefetches nor writes past the cache, and
takes half as long again. The instructions are LLVM's own and suit any processor; one without
vectors of this length gets several shorter ones.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir

from dsis.compiled import emitted

PIXELS = 16
ALIGNMENT = 4 * PIXELS  # bytes, of where `stream` writes: a line of the cache
_AHEAD = 1024  # samples between what is read and what is fetched: far enough for memory to answer
_FLOAT, _INT = ir.FloatType(), ir.IntType(32)
_VECTOR = ir.VectorType(_FLOAT, PIXELS)


def _block(*, past_the_cache: bool) -> Callable[..., None]:
    """Return what writes pixels x..x+15 of a row, 1 <= x <= columns - 17, to its line of a result.

    Its arguments: `above`, `here` and `below`, rows of the mosaic; `x`, unsigned; `line`, a row of
    the result, flat; `blue`, whether the row's own colour is blue; `odd`, whether x is a green
    site.
    """

    def emit(
        b: ir.IRBuilder,
        above: ir.Value,
        here: ir.Value,
        below: ir.Value,
        x: ir.Value,
        line: ir.Value,
        blue: ir.Value,
        odd: ir.Value,
    ) -> None:
        if past_the_cache:
            _fetch(b, _at(b, below, x, _AHEAD))
        colours = _pixels(b, above, here, below, x, blue, odd)
        _write(b, colours, line, x, past_the_cache=past_the_cache)

    return emitted(emit)


store = _block(past_the_cache=False)
# An ordinary store reads the line of the cache that it changes: 28 bytes a pixel, not 16. Pixel x
# of the line must be aligned to `ALIGNMENT`.
stream = _block(past_the_cache=True)


@emitted
def fence(b: ir.IRBuilder) -> None:
    """Let other threads see what `stream` wrote before anything that is written from here on."""
    b.fence("seq_cst")


def _pixels(
    b: ir.IRBuilder,
    above: ir.Value,
    here: ir.Value,
    below: ir.Value,
    x: ir.Value,
    blue: ir.Value,
    odd: ir.Value,
) -> list[ir.Value]:
    """Return vectors of red, green and blue."""
    (north_west, north, north_east), (west, centre, east), (south_west, south, south_east) = (
        [b.load(_at(b, row, x, offset), align=4, typ=_VECTOR) for offset in (-1, 0, 1)]
        for row in (above, here, below)
    )
    beside, upright = b.fadd(west, east), b.fadd(north, south)
    diagonal = b.fadd(b.fadd(north_west, south_east), b.fadd(north_east, south_west))
    # A bit for each pixel: whether it holds the row's own colour.
    bits = ir.IntType(PIXELS)
    even = b.select(odd, bits(0xAAAA), bits(0x5555))
    sampled = b.bitcast(even, ir.VectorType(ir.IntType(1), PIXELS))
    half, quarter = ([_FLOAT(part)] * PIXELS for part in (0.5, 0.25))
    own = b.select(sampled, centre, b.fmul(_VECTOR(half), beside))
    green = b.select(sampled, b.fmul(_VECTOR(quarter), b.fadd(beside, upright)), centre)
    other = b.select(sampled, b.fmul(_VECTOR(quarter), diagonal), b.fmul(_VECTOR(half), upright))
    return [b.select(blue, other, own), green, b.select(blue, own, other)]


def _write(
    b: ir.IRBuilder,
    colours: list[ir.Value],
    line: ir.Value,
    x: ir.Value,
    *,
    past_the_cache: bool,
) -> None:
    """Write red, green and blue in turn, 48 samples from 3 x on."""
    red, green, blue = colours
    start = b.mul(x, x.type(3))
    for first in range(0, 3 * PIXELS, PIXELS):
        places = [divmod(sample, 3) for sample in range(first, first + PIXELS)]
        two = [pixel + PIXELS * (colour == 1) for pixel, colour in places]
        mixed = b.shuffle_vector(red, green, _places(two))
        three = [PIXELS + pixel if colour == 2 else n for n, (pixel, colour) in enumerate(places)]
        samples = b.shuffle_vector(mixed, blue, _places(three))
        where = _at(b, line, start, first)
        if past_the_cache:
            stored = b.store(samples, where, align=ALIGNMENT)
            stored.set_metadata("nontemporal", b.module.add_metadata([_INT(1)]))
        else:
            b.store(samples, where, align=4)


def _places(indices: list[int]) -> ir.Constant:
    return ir.VectorType(_INT, PIXELS)([_INT(index) for index in indices])


def _at(b: ir.IRBuilder, array: ir.Value, place: ir.Value, offset: int) -> Any:
    """Return the address of a vector that begins at an element of an array."""
    element = b.gep(array, [b.add(place, place.type(offset))])
    return b.bitcast(element, _VECTOR.as_pointer())


def _fetch(b: ir.IRBuilder, address: ir.Value) -> None:
    """Ask for what will be read soon; an address beyond the array does no harm."""
    byte = b.bitcast(address, ir.IntType(8).as_pointer())
    kind = ir.FunctionType(ir.VoidType(), [byte.type, _INT, _INT, _INT])
    fetch = b.module.globals.get("llvm.prefetch.p0")
    if fetch is None:
        fetch = ir.Function(b.module, kind, "llvm.prefetch.p0")
    b.call(fetch, [byte, _INT(0), _INT(3), _INT(1)])  # to read, into all caches, data
