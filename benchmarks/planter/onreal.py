"""Effects planted into real frames: codes are made continuous again, changed, rounded anew.

What can be planted so acts on the sum of signal and noise: offsets, gains of pixels and regions,
jumping pixels, memory of lines. What counts or shares charge cannot: its noise is there.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Self

import numpy as np

from dsis.recording import read_recording
from planter.case import Case, Plan, Segment
from planter.chain import through
from planter.light import LIGHT
from planter.offsets import OFFSETS
from planter.readout import AMPLIFIERS, MEMORY, PIXELS
from planter.view import Image, View

# Fixed patterns are left out: a real sensor has its own, which the camera fitted to it holds.
PLANTABLE = frozenset(
    {
        "flicker",
        "line_flicker",
        "amp_glow",
        "hot_pixels",
        "tap_mismatch",
        "readout_memory",
        "rts",
        "row_noise",
        "row_banding",
        "column_noise",
        "black_level_drift",
        "pink_noise",
        "periodic_noise",
        "bistable_pattern",
    }
)
_STEADY = {**LIGHT, **AMPLIFIERS}
_STEPS = {**_STEADY, **PIXELS, **OFFSETS}
TOP, LEVELS, STACK = 0.8, 9, 16  # of full scale; flat levels and frames of a stack that are used


@dataclass(frozen=True)
class RealFrames:
    """A crop of a real recording in memory.

    Attributes
    ----------
    stacks
        Codes (frame, row, column) by exposure.
    exposures
        What they are; `signal_dn` is measured.
    black_level, white_level
        Mean of the darks, largest code.
    """

    stacks: tuple[np.ndarray, ...]
    exposures: tuple[Plan, ...]
    black_level: float
    white_level: int

    @classmethod
    @lru_cache(maxsize=2)
    def read(cls, path: Path, rows: int, columns: int) -> Self:
        """Read the crop in the middle: the stacks, and a selection of the other levels."""
        recording = read_recording(path)
        top, left = (recording.rows - rows) // 2, (recording.columns - columns) // 2
        crop = (slice(top, top + rows), slice(left, left + columns))
        stacks, plans = [], []
        for exposure in recording.exposures:
            frames = recording.frames(exposure, range(min(len(exposure.frames), STACK)))
            stacks.append(np.stack([codes[crop] for codes in frames]))
            plans.append(exposure)
        darks = [s.mean() for s, p in zip(stacks, plans, strict=True) if p.kind == "dark"]
        white = int(recording.sensor.white_level)
        read = [
            Plan(p.name, p.kind, p.exposure_time_s, float(s.mean() - min(darks)), len(s), p.light)
            for s, p in zip(stacks, plans, strict=True)
        ]
        kept = _spread(read, TOP * white)
        return cls(tuple(stacks[i] for i in kept), tuple(read[i] for i in kept), min(darks), white)

    def twin(self, seed: int) -> Case:
        """Return a simulated recording of the same layout, to judge strengths by."""
        flats = [i for i, plan in enumerate(self.exposures) if plan.kind == "flat"]
        variance = [float(self.stacks[i].var(0, ddof=1).mean()) for i in flats]
        signal = [self.exposures[i].signal_dn for i in flats]
        slope, intercept = np.polyfit(signal, variance, 1, w=1 / np.array(variance))
        darks = tuple(
            replace(plan, signal_dn=0.0) if plan.kind == "dark" else plan for plan in self.exposures
        )
        return Case(
            seed=seed,
            sensor_seed=seed + 2**32,
            rows=self.stacks[0].shape[1],
            columns=self.stacks[0].shape[2],
            cfa="MONO",
            black_level=self.black_level,
            white_level=self.white_level,
            bit_depth=int(np.ceil(np.log2(self.white_level + 1))),
            segments=(Segment(float(slope), float(max(intercept, 0.05))),),
            exposures=darks,
        )

    def frame_codes(self, case: Case, exposure: int, frame: int) -> np.ndarray:
        """Return a real frame with the effects of `case`, uint16 (row, column)."""
        codes = self.stacks[exposure]
        expected = (codes.mean(0) - self.black_level).astype(np.float32)
        view = View(case, exposure, frame, expected)
        analogue = codes[frame] - 0.5 + view.fresh("dither").random(view.shape, dtype=np.float32)
        signal: Image = analogue - np.float32(self.black_level)
        # What is noise to a memory is beyond what light and amplifiers make of what is expected.
        steady = replace(view, expected=through(_STEADY, expected, view))
        signal = through(MEMORY, through(_STEPS, signal, view), steady)
        changed = np.rint(signal + np.float32(self.black_level))
        at_end = (codes[frame] == 0) | (codes[frame] == self.white_level)
        changed = np.where(at_end, codes[frame], changed)  # what was clipped stays so
        return np.clip(changed, 0, self.white_level).astype(np.uint16)


def _spread(plans: list[Plan], top_dn: float) -> list[int]:
    """Return exposures below `top_dn`: stacks, and evenly chosen levels of flats and darks."""
    usable = [i for i, p in enumerate(plans) if p.signal_dn < top_dn]
    kept = {i for i in usable if plans[i].frames > 2}
    for kind in ("flat", "dark"):
        pairs = [i for i in usable if plans[i].kind == kind and plans[i].frames == 2]
        count = min(LEVELS, len(pairs))
        kept |= {pairs[int(k)] for k in np.linspace(0, len(pairs) - 1, count)} if pairs else set()
    return sorted(kept)
