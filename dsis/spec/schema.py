"""A test spec: one TOML file = one subjective test (`dsis-test/1`)."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from dsis.camera import Camera
from dsis.color import Color
from dsis.demosaic import METHODS
from dsis.imagefile import find_files
from dsis.model import Model
from dsis.optics import Optics
from dsis.scenes import SCENES
from dsis.visibility import Viewing

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Seed = Annotated[int, Field(ge=0)]
Format = Literal["player", "png8", "tiff16", "dpx16", "exr"]
Noise = Literal["awgn", "sd"]

TRAINING = "training"  # the content of the training presentations; no content of a test has it

NAME = re.compile(r"[A-Za-z0-9]+(?:[-_.]?[A-Za-z0-9]+)*")
Globs = Annotated[
    tuple[str, ...],
    BeforeValidator(lambda globs: (globs,) if isinstance(globs, str) else tuple(globs)),
]
FILE_NAME_RULE = "letters, digits and single '-', '_' or '.' between them"


class Sequence(Model):
    """Size and duration of every clip."""

    width: Annotated[int, Field(ge=8)]
    height: Annotated[int, Field(ge=8)]
    fps: Positive
    seconds: Positive

    @property
    def frames(self) -> int:
        """Number of frames of a clip."""
        return max(1, round(self.fps * self.seconds))


class Content(Model):
    """What is seen: a rendered scene, a numbered sequence or one still, or many stills.

    Attributes
    ----------
    name
        Name of the content; with `stills` each file's name takes its place.
    scene, scene_seed
        A scene that dsis renders, and its seed.
    files
        Globs of a numbered sequence in natural order, or one still; from the spec's folder.
    stills
        Globs of stills: every file is a content of its own.
    encoding
        `linear` or `display`; without it floating-point files are linear, integer ones display.
    pan_px_per_frame
        Speed at which the window moves to the right, in sensor pixels; any fraction.
    oversampling
        Source pixels per sensor pixel along each axis; scenes are rendered at 2.
    """

    name: str | None = None
    scene: str | None = None
    scene_seed: Seed = 1
    files: Globs | None = None
    stills: Globs | None = None
    encoding: Literal["linear", "display"] | None = None
    pan_px_per_frame: float = 0.0
    oversampling: Annotated[int, Field(ge=1, le=8)] | None = None

    @field_validator("name")
    @classmethod
    def _is_name(cls, name: str | None) -> str | None:
        if name is not None and not NAME.fullmatch(name):
            message = f"is {name!r}, must be {FILE_NAME_RULE}"
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
    """Level of the white noise: given, or matched once per content and level to `sd_rgb`."""

    match: Literal["psnr", "visibility"] | None = None
    sigma: NotNegative | None = None

    @model_validator(mode="after")
    def _one_rule(self) -> Self:
        if (self.match is None) == (self.sigma is None):
            message = "needs exactly one of: match (psnr, visibility), sigma (8-bit codes)"
            raise ValueError(message)
        return self


class Conditions(Model):
    """Which noise, demosaicking and levels are crossed."""

    noise: Annotated[tuple[Noise, ...], Field(min_length=1)] = ("awgn", "sd")
    demosaic: Annotated[tuple[str, ...], Field(min_length=1)] = ("none", "bilinear")
    levels: Annotated[tuple[Annotated[int, Field(ge=0, le=16)], ...], Field(min_length=1)] = (0,)

    @field_validator("demosaic")
    @classmethod
    def _known(cls, methods: tuple[str, ...]) -> tuple[str, ...]:
        allowed = ("none", *METHODS)
        unknown = [repr(method) for method in methods if method not in allowed]
        if unknown:
            message = f"unknown demosaicker {', '.join(unknown)}, must be of: {', '.join(allowed)}"
            raise ValueError(message)
        return methods

    @field_validator("noise", "demosaic", "levels")
    @classmethod
    def _once(cls, values: tuple[Any, ...]) -> tuple[Any, ...]:
        twice = [str(value) for value, count in Counter(values).items() if count > 1]
        if twice:
            message = f"named twice: {', '.join(twice)}"
            raise ValueError(message)
        return values


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
    formats: Annotated[tuple[Format, ...], Field(min_length=1)] = ("player",)
    sequence: Sequence
    viewing: Viewing = Viewing(diagonal_inch=23.0, distance_heights=3.0, peak_cd_m2=100.0)
    content: Annotated[tuple[Content, ...], Field(min_length=1)]
    camera: CameraChoice
    optics: Optics
    color: Color
    awgn: Awgn
    conditions: Conditions
    session: Session = Session()


@dataclass(frozen=True)
class Test:
    """A test spec with everything that it refers to, checked.

    Attributes
    ----------
    spec
        The spec; paths in it count from `folder`.
    camera
        The camera model it names.
    folder
        Folder that holds the spec.
    footage
        Files of every content that has any, by the content's name; stills are one content each.
    sigma
        White noise in 8-bit codes that a manifest has solved, by content and level; else empty.
    """

    __test__ = False  # no test case, whatever the name says to a test runner

    spec: Spec
    camera: Camera
    folder: Path
    footage: Mapping[str, tuple[Path, ...]]
    sigma: Mapping[tuple[str, int], float]

    def contents(self) -> tuple[Content, ...]:
        """Return the contents, each still on its own."""
        found: list[Content] = []
        for content in self.spec.content:
            if content.stills is None:
                found.append(content)
            else:
                names = [still_name(path) for path in find_files(self.folder, content.stills)]
                found += [content.model_copy(update={"name": name}) for name in names]
        return tuple(found)


def still_name(path: Path) -> str:
    """Return the content's name of a still: its file's, with what no name may hold replaced."""
    return re.sub(r"[^A-Za-z0-9]+", "-", path.stem).strip("-") or "still"
