"""Images whose rows, columns or pixels are scaled or shifted: in one pass."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

Image = NDArray[np.float32]
Line = NDArray[np.float32]


def moved(image: Image, offsets: Line) -> Image:
    """Return an image plus the offset of each line: (row, 1) or (1, column), DN."""
    if image.ndim > 2:
        return image + offsets.reshape(*offsets.shape[:2], *(1,) * (image.ndim - 2))
    flat = offsets.reshape(-1)
    by_row = _of_rows(offsets, image)
    return _by_row(image, None, flat) if by_row else _by_column(image, None, flat)


def settled(image: Image, gains: Line, offsets: Line) -> Image:
    """Return an image times the gain of each line, plus its offset: (row, 1) or (1, column)."""
    if image.ndim > 2:
        return image * gains + offsets
    flat = gains.reshape(-1), offsets.reshape(-1)
    return _by_row(image, *flat) if _of_rows(gains, image) else _by_column(image, *flat)


def lit(image: Image, down: Line, across: Line) -> Image:
    """Return an image times the sum of two lines of light, (row, 1) and (1, column)."""
    if image.ndim > 2:
        return image * (down + across)
    return _lit(image, down.reshape(-1), across.reshape(-1))


def shifted(image: Image, pattern: Image, size: np.float32) -> Image:
    """Return an image plus a pattern of its shape times a size."""
    return _shifted(*_in_line(image, pattern), size).reshape(image.shape)


def gained(image: Image, pattern: Image, size: np.float32) -> Image:
    """Return an image times one plus a pattern of its shape times a size."""
    return _gained(*_in_line(image, pattern), size).reshape(image.shape)


def _in_line(image: Image, pattern: Image) -> tuple[Image, Image]:
    if image.shape != pattern.shape:
        message = f"the pattern is {pattern.shape}, must be as the image, {image.shape}"
        raise ValueError(message)
    return np.ascontiguousarray(image).reshape(-1), np.ascontiguousarray(pattern).reshape(-1)


def _of_rows(lines: Line, image: Image) -> bool:
    """Return whether lines (row, 1) or (1, column) are an image's rows."""
    return bool(lines.shape == (image.shape[0], 1))


@kernel
def _by_row(image: Image, gains: Line | None, offsets: Line) -> Image:
    out = np.empty(image.shape, np.float32)
    for y in range(image.shape[0]):
        line, into, offset = image[y], out[y], offsets[y]
        if gains is None:
            for x in range(into.size):
                into[x] = line[x] + offset
        else:
            gain = gains[y]
            for x in range(into.size):
                into[x] = line[x] * gain + offset
    return out


@kernel
def _by_column(image: Image, gains: Line | None, offsets: Line) -> Image:
    out = np.empty(image.shape, np.float32)
    for y in range(image.shape[0]):
        line, into = image[y], out[y]
        if gains is None:
            for x in range(into.size):
                into[x] = line[x] + offsets[x]
        else:
            for x in range(into.size):
                into[x] = line[x] * gains[x] + offsets[x]
    return out


@kernel
def _lit(image: Image, down: Line, across: Line) -> Image:
    out = np.empty(image.shape, np.float32)
    for y in range(image.shape[0]):
        line, into, own = image[y], out[y], down[y]
        for x in range(into.size):
            into[x] = line[x] * (own + across[x])
    return out


@kernel
def _shifted(image: Image, pattern: Image, size: np.float32) -> Image:
    out = np.empty(image.shape, np.float32)
    for i in range(out.size):
        out[i] = image[i] + size * pattern[i]
    return out


@kernel
def _gained(image: Image, pattern: Image, size: np.float32) -> Image:
    out = np.empty(image.shape, np.float32)
    one = np.float32(1)
    for i in range(out.size):
        out[i] = image[i] * (size * pattern[i] + one)
    return out
