"""City and Landscape: still panoramas in linear light, without grain, from a seed.

Linear light with Rec.709 primaries and white point D65; 1.0 is a white diffuse surface that faces
the sun. These are painted stand-ins for rendered scenes: perspective, shading and haze are right,
but only the landscape is lit by its own relief, and nothing casts a shadow on a roof.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from dsis.errors import Fault, InputError
from dsis.scenes import painted_city, painted_landscape

_PAINTERS = {"city": painted_city.paint, "landscape": painted_landscape.paint}
SCENES: Final = tuple(_PAINTERS)
FEWEST_ROWS = 32


def panorama(name: str, seed: int, rows: int, columns: int) -> NDArray[np.float32]:
    """Paint the strip over which a window pans.

    Objects scale with `rows`, so presets of different size look alike; a wider strip shows more of
    the same scene. The same arguments give the same bytes.

    Parameters
    ----------
    name
        "city" or "landscape".
    seed
        Not negative; another seed is another city.
    rows, columns
        Size in pixels; column 0 is the left end.

    Returns
    -------
    NDArray[np.float32]
        (row, column, 3), linear light, Rec.709 primaries, finite and not negative; a diffuse
        white is 1.0, glints of the sun reach 4.

    Raises
    ------
    InputError
        Where there is no such scene, or the size or the seed are out of range.
    """
    facts = {
        "scene": None if name in _PAINTERS else f"is {name!r}, must be one of {', '.join(SCENES)}",
        "scene_seed": None if seed >= 0 else f"is {seed}, must be 0 or more",
        "rows": None if rows >= FEWEST_ROWS else f"is {rows}, must be {FEWEST_ROWS} or more",
        "columns": None if columns >= 1 else f"is {columns}, must be 1 or more",
    }
    faults = [Fault("", key, fact) for key, fact in facts.items() if fact]
    if faults:
        raise InputError(faults)
    image = np.zeros((rows, columns, 3), np.float32)
    _PAINTERS[name](image, seed)
    return image
