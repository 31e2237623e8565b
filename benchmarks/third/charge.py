"""Effects on collected charge: counting, spikes, neighbours, a full well, what stays behind."""

from typing import Any, ClassVar

import numpy as np
from scipy.special import ndtri
from typing_extensions import override

from third.camera import Array
from third.effect import Effect
from third.strengths import EXPONENTIAL, QUANTILES, of_bent_levels, of_neighbours


class PoissonShotNoise(Effect):
    """Photons are counted, while camera.toml takes their noise for normal."""

    kind, group, sized, has_neighbour = "poisson_shot_noise", "skew", False, False
    needs: ClassVar[dict[str, Any]] = {"shot": "gaussian"}
    counts_photons = True

    @override
    def camera_fits(self) -> bool:
        return 8 < self.z_of(0) < 150

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        skew = c.slope**2 * c.signal / c.variance**1.5
        samples = c.pixels * c.frames * (1 - 1 / c.frames) ** 3
        return float(np.sqrt(np.sum(samples * skew * skew / 6)))


class Impulse(Effect):
    """Particles in some pixels of some frames; or, of some of them, tracks over two pixels."""

    kind, group, order, charge_rank = "impulse", "tails", 6, 1

    @override
    def draw(self) -> None:
        hits = float(self.chance.uniform(15, 120))
        frames = sum(exposure.frames for exposure in self.camera.exposures)
        self.share = hits / (frames * self.camera.pixels)

    @override
    def size_fits(self) -> bool:
        return self.size < 0.6 * self.camera.full

    @override
    def z_of(self, size: float) -> float:
        c, heights = self.cells, EXPONENTIAL * size
        rare = 2 * np.log(1 / self.share)
        seen = [
            pixels * frames * self.share * np.maximum(0, heights * heights / variance - rare).mean()
            for pixels, frames, variance in zip(c.pixels, c.frames, c.variance, strict=True)
        ]
        return float(np.sqrt(sum(seen)))

    @override
    def charged(self, charge: Array) -> Array:
        struck = np.argwhere(self.chance.random(charge.shape) < self.share)
        heights = self.chance.exponential(self.size, len(struck))
        for (t, y, x), height in zip(struck, heights, strict=True):
            if self.neighbouring and self.chance.random() < 0.35 and x + 1 < charge.shape[2]:
                charge[t, y, x] += 0.6 * height
                charge[t, y, x + 1] += 0.4 * height
            else:
                charge[t, y, x] += height
        return charge

    @override
    def parameters(self) -> dict[str, Any]:
        return {"per_megapixel_frame": self.share * 1e6, "mean_dn": self.size}


class Crosstalk(Effect):
    """Neighbours exchange a share of charge; or, along both axes, diagonal ones a little too."""

    kind, group, most, charge_rank = "crosstalk", "corr", 0.12, 2

    @override
    def draw(self) -> None:
        self.along = str(self.chance.choice(["both", "both", "rows", "columns"]))
        self.neighbouring = self.neighbouring and self.along == "both"

    @override
    def z_of(self, size: float) -> float:
        alike, directions = exchanged(size, self.along)
        return of_neighbours(self.bench, alike * self.cells.shot_share, directions)

    @override
    def charged(self, charge: Array) -> Array:
        across = curvature(charge, float(self.along != "rows"), float(self.along != "columns"))
        out = charge + np.float32(self.size) * across
        if self.neighbouring:
            p = np.pad(charge, ((0, 0), (1, 1), (1, 1)), "edge")
            around = p[:, :-2, :-2] + p[:, :-2, 2:] + p[:, 2:, :-2] + p[:, 2:, 2:]
            out += np.float32(0.12 * self.size) * (around - 4 * charge)
        return np.asarray(out)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"fraction": self.size, "along": self.along}


class BrighterFatter(Effect):
    """Charge comes in instalments: what is there deflects what comes; or two pixels far too."""

    kind, group, most = "brighter_fatter", "corr", 1e-3
    instalments = 4

    @override
    def draw(self) -> None:
        self.anisotropy = float(self.chance.choice([0, 0, self.chance.uniform(-0.5, 0.5)]))

    @override
    def size_fits(self) -> bool:
        return bool(self.size * self.cells.signal.max() < 0.02)

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        return of_neighbours(self.bench, 2 * size * c.slope * c.signal**2 / c.variance, 2)

    @override
    def gathered(self, parts: list[Array]) -> Array:
        there = np.zeros_like(parts[0])
        for part in parts:
            halfway, moved = there + part / 2, np.zeros_like(part)
            for axis, weight in ((1, 1 - self.anisotropy), (2, 1 + self.anisotropy)):
                self._deflect(moved, part, halfway, axis, np.float32(2 * self.size * weight), 1)
                if self.neighbouring:
                    far = np.float32(0.16 * self.size * weight)
                    self._deflect(moved, part, halfway, axis, far, 2)
            there = there + part + moved
        return there

    @staticmethod
    def _deflect(
        moved: Array, part: Array, there: Array, axis: int, weight: np.float32, reach: int
    ) -> None:
        low, high = apart(axis, reach)
        flow = weight * (part[high] + part[low]) / 2 * (there[high] - there[low])
        moved[low] += flow
        moved[high] -= flow

    @override
    def parameters(self) -> dict[str, Any]:
        return {"per_dn": self.size, "anisotropy": self.anisotropy}


