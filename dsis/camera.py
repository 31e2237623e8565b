"""A camera model: TOML <-> values, scene -> clean raw signal, clean signal -> noisy codes.

The chain of a camera is a tuple of effects sorted by stage. The base model's shot and read noise
and the converter are links of it like every other, so physics beyond the base model finds its place
between them.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import tomli_w
from pydantic import Field, model_validator

from dsis.cfa import Cfa
from dsis.color import white_balanced
from dsis.conversion import converted
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, Image, ReadOut, Stage, any_effect
from dsis.effects.poisson_shot_noise import PoissonShotNoise
from dsis.errors import Fault, InputError
from dsis.exposing import Drawn, Shared, Shutter
from dsis.grid import PixelGrid
from dsis.model import Model, read_toml, structure
from dsis.noise import Segments, read_noise, shot_noise

Row = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Signal = Annotated[float, Field(gt=0, le=1e30)]  # DN above black; single precision holds it
_MOST_BITS = 24  # of float32's significand


class Segment(Model):
    """One read-out path: variance = slope * x + intercept, x in DN above black."""

    upper_dn: Signal | None = None
    slope: Annotated[float, Field(ge=0, le=1e6)]
    intercept: Annotated[float, Field(ge=-1e12, le=1e12)]
    slope_se: NotNegative | None = None
    intercept_se: NotNegative | None = None


class BaseNoise(Model):
    """The base model's noise: the law of its shot noise, read-out segments in ascending order."""

    shot: Literal["gaussian", "poisson"] = "gaussian"
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
    bit_depth: Annotated[int, Field(ge=1)]
    saturation_dn: Signal | None = None
    diffuse_white_dn: Signal | None = None
    white_balance: tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    camera_from_scene: tuple[Row, Row, Row] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    noise: BaseNoise
    effect: tuple[any_effect(), ...] = ()  # type: ignore[valid-type] # the registry decides

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.bit_depth > _MOST_BITS:
            message = f"bit_depth is {self.bit_depth}, must be <= {_MOST_BITS}: frames are "
            message += "computed in single precision, which holds no longer codes exactly"
            raise ValueError(message)
        if not self.white_level.is_integer():
            message = f"white_level is {self.white_level}, must be a whole number: it is a code"
            raise ValueError(message)
        if self.white_level > 2**self.bit_depth - 1:
            message = f"white_level is {self.white_level}, must be <= {2**self.bit_depth - 1}: "
            message += f"the largest code of bit_depth = {self.bit_depth}"
            raise ValueError(message)
        if self.black_level >= self.white_level:
            message = f"black_level is {self.black_level}, must be below white_level "
            message += f"({self.white_level})"
            raise ValueError(message)
        if abs(np.linalg.det(np.array(self.camera_from_scene))) < 1e-6:
            message = "camera_from_scene must be invertible"
            raise ValueError(message)
        return self

    @model_validator(mode="after")
    def _effects_fit(self) -> Self:
        unfit = [
            f"effect[{i}] ({effect.kind}): {reason}"
            for i, effect in enumerate(self.effect)
            if (reason := effect.unfit_for(self.read_out))
        ]
        laws = Counter(law.kind for law in self._physics() if law.reshapes)
        unfit += [f"{kind} is given {n} times, must be once" for kind, n in laws.items() if n > 1]
        if unfit:
            raise ValueError("; ".join(unfit))
        return self

    @property
    def read_out(self) -> ReadOut:
        """What effects may know of the camera."""
        return ReadOut(self.cfa, self.segments, self.black_level, self.white_level)

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
        return balanced @ _scene_from_camera(self.camera_from_scene, self._scene_gain())

    def expose(
        self,
        clean: Image,
        temporal: Draw,
        sensor: Draw,
        frame: int,
        grid: PixelGrid,
        *,
        exposure_time_s: float | None = None,
        earlier_clean: Callable[[int], Image] | None = None,
        threads: int = 1,
        shared: Shared | None = None,
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
            Exposure time, s; effects that grow with it raise `InputError` where it is None.
        earlier_clean
            The clean signal k frames earlier, for effects that remember; None: a static scene.
        threads
            Threads that kernels may use.
        shared
            What the frame has in common with other cameras': see `Shared`.
        """
        if exposure_time_s is None:
            self._refuse_growth()
        time_s = exposure_time_s or 0.0
        shutter = Shutter(clean, frame, grid, time_s, earlier_clean, threads)
        return shutter.through(self.drawn(temporal, sensor), shared)

    def drawn(self, temporal: Draw, sensor: Draw) -> Drawn:
        """Return what `expose` sends frames through, for who exposes many with the same fields."""
        return Drawn.of(*_readied(self), temporal, sensor)

    def chain(self) -> tuple[Effect, ...]:
        """Return all links, base model included, in the order that light and charge meet them."""
        physics = self._physics()
        base = (
            ShotNoise(laws=tuple(law for law in physics if law.reshapes == "shot_noise")),
            ReadNoise(laws=tuple(law for law in physics if law.reshapes == "read_noise")),
            Conversion(),
        )
        full = () if self.saturation_dn is None else (FullWell(saturation_dn=self.saturation_dn),)
        return tuple(sorted((*base, *full, *physics), key=_place))

    def _physics(self) -> tuple[Effect, ...]:
        """Return the effects, what `noise.shot` asks for among them."""
        poisson = (PoissonShotNoise(),) if self.noise.shot == "poisson" else ()
        return tuple(sorted((*poisson, *self.effect), key=_place))

    def _refuse_growth(self) -> None:
        """Raise where an effect needs the exposure time and nobody gave one."""
        fact = "grows with the exposure time, which is not given"
        faults = [
            Fault(self.name, f"effect[{i}] ({effect.kind})", fact)
            for i, effect in enumerate(self.effect)
            if effect.grows_with_time
        ]
        if faults:
            raise InputError(faults)

    def _scene_gain(self) -> float:
        if self.diffuse_white_dn is None:
            message = f"the camera '{self.name}' has no diffuse_white_dn: no scene can be exposed"
            raise ValueError(message)
        return self.diffuse_white_dn


def _readied(camera: Camera) -> tuple[tuple[Effect, ...], ReadOut]:
    """Return links and read-out of a camera: to make them takes as long as a small frame."""
    try:
        return _kept_ready(camera)
    except TypeError:  # the maps of a sensor are arrays, which have no hash
        return camera.chain(), camera.read_out


@lru_cache(maxsize=64)
def _kept_ready(camera: Camera) -> tuple[tuple[Effect, ...], ReadOut]:
    return camera.chain(), camera.read_out


@lru_cache(maxsize=16)
def _scene_from_camera(camera_from_scene: tuple[Row, Row, Row], gain: float) -> Image:
    """Return what rows of pixels are multiplied with on the right: M inverted, over the gain."""
    matrix = np.linalg.inv(np.array(camera_from_scene)) / gain
    return matrix.T.astype(np.float32)


def _place(link: Effect) -> tuple[int, int, str]:
    """Return where a link stands in the chain."""
    return link.stage, link.rank, link.kind


@dataclass(frozen=True)
class _Reshaped(Draw):
    """Fields whose normal deviates go through laws before a base link scales them."""

    laws: tuple[Effect, ...] = ()
    exposure: Exposure | None = None

    @classmethod
    def of(cls, exposure: Exposure, laws: tuple[Effect, ...], expected: Image) -> Draw:
        """Return the temporal fields of `exposure`, reshaped if there are laws."""
        draw = exposure.temporal
        if not laws:
            return draw
        return cls(draw.seed, draw.scope, laws, exposure._replace(expected_dn=expected))

    def normal_rows(
        self, purpose: str, grid: PixelGrid, frame: int, first: int, last: int
    ) -> Image:
        """Return rows first..last-1 of the deviates, after all laws."""
        deviates = super().normal_rows(purpose, grid, frame, first, last)
        whole = self.exposure
        if whole is None:
            return deviates
        expected = whole.expected_dn[first:last]
        block = whole._replace(grid=grid.block(first, last), expected_dn=expected)
        for law in self.laws:
            deviates = law.reshape(deviates, block)
        return deviates


class BaseLink(Effect):
    """A link of the base model: no effect of the vocabulary."""

    laws: tuple[Effect, ...] = ()
    reference: ClassVar[str] = (
        "Seybold et al., CIC 22, 2014, section 'Camera noise characteristics'"
    )
    confounders: ClassVar[str] = ""


class ShotNoise(BaseLink):
    """Shot noise of variance m x: the first thing that happens to charge."""

    kind: str = "shot_noise"
    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = -100
    measures: ClassVar[frozenset[str]] = frozenset({"pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the noise of the expected signal."""
        e = exposure
        draw = _Reshaped.of(e, self.laws, image)
        return shot_noise(image, e.read_out.segments, draw, e.grid, e.frame, e.threads)


class FullWell(BaseLink):
    """Charge stops growing at the camera's `saturation_dn`: shot noise ends there, too."""

    kind: str = "full_well"
    saturation_dn: Positive
    stage: ClassVar[Stage] = Stage.CHARGE
    responds: ClassVar[bool] = True
    measures: ClassVar[frozenset[str]] = frozenset(
        {"level", "pixel_variance", "skewness", "kurtosis"}
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Cut charge, shot noise included, at the full well."""
        del exposure
        return np.minimum(image, np.float32(self.saturation_dn))


class ReadNoise(BaseLink):
    """Read noise of variance t: the first thing that the read-out adds."""

    kind: str = "read_noise"
    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -100
    measures: ClassVar[frozenset[str]] = frozenset({"pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the noise of the read-out path that the expected signal selects."""
        e = exposure
        draw = _Reshaped.of(e, self.laws, e.expected_dn)
        return read_noise(
            image, e.expected_dn, e.read_out.segments, draw, e.grid, e.frame, e.threads
        )


class Conversion(BaseLink):
    """The converter: rounds to whole codes and clips at both ends; the last link."""

    kind: str = "conversion"
    stage: ClassVar[Stage] = Stage.CODE
    rank: ClassVar[int] = 100
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Return whole codes less black; values below black stay negative."""
        return converted(image, exposure.read_out.black_level_dn, exposure.read_out.white_level_dn)


def read_camera(path: Path) -> Camera:
    """Return the camera model in a TOML file; raise `InputError` with all its faults."""
    return structure(Camera, read_toml(path), str(path))


def write_camera(camera: Camera, path: Path) -> None:
    """Write a camera model as TOML; `read_camera` returns an equal one."""
    path.write_bytes(tomli_w.dumps(camera_values(camera)).encode())


def camera_values(camera: Camera) -> dict[str, Any]:
    """Return a camera model as plain values, as TOML and manifests hold it."""
    return dict(camera.model_dump(mode="json", by_alias=True, exclude_none=True))
