"""Fig. 2: photon transfer with the step of the dual-gain read-out, and the noise at one level."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.paper.figures.fig2 import draw_transfer
from analysis.paper.part import Part, Picture, Row
from analysis.paper.setting import Setting
from analysis.photon_transfer import SegmentFit, fit_camera, fit_segments
from analysis.photon_transfer.lines import Points
from dsis.camera import Camera
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.recording import read_recording
from dsis.spec import SHIPPED, read_spec

Floats: TypeAlias = NDArray[np.float64]

PAPER_STEP_DN = 1000.0
LEVELS_DN = np.geomspace(5.0, 40000.0, 64)
FLAT_PX = 256
DISTRIBUTION_DN = 500.0
_BINS = 61


@dataclass(frozen=True)
class Transfer:
    """Variance against signal of a camera, and its noise at one level.

    Attributes
    ----------
    title
        What camera.
    x_dn, variance_dn2
        One point a level (and channel): DN above black, DN^2.
    fit
        Straight pieces through them.
    level_dn, centres_dn, density, sd_dn, skewness, kurtosis
        The noise at one level: bins, share per DN, moments (excess kurtosis).
    """

    title: str
    x_dn: Floats
    variance_dn2: Floats
    fit: SegmentFit
    level_dn: float
    centres_dn: Floats
    density: Floats
    sd_dn: float
    skewness: float
    kurtosis: float
    samples: int | None


def recompute(setting: Setting, folder: Path) -> Part:
    """Do the paper's photon transfer on the simulated camera, and on a recording where given."""
    camera = read_spec(SHIPPED / "seybold.toml").camera
    simulated = _simulated(camera, setting.seed)
    draw_transfer(simulated, folder / "fig2_simulated")
    pictures = [
        Picture(
            "fig2_simulated",
            f"Simulated camera ({camera.name}): variance by equation (1) from two frames A and B "
            "at each level, with the fitted pieces; right: noise at one level and the Gaussian "
            "of the fitted variance.",
        )
    ]
    rows = _rows(camera, simulated)
    says = [
        (
            "The paper's slopes m and intercepts t are not printed; its Fig. 2 shows two straight "
            "pieces with a step near signal 0.1 x 10\u2074 on a 16-bit scale, and a distribution "
            "'very similar to the Gaussian'. The shipped camera has assumed numbers with that "
            "step. Equation (1) is applied to its frames as the paper does, and the pieces are "
            "found again."
        )
    ]
    if setting.recording is None:
        says.append("No recording of a real camera was given (--recording).")
    else:
        real = _recorded(setting.recording, setting.jobs)
        draw_transfer(real, folder / "fig2_recorded")
        says.append(
            f"A real camera beside it: {real.title}, another sensor than the paper's, with one "
            f"read-out path; skewness {real.skewness:.3f} and excess kurtosis {real.kurtosis:.3f} "
            f"at {real.level_dn:.0f} DN say how Gaussian its noise is."
        )
        pictures.append(
            Picture("fig2_recorded", f"The same of a recording of a real camera: {real.title}.")
        )
    return Part("fig2", "Fig. 2", tuple(says), rows, tuple(pictures))


def _simulated(camera: Camera, seed: int) -> Transfer:
    grid = PixelGrid(FLAT_PX, FLAT_PX, camera.cfa)
    temporal, sensor = Draw(seed, ("fig. 2",)), Draw(seed, ("sensor",))

    def difference(level_dn: float, number: int) -> tuple[float, Floats]:
        """Return the mean of two frames and (A - B) / sqrt 2: noise of one frame's variance."""
        flat = np.full(grid.shape, level_dn, np.float32)
        a, b = (camera.expose(flat, temporal, sensor, 2 * number + i, grid) for i in (0, 1))
        return float(a.mean() + b.mean()) / 2, (a - b).astype(np.float64).ravel() / np.sqrt(2)

    measured = [difference(float(level), i) for i, level in enumerate(LEVELS_DN)]
    x = np.array([mean for mean, _ in measured])
    # Equation (1), less the variance of rounding two frames to whole codes.
    variance = np.array([np.square(noise).mean() for _, noise in measured]) - 1 / 12
    pixels = FLAT_PX**2
    points = Points.of(
        x_dn=x,
        variance_dn2=variance,
        relative_se=np.full(x.size, np.sqrt(2 / pixels)),
        x_se_dn=np.sqrt(variance / (2 * pixels)),
        channel=np.full(x.size, "all"),
        black_share=np.zeros(x.size),
    )
    mean, noise = difference(DISTRIBUTION_DN, LEVELS_DN.size)
    sd = float(noise.std())
    density, edges = np.histogram(noise, _BINS, (-4.5 * sd, 4.5 * sd), density=True)
    z = noise / sd
    return Transfer(
        camera.name,
        x,
        variance,
        fit_segments(points, None),
        mean,
        (edges[1:] + edges[:-1]) / 2,
        density,
        sd,
        float((z**3).mean()),
        float((z**4).mean() - 3),
        noise.size,
    )


def _recorded(path: Path, threads: int) -> Transfer:
    fit = fit_camera(read_recording(path), threads=threads)
    used = [level for level in fit.levels if not level.left_out and level.statistics.frames > 1]
    noise = fit.distribution
    nothing = np.zeros(0)
    return Transfer(
        fit.name,
        np.array([level.x_dn for level in used]),
        np.array([level.noise_dn2 for level in used]),
        fit.segments,
        noise.level_dn - fit.black_dn if noise else np.nan,
        noise.centres_dn if noise else nothing,
        noise.density if noise else nothing,
        noise.sd_dn if noise else np.nan,
        noise.skewness if noise else np.nan,
        noise.kurtosis if noise else np.nan,
        None,
    )


def _rows(camera: Camera, found: Transfer) -> tuple[Row, ...]:
    """Return what photon transfer finds beside what the simulated camera has."""
    rows = []
    switches = found.fit.switches
    step = switches[0].middle_dn if switches else None
    remark = "read off Fig. 2(a); the shipped camera is made to have it"
    error = (switches[0].high_dn - switches[0].low_dn) / 2 if switches else None
    rows.append(Row("signal of the step", PAPER_STEP_DN, step, error, "DN", remark))
    for i, (line, piece) in enumerate(
        zip(found.fit.lines, camera.noise.segment, strict=False), start=1
    ):
        unprinted = "the paper prints none; the simulated camera has "
        rows += [
            Row(
                f"slope m, piece {i}",
                None,
                line.slope_dn,
                line.slope_se_dn,
                "DN",
                f"{unprinted}{piece.slope:g}",
            ),
            Row(
                f"intercept t, piece {i}",
                None,
                line.intercept_dn2,
                line.intercept_se_dn2,
                "DN²",
                f"{unprinted}{piece.intercept:g}",
            ),
        ]
    n = found.samples or 1
    gaussian = '"very similar to the Gaussian distribution": 0 published as a sentence'
    rows += [
        Row("skewness at one level", 0.0, found.skewness, float(np.sqrt(6 / n)), "", gaussian),
        Row(
            "excess kurtosis at one level",
            0.0,
            found.kurtosis,
            float(np.sqrt(24 / n)),
            "",
            gaussian,
        ),
    ]
    return tuple(rows)
