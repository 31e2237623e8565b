"""Prepare, run and analyse double-stimulus impairment tests of real camera noise.

Everything a command does is one function call away: `read_spec`, `build_stimuli`, `check_stimuli`,
`read_manifest`, `read_camera`, `write_camera`, `run_robots`, `serve`, `export_votes`; scores are in
the package `analysis`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dsis.camera import Camera, read_camera, write_camera
    from dsis.draw import Draw
    from dsis.errors import DamagedError, DsisError, InputError
    from dsis.grid import PixelGrid
    from dsis.manifest import Manifest, read_manifest
    from dsis.session import export_votes, run_robots, serve
    from dsis.spec import read_spec
    from dsis.stimuli import build_stimuli, check_stimuli

__version__ = "0.1.0"

_HOME = {
    "Camera": "camera",
    "DamagedError": "errors",
    "Draw": "draw",
    "DsisError": "errors",
    "InputError": "errors",
    "Manifest": "manifest",
    "PixelGrid": "grid",
    "build_stimuli": "stimuli",
    "check_stimuli": "stimuli",
    "export_votes": "session",
    "read_camera": "camera",
    "read_manifest": "manifest",
    "read_spec": "spec",
    "run_robots": "session",
    "serve": "session",
    "write_camera": "camera",
}

__all__ = [
    "Camera",
    "DamagedError",
    "Draw",
    "DsisError",
    "InputError",
    "Manifest",
    "PixelGrid",
    "build_stimuli",
    "check_stimuli",
    "export_votes",
    "read_camera",
    "read_manifest",
    "read_spec",
    "run_robots",
    "serve",
    "write_camera",
]


def __getattr__(name: str) -> Any:
    """Import what is asked for, when it is asked for: `import dsis` costs nothing."""
    if name not in _HOME:
        message = f"module 'dsis' has no attribute {name!r}"
        raise AttributeError(message)
    return getattr(import_module(f"dsis.{_HOME[name]}"), name)
