"""Cameras and plans of recordings, drawn: every draw has its place in the one stream of chance."""

from dataclasses import dataclass

import numpy as np

from third.camera import Array, Camera, Exposure, Path

BAYER = ["RGGB", "BGGR", "GRBG", "GBRG"]
SLOPES = {10: (0.05, 0.8), 12: (0.08, 3), 14: (0.2, 8), 16: (0.5, 8)}  # DN an electron, by bits
SAMPLES = 5.5e6  # most pixels of all frames together


@dataclass(frozen=True)
class _Sensor:
    rows: int
    columns: int
    cfa: str
    bits: int
    slope: float
    noise: float
    black: float
    shot: str


@dataclass(frozen=True)
class _Levels:
    timed: bool
    spacing: str
    signals: Array


def log_uniform(chance: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(chance.uniform(np.log(low), np.log(high))))


def draw_camera(
    chance: np.random.Generator,
    *,
    mosaic: bool | None = None,
    shot: str | None = None,
    segments: int | None = None,
) -> Camera:
    """Return a camera with its planned exposures; what is None is drawn."""
    sensor = _sensor(chance, mosaic, shot)
    levels = _levels(chance, sensor)
    response = _response(chance, sensor.cfa)
    low, high, switch = Path(sensor.slope, float(sensor.noise**2)), None, None
    if (segments or (2 if chance.random() < 0.3 else 1)) == 2:
        high, switch = _second_path(chance, low, levels.signals)
    planned, frames = _planned(chance, sensor, levels)
    scene_light = None
    if chance.random() < 0.2:
        full = 2**sensor.bits - 1 - sensor.black
        planned.append(_scene(levels, planned, full, frames))
        scene_light = _scene_light(chance, sensor)
    light_known = bool(chance.random() < 0.85)
    return Camera(
        sensor.rows,
        sensor.columns,
        sensor.cfa,
        sensor.bits,
        sensor.black,
        low,
        high,
        switch,
        sensor.shot,
        response,
        levels.spacing,
        levels.timed,
        light_known,
        tuple(_named(planned)),
        scene_light,
    )


def _sensor(chance: np.random.Generator, mosaic: bool | None, shot: str | None) -> _Sensor:
    rows, columns = 2 * int(chance.integers(30, 81)), 2 * int(chance.integers(40, 101))
    if chance.random() < 0.25:
        rows, columns = min(rows, 96), min(columns, 110)
    if mosaic is None:
        mosaic = bool(chance.random() < 0.5)
    cfa = str(chance.choice(BAYER)) if mosaic else "MONO"
    bits = int(chance.choice([10, 12, 12, 14, 16]))
    white = 2**bits - 1
    slope = log_uniform(chance, *SLOPES[bits])
    noise = slope * np.exp(chance.uniform(np.log(1.3), np.log(12)))
    noise = min(max(noise, chance.uniform(0.42, 0.9)), 0.012 * white)
    black = float(round(chance.uniform(5, 12) * noise + chance.uniform(0.01, 0.06) * white))
    if chance.random() < 0.06:  # a black level that clips the noise of darks now and then
        black = float(round(3.2 * noise + 1))
    law = shot or str(chance.choice(["poisson", "gaussian"], p=[0.6, 0.4]))
    return _Sensor(rows, columns, cfa, bits, slope, noise, black, law)


def _levels(chance: np.random.Generator, sensor: _Sensor) -> _Levels:
    full = 2**sensor.bits - 1 - sensor.black
    count = int(chance.integers(3, 15))
    timed = bool(chance.random() < 0.5)
    top = chance.uniform(0.25, 0.86) * full
    if chance.random() < 0.12:  # runs into the white level
        top = 1.15 * full
    if chance.random() < 0.15:  # a dim laboratory
        top = chance.uniform(0.03, 0.15) * full
    bottom = max(top * chance.uniform(0.005, 0.08), 2 * sensor.noise)
    spacing = str(chance.choice(["linear", "geometric", "random"]))
    steps = np.linspace(0, 1, count)
    if spacing == "random":
        steps = np.sort(np.r_[0, chance.random(count - 2), 1])
    if spacing == "linear":
        return _Levels(timed, spacing, bottom + (top - bottom) * steps)
    return _Levels(timed, spacing, bottom * (top / bottom) ** steps)


