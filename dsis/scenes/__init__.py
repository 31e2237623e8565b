"""City and Landscape: still panoramas in linear light, without grain, from a seed.

Rec.709 primaries, white point D65; 1.0 is a white diffuse surface that faces the sun. Both are ray
traced on the processor: every pixel has the same points, directions to the sun's disc and
directions of the sky, so there is no chance in a pixel and hence no grain at any number of them. A
path tracer needs a thousand samples for a grain of 1 %, and the installation of a renderer.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.cache import cache_folder, is_kept, kept_or_rendered
from dsis.scenes.presets import OVERSAMPLING, PRESETS, Preset, preset_strip
from dsis.scenes.renderer import Progress, render
from dsis.scenes.shipped import as_shipped, is_shipped
from dsis.scenes.strip import FEWEST_ROWS, SCENES, Strip
from dsis.workers import Workers

__all__ = [
    "FEWEST_ROWS",
    "OVERSAMPLING",
    "PRESETS",
    "SCENES",
    "Preset",
    "Progress",
    "Strip",
    "cache_folder",
    "is_ready",
    "panorama",
    "preset_strip",
    "render",
]


def is_ready(strip: Strip) -> bool:
    """Tell whether `panorama` returns a strip without rendering it."""
    return is_shipped(strip) or is_kept(strip)


def panorama(
    strip: Strip,
    *,
    threads: int = 1,
    progress: Progress | None = None,
    pool: Workers | None = None,
) -> NDArray[np.float32]:
    """Return the strip over which a window pans: shipped, from the cache, or rendered.

    The same strip gives the same bytes, whoever renders it.

    Parameters
    ----------
    strip
        Scene, seed and size; `preset_strip` names common ones.
    threads
        How many threads render.
    progress
        Called with (columns done, columns in all, the scene's name).
    pool
        Renders instead of threads, see `dsis.workers.workers`: processes, or a cluster. The cache
        is that of this process.

    Returns
    -------
    NDArray[np.float32]
        (row, column, 3), read-only, linear light, Rec.709 primaries, finite and not negative; a
        diffuse white is 1.0.

    Raises
    ------
    InputError
        Where there is no such scene, or a number is out of range.
    WorkersLostError
        Workers die again and again.
    """
    strip.checked()
    ready = as_shipped(strip)
    if ready is not None:
        return ready
    return kept_or_rendered(strip, lambda: render(strip, threads, progress, pool))
