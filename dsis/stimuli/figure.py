"""The paper's Fig. 5: crops of noisy frames over their scaled differences from the reference."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis.imagefile import write_codes
from dsis.stimuli.quality import delivered

Frame = NDArray[np.float32]

CROP_PX = 128
ENLARGEMENT = 3
GAP_PX = 6
GAIN, OFFSET = 4, 128


def fig5(frames: dict[str, Frame]) -> NDArray[np.uint8]:
    """Return the picture of one kind of noise: uint8 (row, column, 3).

    Parameters
    ----------
    frames
        `reference` and one display frame per demosaicking method. Upper row: crops from the middle
        of the frame, that of `none` first; lower row: difference x 4 + 128.
    """
    reference = _crop(delivered(frames["reference"]))
    columns = []
    for name, frame in sorted(frames.items(), key=lambda item: item[0] != "none"):
        if name != "reference":
            noisy = _crop(delivered(frame))
            difference = noisy.astype(np.int32) - reference
            scaled = np.clip(difference * GAIN + OFFSET, 0, 255).astype(np.uint8)
            columns.append(_stack([_enlarged(noisy), _enlarged(scaled)], axis=0))
    return _stack(columns, axis=1)


def write_figures(frames: dict[tuple[str, int], dict[str, Frame]], folder: Path, name: str) -> None:
    """Write `fig5__NAME__NOISE__LEVEL.png` for every kind of noise and level."""
    for (noise, level), row in frames.items():
        write_codes(folder / f"fig5__{name}__{noise}__{level}.png", fig5(row))


def _crop(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    rows, columns = (min(CROP_PX, n) for n in image.shape[:2])
    row, column = (image.shape[0] - rows) // 2, (image.shape[1] - columns) // 2
    return image[row : row + rows, column : column + columns]


def _enlarged(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return image.repeat(ENLARGEMENT, axis=0).repeat(ENLARGEMENT, axis=1)


def _stack(images: list[NDArray[np.uint8]], axis: int) -> NDArray[np.uint8]:
    """Put pictures side by side (axis 1) or one below the other, with a white gap between."""
    shape = list(images[0].shape)
    shape[axis] = GAP_PX
    gap = np.full(shape, 255, np.uint8)
    parts = [part for image in images for part in (gap, image)][1:]
    return np.concatenate(parts, axis=axis)
