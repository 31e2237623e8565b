"""A test spec: one TOML file = one subjective test (`dsis-test/1`)."""

import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from dsis.color import Color
from dsis.demosaic import METHODS
from dsis.imagefile import find_files
from dsis.model import Model
from dsis.optics import Optics
from dsis.scenes import SCENES
from dsis.visibility import Viewing

Positive = Annotated[float, Field(gt=0)]
SEED_MAX = 2**63 - 1  # what SQLite and JSON readers hold
Seed = Annotated[int, Field(ge=0, le=SEED_MAX)]
Size = Annotated[int, Field(ge=8, le=32768)]
Format = Literal["player", "png8", "tiff16", "dpx16", "exr"]
Noise = Literal["awgn", "sd"]

FRAMES_MAX = 10**6
LEVEL_MAX = 16
SOLVED_SIGMA_MAX = 255.0 * 2**LEVEL_MAX  # 8-bit codes: the largest sigma that a level may have
SCENE_OVERSAMPLING = 2
TRAINING = "training"  # the content of the training presentations; no content of a test has it

NAME = re.compile(r"[A-Za-z0-9]+(?:[-_.]?[A-Za-z0-9]+)*")
NAME_MAX = 64  # a stimulus' name adds its condition, and file systems end at 255
FILE_NAME_RULE = "letters, digits and single '-', '_' or '.' between them"


def _listed(globs: object) -> object:
    """Return one glob as a tuple of one; refuse what names no files at all."""
    listed = [globs] if isinstance(globs, str) else globs
    if not isinstance(listed, list) or not all(isinstance(g, str) and g for g in listed):
        message = f"is {globs!r}, must be a file, folder or glob in quotes, or a list of them"
        raise ValueError(message)
    return tuple(listed)


def _once(values: tuple[Any, ...]) -> tuple[Any, ...]:
    twice = [str(value) for value, count in Counter(values).items() if count > 1]
    if twice:
        message = f"named twice: {', '.join(twice)}"
        raise ValueError(message)
    return values


Globs = Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(_listed)]
Once = AfterValidator(_once)


class Sequence(Model):
    """Size and duration of every clip."""

    width: Size
    height: Size
    fps: Annotated[float, Field(ge=0.01, le=1000)]
    seconds: Positive

    @model_validator(mode="after")
    def _countable(self) -> Self:
        if self.fps * self.seconds > FRAMES_MAX:
            frames = f"{self.fps:g} x {self.seconds:g} = {self.fps * self.seconds:g}"
            message = f"fps x seconds is {frames} frames, must be at most {FRAMES_MAX}"
            raise ValueError(message)
        return self

    @property
    def frames(self) -> int:
        """Number of frames of a clip."""
        return max(1, round(self.fps * self.seconds))


class Content(Model):
    """What is seen: a rendered scene, a numbered sequence or one still, or many stills.

    Attributes
    ----------
    name
        Name of the content, at most 64 characters; with `stills` each file's takes its place.
    scene, scene_seed
        A scene that dsis renders, and its seed.
    files
        Globs of a numbered sequence in natural order, or one still; from the spec's folder. Many
        files are a sequence, a single one is a still.
    stills
        Globs of stills: every file is a content of its own.
    encoding
        `linear` or `display`; without it floating-point files are linear, integer ones display.
    pan_px_per_frame
        Speed at which the window over a scene or still moves to the right (negative: to the left),
        in sensor pixels; any fraction. Sequences are not panned.
    oversampling
        Source pixels per sensor pixel along each axis; scenes are rendered at 2.
    """

    name: str | None = None
    scene: str | None = None
    scene_seed: Seed = 1
    files: Globs | None = None
    stills: Globs | None = None
    encoding: Literal["linear", "display"] | None = None
    pan_px_per_frame: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    oversampling: Annotated[int, Field(ge=1, le=8)] | None = None

    @field_validator("name")
    @classmethod
    def _is_name(cls, name: str | None) -> str | None:
        if name is not None and not NAME.fullmatch(name):
            message = f"is {name!r}, must be {FILE_NAME_RULE}"
            raise ValueError(message)
        if name is not None and len(name) > NAME_MAX:
            message = f"is {name[:20]!r}... of {len(name)} characters, must have at most {NAME_MAX}"
            raise ValueError(message)
        return name

    @field_validator("scene")
    @classmethod
    def _is_scene(cls, scene: str | None) -> str | None:
        if scene is not None and scene not in SCENES:
            message = f"is {scene!r}, must be one of: {', '.join(SCENES)}"
            raise ValueError(message)
        return scene

    @field_validator("files", "stills")
    @classmethod
    def _are_there(cls, globs: Globs | None, info: ValidationInfo) -> Globs | None:
        if isinstance(info.context, Path):
            empty = [glob for glob in globs or () if not find_files(info.context, [glob])]
            if empty:
                shown = ", ".join(repr(glob) for glob in empty)
                message = f"is {shown}: no image file found there (looked from {info.context})"
                raise ValueError(message)
        return globs

    @property
    def scale(self) -> int:
        """Source pixels per sensor pixel along each axis."""
        return self.oversampling or (SCENE_OVERSAMPLING if self.scene is not None else 1)

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        given = [key for key in ("scene", "files", "stills") if getattr(self, key) is not None]
        if len(given) != 1:
            message = "needs exactly one of: scene, files, stills"
            message += f" (has {' and '.join(given)})" if given else ""
            raise ValueError(message)
        if self.name is None and self.stills is None:
            message = "name is missing"
            raise ValueError(message)
        return self


