"""PSNR frame by frame, kept while Table 2 is being computed: `table2_frames.csv`."""

import csv
import io
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TypeAlias

from dsis.outdir import UNFINISHED

NAME = "table2_frames.csv"
HEADER = (
    "frame",
    "noise",
    "stage",
    "demosaicking",
    "denoiser",
    "adapted",
    "psnr_db",
    "psnr_against_demosaicked_clean_db",
    "factor",
    "factor_against_demosaicked_clean",
)

# (noise, stage, demosaicking, "noisy" or denoiser, adapted or not)
Key: TypeAlias = tuple[str, int, str, str, bool]


@dataclass(frozen=True)
class FrameScore:
    """PSNR of one treatment of one frame, and the factors of sigma it was treated with.

    Attributes
    ----------
    psnr_db, psnr_still_db
        Against the reference, and against the noise-free frame that went the same way; None where
        that was not measured (`Setting.compared_frames`).
    factor, factor_still
        Of the true standard deviation, for the one and for the other.
    """

    psnr_db: float
    psnr_still_db: float | None
    factor: float
    factor_still: float


def read_frames(folder: Path) -> list[dict[Key, FrameScore]]:
    """Return the frames that are finished; the file is always written whole."""
    path = folder / NAME
    if not path.is_file():
        return []
    frames: list[dict[Key, FrameScore]] = []
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            number, noise, stage, method, name, adapted, *values = (row[h] for h in HEADER)
            if int(number) == len(frames):
                frames.append({})
            key = (noise, int(stage), method, name, adapted == "true")
            first, still, *factors = values
            score = FrameScore(float(first), float(still) if still else None, *map(float, factors))
            frames[int(number)][key] = score
    return frames


def write_frames(folder: Path, frames: list[dict[Key, FrameScore]]) -> None:
    """Write all frames; a kill leaves the old file or the new one.

    The journal of the folder tells of them, so that they outlast an error of another part.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for number, scores in enumerate(frames):
        for (noise, stage, method, name, adapted), score in scores.items():
            word = "true" if adapted else "false"
            writer.writerow([number, noise, stage, method, name, word, *astuple(score)])
    new = folder / f"{NAME}.new"
    new.write_bytes(text.getvalue().encode())
    new.replace(folder / NAME)
    with (folder / UNFINISHED).open("ab") as journal:
        journal.write(b'{"frames": %d}\n' % len(frames))