def _response(chance: np.random.Generator, cfa: str) -> Array:
    weights = {"R": chance.uniform(0.45, 0.8), "G": 1.0, "B": chance.uniform(0.4, 0.85)}
    if cfa == "MONO":
        return np.ones((2, 2))
    return np.array([[weights[cfa[2 * row + column]] for column in (0, 1)] for row in (0, 1)])


def _second_path(chance: np.random.Generator, low: Path, signals: Array) -> tuple[Path, float]:
    rising, count = np.sort(signals), len(signals)
    place = int(chance.integers(max(1, count // 3), max(2, 2 * count // 3 + 1)))
    place = min(max(place, 1), count - 1)
    switch = float(np.round(np.sqrt(rising[place - 1] * rising[place]), 1))
    slope = low.slope * float(chance.choice([1.0, 1.0, chance.uniform(1.1, 3)]))
    return Path(slope, low.intercept * chance.uniform(3, 25)), switch


def _planned(
    chance: np.random.Generator, sensor: _Sensor, levels: _Levels
) -> tuple[list[Exposure], int]:
    """Return flats and darks in the order in which they are taken, unnamed; and their frames."""
    signals = levels.signals
    unit = float(chance.choice([1.0, 1e3, 37.5, 0.02]))
    rate = signals.max() / log_uniform(chance, 0.004, 2.0)  # DN/s at the brightest
    fixed_time = float(signals.max() / rate)
    frames = int(np.clip(round(np.exp(chance.uniform(np.log(4), np.log(40)))), 4, 40))
    darks = int(chance.integers(1, 5))
    most = SAMPLES / (sensor.rows * sensor.columns)
    frames = int(max(4, min(frames, most / (len(signals) + darks))))
    flats = []
    uneven = chance.random() < 0.2
    for signal in signals:
        short = uneven and chance.random() < 0.35
        count = int(chance.integers(2, 4)) if short else frames
        time = float(signal / rate) if levels.timed else fixed_time
        light = float(signal / rate * rate * unit / 100)
        flats.append(Exposure("", "flat", float(signal), time, light, count))
    longest = max(flat.time_s for flat in flats)
    times = [longest, *(float(longest * share) for share in chance.uniform(0.01, 0.8, 3))]
    if not levels.timed and chance.random() < 0.7:
        times[1:] = [fixed_time * times_longer for times_longer in chance.uniform(1.5, 12, 3)]
    counts = [int(min(40, frames * chance.choice([1, 1, 2]))) for _ in range(darks)]
    dark = [
        Exposure("", "dark", 0.0, float(time), 0.0, count)
        for time, count in zip(times[:darks], counts, strict=True)
    ]
    order = str(chance.choice(["first", "last", "mixed"]))
    taken = dark + flats if order == "first" else flats + dark
    if order == "mixed":
        taken = [taken[i] for i in chance.permutation(len(taken))]
    return taken, frames


def _scene(levels: _Levels, planned: list[Exposure], full: float, frames: int) -> Exposure:
    brightest = levels.signals.max()
    time = next(e.time_s for e in planned if e.kind == "flat" and e.signal_dn == brightest)
    return Exposure("", "scene", float(0.6 * min(brightest, 0.8 * full)), time, None, frames)


def _scene_light(chance: np.random.Generator, sensor: _Sensor) -> Array:
    """Return a ramp, a wave and six discs."""
    rows, columns = sensor.rows, sensor.columns
    y, x = np.mgrid[0:rows, 0:columns]
    light: Array = 0.15 + 0.5 * x / columns + 0.2 * np.sin(y / chance.uniform(5, 15)) ** 2
    for _ in range(6):
        down, right = chance.uniform(0, rows), chance.uniform(0, columns)
        radius = chance.uniform(4, 20)
        within = (y - down) ** 2 + (x - right) ** 2 < radius * radius
        light = np.where(within, chance.uniform(0.05, 1), light)
    return np.clip(light, 0.03, 1)


def _named(planned: list[Exposure]) -> list[Exposure]:
    return [
        Exposure(f"{e.kind}-{i:02d}", e.kind, e.signal_dn, e.time_s, e.light, e.frames)
        for i, e in enumerate(planned)
    ]
