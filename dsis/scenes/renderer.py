"""Which code renders a scene, and what identifies that code."""

import hashlib
import platform
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.strip import SCENES, Strip

Light = NDArray[np.float32]
Progress = Callable[[int, int, str], None]

_NO_RENDERERS = ("__init__.py", "cache.py", "presets.py", "renderer.py", "shipped.py", "strip.py")

OUTSIDE = ("cfa.py", "compiled.py", "draw.py", "grid.py")
"""What renderers use of dsis beside `dsis.scenes`."""


def render(strip: Strip, threads: int = 1, progress: Progress | None = None) -> Light:
    """Render a strip; float32 (row, column, 3), linear light, the same bytes on any threads."""

    def tell(done: int, total: int) -> None:
        if progress is not None:
            progress(done, total, strip.scene)

    # A renderer is imported when it is needed: a command that renders nothing starts at once.
    light: Light = import_module(f"dsis.scenes.{strip.scene}").render(
        strip.seed,
        strip.rows,
        strip.columns,
        samples=strip.samples,
        ambient=strip.ambient,
        threads=threads,
        progress=tell,
    )
    return light


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
