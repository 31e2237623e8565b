"""The whole paper on small frames, and two small pictures in the place of Kodak's."""

import csv
from dataclasses import dataclass

import numpy as np

from analysis.paper import Setting
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.imagefile import write_codes


@dataclass(frozen=True)
class Small(Setting):
    """Frames of 96 x 64."""

    @property
    def size(self):
        return (96, 64)


@dataclass(frozen=True)
class Two(Small):
    """Two frames of 96 x 64 in Table 2."""

    @property
    def denoised_frames(self):
        return 2


def write_pictures(folder):
    """Write two pictures into a folder, and return their paths."""
    files = tuple(folder / f"kodim{frame:02d}.png" for frame in range(2))
    for frame, file in enumerate(files):
        field = Draw(frame).uniform("picture", PixelGrid(48, 64))
        write_codes(file, (60 + 130 * field).astype(np.uint8))
    return files


def read(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))