class Saturation(Effect):
    """A full well below the white level: hard, soft by a logistic law, or by a power."""

    kind, group, sized, charge_rank = "saturation", "mean", False, 3

    @override
    def camera_fits(self) -> bool:
        return self.cells.flats >= 4 and self.cells.signal.max() > 0.15 * self.camera.full

    @override
    def draw(self) -> None:
        levels = np.unique(np.round(self.cells.signal[~self.cells.dark], 3))
        share = self.chance.uniform(0.9, 1.0) if len(levels) else 1.0
        self.full_well = float(levels[-1] * share) if len(levels) else 1.0
        soft = float(self.chance.choice([0, 1])) * float(self.chance.uniform(0.5, 3))
        self.softness = soft * float(np.sqrt(self.camera.low.slope * self.full_well))
        self.neighbouring = self.neighbouring and self.softness > 0

    def kept(self, charge: Array) -> Array:
        """Return what a well keeps of charge."""
        well = self.full_well
        if not self.softness:
            return np.minimum(charge, well)
        if self.neighbouring:
            return np.asarray(charge / (1 + (np.maximum(charge, 0) / well) ** 24) ** (1 / 24.0))
        left = (well - charge) / self.softness
        return np.asarray(well - self.softness * np.logaddexp(0, left))

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        noise = np.sqrt(c.slope * c.signal + 1e-9)
        charge = c.signal[:, None] + noise[:, None] * ndtri(QUANTILES)[None]
        return of_bent_levels(self.bench, self.kept(charge).mean(1) - c.signal)

    @override
    def charged(self, charge: Array) -> Array:
        return self.kept(charge).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"full_well_dn": self.full_well, "softness_dn": self.softness}


class ImageLag(Effect):
    """A share of charge is read one frame later; or some of it two frames later."""

    kind, group, most, charge_rank, warm_up = "image_lag", "timecorr", 0.2, 4, 2

    @override
    def z_of(self, size: float) -> float:
        alike = size * (1 - size) / ((1 - size) ** 2 + size * size)
        return of_neighbours(self.bench, alike * self.cells.shot_share)

    @override
    def charged(self, charge: Array) -> Array:
        late = np.float32(self.size)
        if not self.neighbouring:
            return np.asarray((1 - late) * charge[2:] + late * charge[1:-1])
        later = np.float32(0.25 * self.size)
        now = (1 - late - later) * charge[2:]
        return np.asarray(now + late * charge[1:-1] + later * charge[:-2])

    @override
    def parameters(self) -> dict[str, Any]:
        return {"fraction": self.size}


class Nonlinearity(Effect):
    """A bend of the response, zero at black and at 85 % of full scale: a power, or saturating."""

    kind, group, most, charge_rank = "nonlinearity", "mean", 0.06, 5
    ends: ClassVar[float] = 0.85

    @override
    def camera_fits(self) -> bool:
        bright = self.cells.signal.max() > 0.3 * self.camera.full
        return self.camera.light_known and self.cells.flats >= 4 and bool(bright)

    @override
    def draw(self) -> None:
        self.sign = float(self.chance.choice([-1, 1]))
        self.exponent = float(self.chance.choice([0.5, 1.0, 1.0, 3.0]))

    def bend(self, charge: Array) -> Array:
        """Return the bend whose largest deviation is full scale."""
        u, k = np.asarray(charge) / (self.ends * self.camera.full), self.exponent
        if self.neighbouring:
            curve = 1 - np.exp(-0.7 * np.clip(u, -0.5, 2))
            bent, largest = curve / (1 - np.exp(-0.7)) - u, 0.0874
        else:
            bent = u * (1 - np.sign(u) * np.abs(u) ** k) / k
            largest = max(v * (1 - v**k) / k for v in np.linspace(0, 1, 400))
        return np.asarray(self.camera.full * bent / largest)

    @override
    def z_of(self, size: float) -> float:
        return of_bent_levels(self.bench, size * self.bend(self.cells.signal))

    @override
    def charged(self, charge: Array) -> Array:
        return np.asarray(charge + self.sign * self.size * self.bend(charge)).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        exponent = None if self.neighbouring else self.exponent
        return {"percent_full_scale": 100 * self.size * self.sign, "exponent": exponent}


def exchanged(fraction: float, along: str) -> tuple[float, int]:
    """Return the correlation that an exchange makes, and in how many directions."""
    others, directions = (4, 2) if along == "both" else (2, 1)
    kept = 1 - others * fraction
    return 2 * fraction * kept / (kept**2 + others * fraction * fraction), directions


def curvature(stack: Array, down: float = 1.0, right: float = 1.0) -> Array:
    """Return what flows into each pixel from its neighbours; nothing crosses the border."""
    out = np.zeros_like(stack)
    for axis, weight in ((1, down), (2, right)):
        low, high = apart(axis, 1)
        flow = weight * (stack[high] - stack[low])
        out[low] += flow
        out[high] -= flow
    return out


def apart(axis: int, reach: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return where pixels lie and where those lie that are `reach` further along an axis."""
    low, high = [slice(None)] * 3, [slice(None)] * 3
    low[axis], high[axis] = slice(None, -reach), slice(reach, None)
    return tuple(low), tuple(high)
