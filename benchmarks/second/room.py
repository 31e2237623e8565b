"""What a camera leaves room for: scales of effects, and how a size is found for a wanted z."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from second.geometry import Case, Effect, pick

Setter = Callable[[Effect, float], None]
STEPS = 9
CLOSE = 0.15  # of the logarithm of z


class Drawn(NamedTuple):
    """An effect, and what sizes it: a setter, a first guess, the largest, z's local exponent."""

    effect: Effect
    setter: Setter | None = None
    first: float = 0.0
    largest: float = 0.0
    exponent: float = 1.0


@dataclass(frozen=True)
class Room:
    """Noise and signals of a camera that sizes are measured by, in DN; times in seconds."""

    case: Case
    read_noise: float
    top: float
    mid: float
    top_noise: float
    mid_noise: float
    longest: float
    shortest: float

    @classmethod
    def of(cls, case: Case) -> "Room":
        """Return the room of a camera whose exposures are planned."""
        flats = [e for e in case["exposures"] if e["kind"] == "flat"]
        levels = sorted(e["level"] for e in flats)
        top, mid, last = levels[-1], levels[len(levels) // 2], case["segments"][-1]
        noise = np.sqrt(case["segments"][0]["intercept"])
        return cls(
            case,
            noise,
            top,
            mid,
            np.sqrt(last["slope"] * top + last["intercept"]),
            np.sqrt(last["slope"] * mid + noise * noise),
            max(e["time"] for e in case["exposures"] if e["kind"] == "dark"),
            min(e["time"] for e in flats),
        )

    @property
    def pixels(self) -> int:
        """Pixels of a frame."""
        return self.case["h"] * self.case["w"]

    @property
    def full(self) -> float:
        """DN from black to white."""
        return self.case["white"] - self.case["black"]

    @property
    def frame_noise(self) -> float:
        """Read noise of a frame's mean, in DN."""
        return self.read_noise / np.sqrt(self.pixels)

    @property
    def frame_percent(self) -> float:
        """Noise of the brightest frame's mean, in percent."""
        return 100 * self.top_noise / self.top / np.sqrt(self.pixels)

    @property
    def heat(self) -> float:
        """DN per second that the longest dark shows as its read noise."""
        return self.read_noise / self.longest


def sets(name: str, scale: float = 1.0) -> Setter:
    """Return what writes a size, in units of a scale."""

    def setter(effect: Effect, size: float) -> None:
        effect[name] = float(size * scale)

    return setter


def signed(name: str, g: np.random.Generator) -> Setter:
    """Return what writes a size of a sign that is drawn."""
    sign = pick(g, [-1, 1])

    def setter(effect: Effect, size: float) -> None:
        effect[name] = sign * size

    return setter


def solve(
    z_of_size: Callable[[float], float],
    size: float,
    target: float,
    largest: float,
    exponent: float,
) -> tuple[float, float]:
    """Return the size whose z is next to the target, among those that were tried, and its z."""
    tried: list[tuple[float, float]] = []
    size = min(size, largest)
    for _ in range(STEPS):
        z = z_of_size(size)
        tried.append((size, z))
        if abs(np.log(max(z, 1e-3) / target)) < CLOSE:
            break
        seen = [point for point in tried if point[1] > 0.7]
        if len(seen) >= 2 and seen[-1][0] != seen[-2][0]:
            q = np.log(seen[-1][1] / seen[-2][1]) / np.log(seen[-1][0] / seen[-2][0])
            exponent = float(np.clip(q, 0.5, 8))
        step = np.clip((target / max(z, 0.05)) ** (1 / exponent), 0.04, 15)
        new = min(size * step, largest)
        low = [a for a, b in tried if b < target]
        high = [a for a, b in tried if b > target]
        if low and high and min(high) > max(low) and not max(low) < new < min(high):
            new = np.sqrt(max(low) * min(high))
        if new == size:
            break
        size = new
    return min(tried, key=lambda point: abs(np.log(max(point[1], 1e-3) / target)))


Draw = Callable[[Room, np.random.Generator], Drawn]
