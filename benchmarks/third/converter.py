"""Effects of the converter: codes of unequal width, and steps of more than a code."""

from typing import Any

import numpy as np
from scipy.special import ndtr
from typing_extensions import override

from third.camera import Array
from third.effect import Effect
from third.strengths import deviance

RANGE = 64  # codes over which random errors of width cancel
REACH = 6  # standard deviations within which codes are met


class AdcDnl(Effect):
    """Widths of codes: normal about the mean of 64; or wrong weights of a converter's bits."""

    kind, group, least = "adc_dnl", "code", 0.005
    most = 0.9

    @override
    def draw(self) -> None:
        codes, bits = self.camera.white + 1, self.camera.bits
        if self.neighbouring:
            weights = self.chance.normal(size=bits) * 2.0 ** (np.arange(bits) * 0.5)
            numbers, edges = np.arange(codes + 1), np.zeros(codes + 1)
            for bit in range(bits):
                edges += ((numbers >> bit) & 1) * weights[bit]
            errors = np.diff(edges)
            self.most = 0.3
        else:
            drawn = self.chance.normal(size=codes).reshape(-1, RANGE)
            errors = (drawn - drawn.mean(1)[:, None]).ravel()
        self.errors = errors / errors.std()
        self.met = self._met(codes)

    def _met(self, codes: int) -> Array:
        """Return how often each code is met in the recording."""
        c, black, met = self.cells, self.camera.black, np.zeros(codes)
        every = np.arange(codes)
        for signal, variance, pixels, frames in zip(
            c.signal, c.variance, c.pixels, c.frames, strict=True
        ):
            noise, at = variance**0.5, signal + black
            low, high = int(max(0, at - REACH * noise)), int(min(codes, at + REACH * noise + 2))
            away = every[low:high] - black - signal
            within = ndtr((away + 0.5) / noise) - ndtr((away - 0.5) / noise)
            met[low:high] += pixels * frames * within
        return met

    @override
    def z_of(self, size: float) -> float:
        return float(np.sqrt(deviance(1 + self.met * (size * self.errors) ** 2).sum()))

    @override
    def make_ready(self) -> None:
        widths = np.maximum(1 + self.size * self.errors, 0.02)
        edges = np.r_[0, np.cumsum(widths)]
        if self.neighbouring:
            edges -= (edges - np.arange(len(edges))).mean()
        else:
            edges = edges * (self.camera.white + 1) / edges[-1]
        self.edges = (np.maximum.accumulate(edges) - 0.5).astype(np.float64)

    @override
    def codes(self, volts: Array) -> Array | None:
        found = np.searchsorted(self.edges, volts, "right") - 1
        return np.clip(found, 0, self.camera.white)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"rms_lsb": self.size}


class Quantisation(Effect):
    """Codes come in steps, at times of a width that is no whole number of codes."""

    kind, group, sized, has_neighbour = "quantisation", "code", False, False

    @override
    def draw(self) -> None:
        noise = self.camera.low.intercept**0.5
        steps = [step for step in (2, 3, 4, 8, 16, 1.5, 2.5) if step < 3 * noise] or [2]
        self.step = float(self.chance.choice(steps))
        self.phase = 0
        if self.chance.random() < 0.3:
            self.phase = int(self.chance.integers(0, int(self.step) + (self.step % 1 > 0)))

    @override
    def z_of(self, size: float) -> float:
        samples = np.sum(self.cells.pixels * self.cells.frames)
        return float(np.sqrt(2 * samples * np.log(self.step)))

    @override
    def codes(self, volts: Array) -> Array | None:
        most = np.floor((self.camera.white - self.phase) / self.step)
        number = np.minimum(np.floor((volts - self.phase) / self.step + 0.5), most)
        return np.floor(self.phase + self.step * np.maximum(number, 0) + 0.5)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"step_dn": self.step, "phase_dn": self.phase}
