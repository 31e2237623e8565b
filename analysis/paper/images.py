"""The images of Table 1 and Fig. 3: Kodak's where they are, else frames of City."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.paper.scene import FRAMES, scene
from analysis.paper.setting import KODAK_IMAGES, Setting
from dsis.errors import InputError
from dsis.imagefile import read

FEWEST_PX = 16  # of an image, that demosaicking and distances of two pixels leave an inside


def image_count(setting: Setting) -> int:
    """Return how many images there are."""
    return len(setting.kodak) or FRAMES


def image(setting: Setting, index: int) -> NDArray[np.float32]:
    """Return one image, code values 0..255, float32 (row, column, 3)."""
    if setting.kodak:
        path = setting.kodak[index]
        found = read(path)
        if min(found.shape[:2]) < FEWEST_PX:
            fact = f"is {found.shape[1]} x {found.shape[0]}, must be at least {FEWEST_PX} each way"
            raise InputError.of(path, "", fact)
        return found * np.float32(255)
    city = scene("city", setting, FRAMES)
    return city.rendering.reference(city.clean(index)) * np.float32(255)


def remarks(setting: Setting) -> Iterator[str]:
    """Yield what a reader must know of the images."""
    count = len(setting.kodak)
    if count == 0:
        yield (
            "The Kodak images are not at hand (give --kodak FOLDER): frames of the sequence City "
            "stand in. Bilinear noise does not depend on the picture, that of the other two does."
        )
    elif count != KODAK_IMAGES:
        yield f"The folder holds {count} images; the Kodak set has {KODAK_IMAGES}."
