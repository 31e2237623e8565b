"""Which code renders a scene, who does the work, and what identifies the code."""

import hashlib
import platform
from collections.abc import Callable
from functools import cache, lru_cache, partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.strip import SCENES, Strip
from dsis.workers import Workers, completed, workers

Light = NDArray[np.float32]
Progress = Callable[[int, int, str], None]

_NO_RENDERERS = ("__init__.py", "cache.py", "presets.py", "renderer.py", "shipped.py", "strip.py")

OUTSIDE = ("cfa.py", "compiled.py", "draw.py", "grid.py")
"""What renderers use of dsis beside `dsis.scenes`."""

PART_COLUMNS = 64  # renderers sort what stands near once per part; always the same parts
_one_prepares = Lock()


class Scene(Protocol):
    """All that the pixels of one panorama need: how both kinds of scene are seen from here."""

    def part(self, first: int, last: int) -> Light:
        """Return the columns first..last-1, (row, column, 3)."""


def render(
    strip: Strip, threads: int = 1, progress: Progress | None = None, pool: Workers | None = None
) -> Light:
    """Render a strip; float32 (row, column, 3), linear light, the same bytes whoever renders.

    `pool`, see `dsis.workers.workers`, does the work if it is given, else that many threads.
    """
    if pool is None:
        with workers(threads) as own:
            return render(strip, progress=progress, pool=own)
    image = np.empty((strip.rows, strip.columns, 3), np.float32)
    starts = range(0, strip.columns, PART_COLUMNS)
    spans = [(first, min(first + PART_COLUMNS, strip.columns)) for first in starts]
    done = 0
    try:
        for (first, last), light in completed(pool, partial(_part, strip), spans):
            image[:, first:last] = light
            done += last - first
            if progress is not None:
                progress(done, strip.columns, strip.scene)
    finally:
        _prepared.cache_clear()
    return image


def _part(strip: Strip, span: tuple[int, int]) -> Light:
    with _one_prepares:
        scene = _prepared(strip)
    return scene.part(*span)


@lru_cache(maxsize=1)
def _prepared(strip: Strip) -> Scene:
    # A renderer is imported when it is needed: a command that renders nothing starts at once.
    scene: Scene = import_module(f"dsis.scenes.{strip.scene}").prepared(strip)
    return scene


@cache
def code_version(scene: str) -> str:
    """Return a digest of all that decides a rendered byte of a scene beside the strip.

    The renderer's sources, how they are compiled, the numerical libraries and the kind of machine.
    """
    here = Path(__file__).parent
    foreign = {here / other for other in SCENES if other != scene}
    digest = hashlib.sha256()
    for path in (*sorted(here.rglob("*.py")), *(here.parent / name for name in OUTSIDE)):
        own = not foreign.intersection(path.parents)
        if own and (path.parent != here or path.name not in _NO_RENDERERS):
            digest.update(f"{path.relative_to(here.parent).as_posix()}\0".encode())
            digest.update(path.read_bytes())
    libraries = (f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    digest.update("\0".join((*libraries, platform.machine())).encode())
    return digest.hexdigest()[:16]
