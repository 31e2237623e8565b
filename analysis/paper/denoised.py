"""PSNR of City's noisy frames before and after denoising: what Table 2 and the claims stand on."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.denoising import bls_gsm, bm3d, stabilised
from analysis.paper.cells import Cell, cells, display_spectrum, white_spectrum
from analysis.paper.frames import FrameScore, Key, read_frames, write_frames
from analysis.paper.published import AWGN_SIGMA
from analysis.paper.scene import Scene, scene
from analysis.paper.setting import Setting
from dsis.stimuli.quality import delivered, psnr_db

Image: TypeAlias = NDArray[np.float32]

DENOISERS = {"bls_gsm": bls_gsm, "bm3d": bm3d}
PAPERS_METHODS = ("none", "bilinear")
FACTORS = (0.7, 1.0, 1.4, 2.0)  # of the true noise: the best for a plain denoiser is picked
PICK_PX = 128  # side of the square, in the middle of the first frame, on which it is picked


@dataclass(frozen=True)
class Score:
    """PSNR of one kind of field after one kind of treatment.

    Attributes
    ----------
    psnr_db
        Of the delivered frame against the reference, frame by frame.
    psnr_still_db
        Against the noise-free frame that went the same way: what noise alone costs; of the first
        frames only where that takes denoising of its own.
    factors
        Of a plain denoiser's sigma, for the first number and for the second; (1, 1) for others.
    """

    psnr_db: tuple[float, ...]
    psnr_still_db: tuple[float, ...]
    factors: tuple[float, float]

    @property
    def mean_db(self) -> float:
        """Mean over the frames."""
        return float(np.mean(self.psnr_db))

    @property
    def mean_still_db(self) -> float:
        """Mean over the frames against the noise-free frames that went the same way."""
        return float(np.mean(self.psnr_still_db))

    @property
    def error_db(self) -> float | None:
        """Standard error over the frames; None for one."""
        if len(self.psnr_db) < 2:
            return None
        return float(np.std(self.psnr_db, ddof=1) / np.sqrt(len(self.psnr_db)))


Found: TypeAlias = dict[Key, Score]
Factors: TypeAlias = dict[Key, tuple[float, float]]


def measure(setting: Setting, folder: Path, tell: Callable[[int], None] | None = None) -> Found:
    """Return the scores of all cells; frames that `folder` has finished are not done again.

    `tell` is given the number of each frame that is begun.
    """
    frames = setting.denoised_frames
    done = read_frames(folder)
    if len(done) < frames:
        city = scene("city", setting, frames)
        factors = _factors(city, setting)
        for frame in range(len(done), frames):
            if tell is not None:
                tell(frame)
            whole = frame < setting.compared_frames
            done.append(_frame(city, frame, factors, setting.jobs, whole=whole))
            write_frames(folder, done)
    return {key: _score([frame[key] for frame in done[:frames] if key in frame]) for key in done[0]}


def _score(frames: list[FrameScore]) -> Score:
    still = tuple(f.psnr_still_db for f in frames if f.psnr_still_db is not None)
    factors = frames[0].factor, frames[0].factor_still
    return Score(tuple(f.psnr_db for f in frames), still, factors)


def compared(found: Found, setting: Setting) -> Found:
    """Return the scores of the frames on which everything was measured: they may be subtracted."""
    n = setting.compared_frames
    return {
        key: replace(score, psnr_db=score.psnr_db[:n], psnr_still_db=score.psnr_still_db[:n])
        for key, score in found.items()
    }


def _frame(
    city: Scene, frame: int, factors: Factors, jobs: int, *, whole: bool
) -> dict[Key, FrameScore]:
    """Return the scores of one frame: all, or what the paper's table holds."""
    clean = city.clean(frame)
    reference = delivered(city.rendering.reference(clean))
    fields = cells(city, frame) if whole else cells(city, frame, PAPERS_METHODS)
    tasks = [task for cell in fields for task in _tasks(city, clean, cell, factors, whole=whole)]

    def score(task: _Task) -> FrameScore:
        own = factors.get(task.key, (1.0, 1.0))
        first, second = task.run()
        shown = _shown(city, task.cell, first)
        if second is None:
            return FrameScore(psnr_db(shown, reference), None, *own)
        shown_too = shown if second is first else _shown(city, task.cell, second)
        still = _shown(city, task.cell, task.cell.still)
        return FrameScore(psnr_db(shown, reference), psnr_db(shown_too, still), *own)

    with ThreadPoolExecutor(jobs) as pool:
        return dict(zip([task.key for task in tasks], pool.map(score, tasks), strict=True))