class CameraChoice(Model):
    """The camera of the test: a `camera.toml`, from the spec's folder or shipped with dsis."""

    model: str


class Awgn(Model):
    """Level of the white noise: given, or matched once per content and level to `sd_rgb`.

    Attributes
    ----------
    match
        `psnr` or `visibility`: sigma is solved per content and level.
    sigma
        Standard deviation at level 0, 8-bit codes. Level n has sigma x 2^n: the signal is divided
        by 2^n before the noise and multiplied back after.
    """

    match: Literal["psnr", "visibility"] | None = None
    sigma: Annotated[float, Field(ge=0, le=255)] | None = None

    @model_validator(mode="after")
    def _one_rule(self) -> Self:
        if (self.match is None) == (self.sigma is None):
            message = "needs exactly one of: match (psnr, visibility), sigma (8-bit codes)"
            raise ValueError(message)
        return self


class Conditions(Model):
    """Which noise, demosaicking and levels are crossed."""

    noise: Annotated[tuple[Noise, ...], Field(min_length=1), Once] = ("awgn", "sd")
    demosaic: Annotated[tuple[str, ...], Field(min_length=1), Once] = ("none", "bilinear")
    levels: Annotated[
        tuple[Annotated[int, Field(ge=0, le=LEVEL_MAX)], ...], Field(min_length=1), Once
    ] = (0,)

    @field_validator("demosaic")
    @classmethod
    def _known(cls, methods: tuple[str, ...]) -> tuple[str, ...]:
        allowed = ("none", *METHODS)
        unknown = [repr(method) for method in methods if method not in allowed]
        if unknown:
            message = f"unknown demosaicker {', '.join(unknown)}, must be of: {', '.join(allowed)}"
            raise ValueError(message)
        return methods


class Session(Model):
    """The DSIS session, BT.500 terms: times in seconds."""

    variant: Literal["I", "II"] = "II"
    scale: tuple[int, int] = (1, 10)
    labels: tuple[str, str] = ("very annoying", "imperceptible")
    reference_s: Positive = 10.0
    grey_s: Positive = 3.0
    test_s: Positive = 10.0
    vote_s: Positive = 5.0
    repetitions: Annotated[int, Field(ge=1)] = 1
    dummies: Annotated[int, Field(ge=0)] = 3
    training: Annotated[int, Field(ge=0)] = 4
    session_minutes_max: Positive = 30
    observers: Annotated[int, Field(ge=1)] = 18
    hidden_references: bool = False
    consent: str = ""

    @field_validator("scale")
    @classmethod
    def _ascending(cls, scale: tuple[int, int]) -> tuple[int, int]:
        if scale[0] >= scale[1]:
            message = f"is {list(scale)}, must be [worst, best] with worst < best"
            raise ValueError(message)
        return scale


class Spec(Model):
    """A whole test, as `dsis stimuli SPEC.toml` reads it."""

    schema_: Annotated[Literal["dsis-test/1"], Field(alias="schema")]
    title: str = ""
    seed: Seed
    formats: Annotated[tuple[Format, ...], Field(min_length=1), Once] = ("player",)
    sequence: Sequence
    viewing: Viewing = Viewing(diagonal_inch=23.0, distance_heights=3.0, peak_cd_m2=100.0)
    content: Annotated[tuple[Content, ...], Field(min_length=1)]
    camera: CameraChoice
    optics: Optics
    color: Color
    awgn: Awgn
    conditions: Conditions
    session: Session = Session()
