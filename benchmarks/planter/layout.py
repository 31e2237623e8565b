"""Random cameras and layouts of recordings to plant into."""

from dataclasses import dataclass

import numpy as np

from planter.case import Case, Plan, Segment

BAYER = ("RGGB", "BGGR", "GRBG", "GBRG")
FULL_SCALE = {12: (96.0, 4095), 14: (512.0, 16383), 16: (2048.0, 65535)}
LARGEST_READ_SHARE = 1 / 6  # of black: read noise does not reach code 0


@dataclass(frozen=True)
class Layout:
    """Size of a recording: pixels, flat levels, frames of flats and of darks."""

    rows: int
    columns: int
    flats: int
    frames: int
    dark_frames: int


LAYOUTS = {
    "tiny": Layout(48, 64, 5, 6, 6),
    "small": Layout(96, 128, 5, 8, 8),
    "medium": Layout(192, 256, 9, 8, 16),
    "video": Layout(480, 640, 9, 12, 16),  # 28 million samples to search: it is thinned
    "large": Layout(2736, 3648, 4, 6, 6),
}


@dataclass(frozen=True)
class Choice:
    """What is fixed of a random camera; None: drawn.

    `times`: "one" exposure time for all, "darks" two times of darks and one of flats, "ramp" flats
    whose time makes their light, darks at the shortest and the longest.
    """

    cfa: str | None = None
    segments: int | None = None
    bit_depth: int | None = None
    read_noise_dn: float | None = None
    electrons: float | None = None  # at full scale
    times: str | None = None
    light: bool | None = None
    frames: int | None = None
    scene: bool = False


def draw_case(seed: int, layout: str | Layout = "small", choice: Choice | None = None) -> Case:
    """Return a recording without effects of a random camera; every number follows from `seed`."""
    choice = choice or Choice()
    size = LAYOUTS[layout] if isinstance(layout, str) else layout
    rng = np.random.default_rng([seed, 4])
    bits = choice.bit_depth or int(rng.choice([12, 14, 16]))
    black, white = FULL_SCALE[bits]
    slope = (white - black) / (choice.electrons or np.exp(rng.uniform(np.log(4e3), np.log(6e4))))
    read = choice.read_noise_dn or max(0.5, slope * np.exp(rng.uniform(np.log(1.5), np.log(12))))
    # A whole number of noise sigmas above code 0; the pedestal is never a whole number.
    black = max(black, np.ceil(read / LARGEST_READ_SHARE)) + round(float(rng.uniform(-0.5, 0.5)), 3)
    cfa = choice.cfa or ("MONO" if rng.random() < 0.5 else str(rng.choice(BAYER)))
    response = (1.0, 1.0, 1.0)
    if cfa != "MONO":
        response = (round(rng.uniform(0.4, 0.7), 3), 1.0, round(rng.uniform(0.5, 0.9), 3))
    top = rng.uniform(0.5, 0.6) * (white - black)
    signals = np.geomspace(max(top / 60, 4 * read), top, size.flats)
    count = choice.segments or (1 if rng.random() < 0.7 else 2)
    return Case(
        seed=seed,
        sensor_seed=seed + 2**32,
        rows=size.rows,
        columns=size.columns,
        cfa=cfa,
        black_level=float(black),
        white_level=white,
        bit_depth=bits,
        segments=_segments(rng, count, slope, read, signals),
        exposures=_exposures(rng, size, choice, signals),
        response=response,
    )


def _segments(
    rng: np.random.Generator, count: int, slope: float, read: float, signals: np.ndarray
) -> tuple[Segment, ...]:
    first = Segment(float(slope), float(read**2))
    if count == 1:
        return (first,)
    gap = int(rng.integers(1, len(signals) - 2))
    switch = float(np.sqrt(signals[gap] * signals[gap + 1]))
    second = Segment(slope * rng.uniform(1.3, 3), read**2 * rng.uniform(2, 12))
    return (Segment(first.slope, first.intercept, switch), second)


def _exposures(
    rng: np.random.Generator, size: Layout, choice: Choice, signals: np.ndarray
) -> tuple[Plan, ...]:
    times = choice.times or str(rng.choice(["one", "darks", "ramp"], p=[0.3, 0.4, 0.3]))
    known = choice.light if choice.light is not None else rng.random() < 0.8
    frames, top_time = choice.frames or size.frames, 0.04
    ramp = top_time * signals / signals[-1]
    flat_times = ramp if times == "ramp" else np.full(len(signals), 0.01)
    dark_times = {"one": [0.01], "darks": [0.01, 0.5], "ramp": [ramp[0], ramp[-1]]}[times]
    dark_frames = choice.frames or size.dark_frames
    per_dn = rng.uniform(0.2, 5)  # light's unit is anybody's

    def light(signal: float) -> float | None:
        return float(signal * per_dn) if known else None

    plans = [
        Plan(f"dark-{i}", "dark", float(time), 0.0, dark_frames, light(0.0))
        for i, time in enumerate(dark_times)
    ]
    plans += [
        Plan(f"flat-{i}", "flat", float(time), float(signal), frames, light(signal))
        for i, (time, signal) in enumerate(zip(flat_times, signals, strict=True))
    ]
    if choice.scene:
        plans.append(Plan("scene-0", "scene", 0.01, float(0.4 * signals[-1]), frames))
    return tuple(plans)
