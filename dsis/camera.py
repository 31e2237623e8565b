"""A camera model: TOML <-> values, scene -> clean raw signal, clean signal -> noisy codes.

The chain of a camera is a tuple of effects sorted by stage. The base model's shot and read noise
and the converter are links of it like every other, so physics beyond the base model finds its place
between them.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import tomli_w
from pydantic import ConfigDict, Field, model_validator

from dsis.cfa import Cfa
from dsis.color import white_balanced
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, Image, Stage, any_effect
from dsis.grid import PixelGrid
from dsis.model import Model, read_toml, structure
from dsis.noise import Segments, read_noise, shot_noise

Row = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class Segment(Model):
    """One read-out path: variance = slope * x + intercept, x in DN above black."""

    upper_dn: Positive | None = None
    slope: NotNegative
    intercept: float
    slope_se: NotNegative | None = None
    intercept_se: NotNegative | None = None


class BaseNoise(Model):
    """The base model's noise: read-out segments in ascending order."""

    shot: Literal["gaussian"] = "gaussian"
    segment: Annotated[tuple[Segment, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        ends = [segment.upper_dn for segment in self.segment]
        if ends[-1] is not None:
            message = "upper_dn must be absent in the last segment: it has no upper end"
            raise ValueError(message)
        inner = [end for end in ends[:-1] if end is not None]
        if len(inner) < len(ends) - 1 or inner != sorted(set(inner)):
            message = "upper_dn must be given and ascend in all segments but the last"
            raise ValueError(message)
        return self


class Camera(Model):
    """A camera as `camera.toml` describes it; units in the names, DN unless said."""

    schema_: Annotated[Literal["dsis-camera/1"], Field(alias="schema")] = "dsis-camera/1"
    name: str
    cfa: Cfa
    black_level: NotNegative
    white_level: Positive
    bit_depth: Annotated[int, Field(ge=1, le=32)]
    saturation_dn: Positive | None = None
    diffuse_white_dn: Positive | None = None
    white_balance: tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    camera_from_scene: tuple[Row, Row, Row] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    noise: BaseNoise
    effect: tuple[any_effect(), ...] = ()  # type: ignore[valid-type] # the registry decides

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.white_level > 2**self.bit_depth - 1:
            message = f"white_level is {self.white_level}, must be <= {2**self.bit_depth - 1}: "
            message += f"the largest code of bit_depth = {self.bit_depth}"
            raise ValueError(message)
        if self.black_level >= self.white_level:
            message = f"black_level is {self.black_level}, must be below white_level"
            raise ValueError(message)
        if abs(np.linalg.det(np.array(self.camera_from_scene))) < 1e-6:
            message = "camera_from_scene must be invertible"
            raise ValueError(message)
        return self

    @property
    def segments(self) -> Segments:
        """The read-out segments as arrays."""
        rows = [s.upper_dn for s in self.noise.segment]
        lower = [-np.inf, *(float(end) for end in rows if end is not None)]
        return Segments.of(
            [(low, s.slope, s.intercept) for low, s in zip(lower, self.noise.segment, strict=True)]
        )

    def clean_raw(self, scene: Image) -> Image:
        """Return clean raw signals of linear scene light, float32 (row, column, 3), DN above black.

        raw_c = clip(black + k (M rgb)_c / g_c, 0, white) - black: M = `camera_from_scene`, g_c the
        white-balance gains, k = `diffuse_white_dn` (scene value 1.0 is diffuse white); also clipped
        at `saturation_dn` where given.
        """
        gain = self._scene_gain() / np.array(self.white_balance)
        matrix = (np.array(self.camera_from_scene) * gain[:, np.newaxis]).astype(np.float32)
        top = self.white_level - self.black_level
        top = min(top, self.saturation_dn) if self.saturation_dn else top
        signal: Image = scene @ matrix.T
        return np.clip(signal, np.float32(-self.black_level), np.float32(top))

    def scene_light(self, raw: Image) -> Image:
        """Return scene light of raw signals (row, column, 3): white balance, then M inverted.

        The white-balance gains multiply signal and noise, equation (2).
        """
        return self.scene_light_of_balanced(white_balanced(raw, self.white_balance))

    def scene_light_of_balanced(self, balanced: Image) -> Image:
        """Return scene light of white-balanced signals (row, column, 3), demosaicked ones say."""
        matrix = np.linalg.inv(np.array(self.camera_from_scene)) / self._scene_gain()
        return balanced @ matrix.T.astype(np.float32)

    def expose(
        self,
        clean: Image,
        temporal: Draw,
        sensor: Draw,
        frame: int,
        grid: PixelGrid,
        *,
        exposure_time_s: float = 0.0,
        threads: int = 1,
    ) -> Image:
        """Return one noisy frame of a clean signal: whole codes less black, float32.

        Parameters
        ----------
        clean
            Clean signal, DN above black, `grid.shape`.
        temporal, sensor
            Random fields of the frames and of the sensor.
        frame
            Number of the frame, from 0.
        grid
            The pixels of `clean`.
        exposure_time_s
            Exposure time, s.
        threads
            Threads that kernels may use.
        """
        exposure = Exposure(grid, frame, temporal, sensor, clean, exposure_time_s, threads)
        image = clean
        lit = False
        for link in self.chain():
            if link.stage > Stage.LIGHT and not lit:
                exposure, lit = replace(exposure, expected_dn=image), True
            image = link.apply(image, exposure)
        return image

    def chain(self) -> tuple[Effect, ...]:
        """Return all links, base model included, in the order that light and charge meet them."""
        base = (
            ShotNoise(segments=self.segments),
            ReadNoise(segments=self.segments),
            Conversion(black_level=self.black_level, white_level=self.white_level),
        )
        return tuple(sorted((*base, *self.effect), key=lambda e: (e.stage, e.rank, e.kind)))

    def _scene_gain(self) -> float:
        if self.diffuse_white_dn is None:
            message = f"the camera '{self.name}' has no diffuse_white_dn: no scene can be exposed"
            raise ValueError(message)
        return self.diffuse_white_dn


class BaseLink(Effect):
    """A link of the base model: no effect of the vocabulary."""

    model_config = ConfigDict(arbitrary_types_allowed=True)  # Segments holds arrays
    reference: ClassVar[str] = (
        "Seybold et al., CIC 22, 2014, section 'Camera noise characteristics'"
    )


class ShotNoise(BaseLink):
    """Shot noise of variance m x: the first thing that happens to charge."""

    kind: str = "shot_noise"
    segments: Segments
    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = -100
    measures: ClassVar[frozenset[str]] = frozenset({"pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the noise of the expected signal."""
        e = exposure
        return shot_noise(image, self.segments, e.temporal, e.grid, e.frame, e.threads)


class ReadNoise(BaseLink):
    """Read noise of variance t: the first thing that the read-out adds."""

    kind: str = "read_noise"
    segments: Segments
    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -100
    measures: ClassVar[frozenset[str]] = frozenset({"pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the noise of the read-out path that the expected signal selects."""
        e = exposure
        return read_noise(
            image, e.expected_dn, self.segments, e.temporal, e.grid, e.frame, e.threads
        )


class Conversion(BaseLink):
    """The converter: rounds to whole codes and clips at both ends; the last link."""

    kind: str = "conversion"
    black_level: float
    white_level: float
    stage: ClassVar[Stage] = Stage.CODE
    rank: ClassVar[int] = 100
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Return whole codes less black; values below black stay negative."""
        del exposure
        black = np.float32(self.black_level)
        codes: Image = np.clip(np.rint(image + black), np.float32(0), np.float32(self.white_level))
        return codes - black


def read_camera(path: Path) -> Camera:
    """Return the camera model in a TOML file; raise `InputError` with all its faults."""
    return structure(Camera, read_toml(path), str(path))


def write_camera(camera: Camera, path: Path) -> None:
    """Write a camera model as TOML; `read_camera` returns an equal one."""
    path.write_bytes(tomli_w.dumps(camera_values(camera)).encode())


def camera_values(camera: Camera) -> dict[str, Any]:
    """Return a camera model as plain values, as TOML and manifests hold it."""
    return dict(camera.model_dump(mode="json", by_alias=True, exclude_none=True))
