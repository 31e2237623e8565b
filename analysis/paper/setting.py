"""What the paper's tables are recomputed from, and how much of it."""

import os
from dataclasses import dataclass
from pathlib import Path

from dsis.errors import InputError
from dsis.imagefile import find_files

DATA = "DSIS_SHARED_DATA"
KODAK_IMAGES = 24


@dataclass(frozen=True)
class Setting:
    """Where data comes from, and the size of the computation.

    Attributes
    ----------
    kodak
        The Kodak images in order of name; empty: City stands in.
    recording
        A recording of a real camera for Fig. 2, or None.
    votes
        Votes for Fig. 6; None: simulated observers.
    scale
        Ends of the scale of those votes; None: as the package beside them says.
    full
        20 frames of 1920 x 1080 instead of a small one.
    seed, jobs
        Fixes every random number; threads.
    """

    kodak: tuple[Path, ...] = ()
    recording: Path | None = None
    votes: Path | None = None
    scale: tuple[float, float] | None = None
    full: bool = False
    seed: int = 1
    jobs: int = 1

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of City's frames, pixels."""
        return (1920, 1080) if self.full else (480, 270)

    @property
    def denoised_frames(self) -> int:
        """Frames of City whose denoising Table 2 averages."""
        return 20 if self.full else 1

    @property
    def compared_frames(self) -> int:
        """Frames, the first ones, on which what the paper does not do is measured beside it.

        That takes six times as long as what it does: other demosaicking, adapted denoisers, and
        plain ones at their best against the demosaicked clean frame.
        """
        return 1


def kodak_images(folder: Path | None) -> tuple[Path, ...]:
    """Return the images of a folder, or those below $DSIS_SHARED_DATA where no folder is given."""
    if folder is None:
        beside = _shared("kodak")
        return find_files(beside, ("*.png",)) if beside is not None else ()
    if not folder.is_dir():
        raise InputError.of("--kodak", "", f"is {folder}, must be a folder of the Kodak images")
    found = find_files(folder, ("*.png",))
    if not found:
        raise InputError.of("--kodak", "", f"is {folder}, which holds no .png")
    return found


def real_recording(path: Path | None) -> Path | None:
    """Return the recording given, or the one below $DSIS_SHARED_DATA; None: there is none."""
    if path is not None:
        if not path.exists():
            raise InputError.of("--recording", "", f"is {path}, which is not there")
        return path
    beside = _shared("emva1288_ccd12")
    return None if beside is None else beside / "EMVA1288_Data.txt"


def _shared(name: str) -> Path | None:
    folder = os.environ.get(DATA)
    if not folder or not (Path(folder) / name).is_dir():
        return None
    return Path(folder) / name