@dataclass(frozen=True)
class _Task:
    """One treatment of one field: two results, one for each reference; None: not asked for."""

    key: Key
    cell: Cell
    run: Callable[[], tuple[Image, Image | None]]


def _tasks(city: Scene, clean: Image, cell: Cell, factors: Factors, *, whole: bool) -> list[_Task]:
    place = (cell.noise, cell.stage, cell.method)
    tasks = [_Task((*place, "noisy", False), cell, lambda: (cell.noisy,) * 2)]
    for name in DENOISERS:
        plain, adapted = (*place, name, False), (*place, name, True)
        tasks.append(_Task(plain, cell, partial(_both, cell, name, factors[plain], whole)))
        if whole:
            tasks.append(_Task(adapted, cell, partial(_twice, city, clean, cell, name)))
    return tasks


def _both(
    cell: Cell, name: str, factors: tuple[float, float], whole: bool
) -> tuple[Image, Image | None]:
    first = _plain(cell, name, factors[0])
    if factors[0] == factors[1]:
        return first, first
    return first, _plain(cell, name, factors[1]) if whole else None


def _twice(city: Scene, clean: Image, cell: Cell, name: str) -> tuple[Image, Image]:
    return (_adapted(city, clean, cell, name),) * 2


def _plain(cell: Cell, name: str, factor: float) -> Image:
    """Denoise as if the noise were white and everywhere the same."""
    return DENOISERS[name](cell.noisy, factor * cell.sigma)


def _adapted(city: Scene, clean: Image, cell: Cell, name: str) -> Image:
    """Denoise with what is known of the noise: its spectrum, and at stage 2 its variance law."""
    denoiser = DENOISERS[name]
    if cell.noise == "awgn":
        return denoiser(cell.noisy, white_spectrum(city, cell, AWGN_SIGMA / 255))
    if cell.stage == 3:
        return denoiser(cell.noisy, display_spectrum(city, clean, cell.method))
    spectrum = white_spectrum(city, cell, 1.0)
    share = np.diagonal(spectrum.at_lag_zero) * np.ones(3)  # of the mosaic's variance
    gains = np.asarray(city.camera.white_balance)
    law = city.camera.segments
    return stabilised(
        denoiser,
        cell.noisy,
        law.slope_dn[:, np.newaxis] * gains * share,
        (law.intercept_dn2[:, np.newaxis] + 1 / 12) * gains**2 * share,
        lower=law.lower_dn[:, np.newaxis] * gains,
        correlation=spectrum,
    )


def _factors(city: Scene, setting: Setting) -> Factors:
    """Return, for each plain denoiser and cell, the factors of sigma with the highest PSNR.

    One against the reference, one against the noise-free frame that went the same way.
    """
    clean = city.clean(0)
    reference = delivered(_middle(city.rendering.reference(clean)))
    tried = [(cell, name, f) for cell in cells(city, 0) for name in DENOISERS for f in FACTORS]

    def score(trial: tuple[Cell, str, float]) -> tuple[float, float]:
        cell, name, factor = trial
        crop = replace(cell, noisy=_middle(cell.noisy), still=_middle(cell.still))
        found = _shown(city, crop, _plain(crop, name, factor))
        return psnr_db(found, reference), psnr_db(found, _shown(city, crop, crop.still))

    with ThreadPoolExecutor(setting.jobs) as pool:
        scored = list(pool.map(score, tried))
    best: Factors = {}
    for start in range(0, len(tried), len(FACTORS)):
        cell, name, _ = tried[start]
        both = np.array(scored[start : start + len(FACTORS)]).argmax(axis=0)
        key = (cell.noise, cell.stage, cell.method, name, False)
        best[key] = (FACTORS[both[0]], FACTORS[both[1]])
    return best


def _middle(image: Image) -> Image:
    rows, columns = (min(PICK_PX, n) for n in image.shape[:2])
    row, column = (image.shape[0] - rows) // 2, (image.shape[1] - columns) // 2
    return np.ascontiguousarray(image[row : row + rows, column : column + columns])


def _shown(city: Scene, cell: Cell, field: Image) -> NDArray[np.uint8]:
    """Return the delivered frame of a field: stage 2 goes through the colour transform."""
    return delivered(field if cell.stage == 3 else city.display_of_balanced(field))
