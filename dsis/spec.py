"""A test spec: one TOML file = one subjective test (`dsis-test/1`)."""

import json
import re
from collections import Counter
from collections.abc import Mapping
from collections.abc import Sequence as Many
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from dsis.camera import Camera
from dsis.color import Color
from dsis.demosaic import METHODS
from dsis.errors import Fault, InputError
from dsis.imagefile import find_files, info
from dsis.model import Model, attempt, read_toml
from dsis.optics import Optics
from dsis.scenes import SCENES
from dsis.visibility import Viewing

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Seed = Annotated[int, Field(ge=0)]
Format = Literal["player", "png8", "tiff16", "dpx16", "exr"]
Noise = Literal["awgn", "sd"]

# Beside the packages, in a checkout as in an installation.
SHIPPED = Path(__file__).resolve().parents[1] / "stimuli_specs"

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


def spec_path(name: str | Path) -> Path:
    """Return the file of a spec or camera: as given, or of that name among those shipped."""
    path = Path(name)
    if path.exists() or path.is_absolute():
        return path
    shipped = SHIPPED / name
    return shipped if shipped.is_file() else path


def read_spec(name: str | Path, source: Many[str | Path] = (), seed: int | None = None) -> Test:
    """Return the test that a spec describes; raise `InputError` with every fault in it.

    Parameters
    ----------
    name
        A TOML file, one of those shipped with dsis (`seybold.toml`), or a `manifest.json`: the same
        stimuli again.
    source
        Image files, globs or folders that take the place of the spec's contents, from the current
        folder.
    seed
        Takes the place of the spec's seed.
    """
    path = spec_path(name)
    values, sigma = _values(path)
    if seed is not None:
        values["seed"] = seed
    if source:
        values["content"] = _replaced(values.get("content"), source)
    faults: list[Fault] = []
    camera = _camera(values.get("camera"), path, faults)
    sections: dict[str, Any] = {}
    for key, field in Spec.model_fields.items():
        name_in_file = field.alias or key
        if key == "camera" and camera is not None and "schema" in values["camera"]:
            sections[key] = CameraChoice(model=camera.name)
        elif name_in_file in values:
            kind = (
                Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
            )
            sections[key], more = attempt(
                kind, values[name_in_file], str(path), name_in_file, path.parent.resolve()
            )
            faults += more
        elif field.is_required():
            faults.append(Fault(str(path), name_in_file, "is missing"))
        else:
            sections[key] = field.default
    faults += [
        Fault(str(path), key, f"unknown key (allowed here: {', '.join(_names())})")
        for key in values
        if key not in _names()
    ]
    folder = path.parent.resolve()
    if sections.get("content") and sections.get("sequence"):
        faults += _misfits(sections["content"], sections["sequence"], folder, str(path))
    if sections.get("session") and sections.get("sequence"):
        faults += _too_long(sections["session"], sections["sequence"], str(path))
    if faults or camera is None:
        raise InputError(faults)
    test = Test(Spec.model_construct(**sections), camera, folder, {}, sigma)
    footage = {c.name or "": _footage(c, folder) for c in test.contents()}
    return replace(test, footage={name: paths for name, paths in footage.items() if paths})


def _names() -> list[str]:
    return [field.alias or key for key, field in Spec.model_fields.items()]


def _values(path: Path) -> tuple[dict[str, Any], dict[tuple[str, int], float]]:
    """Return what a spec or the spec inside a manifest holds, and the sigmas that are solved."""
    if path.suffix != ".json":
        return read_toml(path), {}
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        values = dict(manifest["spec"])
        solved = manifest["awgn_sigma"]
        sigma = {(name, int(n)): float(s) for name, per in solved.items() for n, s in per.items()}
    except OSError as error:
        raise InputError.of(path, "", f"cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        fact = "holds no spec to build from: only manifests that `dsis stimuli` wrote do"
        raise InputError.of(path, "spec", fact) from None
    return values, sigma


def _camera(section: object, path: Path, faults: list[Fault]) -> Camera | None:
    """Return the camera of the section: a file, or the whole model as manifests hold it."""
    if not isinstance(section, Mapping):
        return None
    if "schema" in section:
        return _camera_of(section, str(path), "camera", faults)
    model = section.get("model")
    if not isinstance(model, str):
        return None  # the section's own fault
    beside = path.parent / model
    file = beside if beside.exists() else spec_path(model)
    if not file.is_file():
        shipped = sorted(p.name for p in SHIPPED.glob("cameras/*.toml"))
        fact = f"is {model!r}: no such file, neither from {path.parent.resolve()} nor shipped"
        faults.append(Fault(str(path), "camera.model", f"{fact} (cameras/: {', '.join(shipped)})"))
        return None
    try:
        values = read_toml(file)
    except InputError as error:
        faults += error.faults
        return None
    return _camera_of(values, str(file), "", faults)


def _camera_of(
    values: Mapping[str, Any], file: str, prefix: str, faults: list[Fault]
) -> Camera | None:
    """Return a camera that can make stimuli; its faults go into `faults`."""
    camera, more = attempt(Camera, values, file, prefix)
    faults += more
    if not isinstance(camera, Camera):
        return None
    if camera.cfa == "MONO":
        faults.append(Fault(file, "cfa", "is MONO: stimuli need a colour filter array"))
    if camera.diffuse_white_dn is None:
        faults.append(Fault(file, "diffuse_white_dn", "is missing: stimuli need it"))
    return camera


def _replaced(contents: object, source: Many[str | Path]) -> list[dict[str, Any]]:
    """Return the contents that the user's files make: as the spec's first content treats files."""
    first = contents[0] if isinstance(contents, list) and contents else {}
    first = dict(first) if isinstance(first, Mapping) else {}
    paths = [str(Path(s).expanduser().resolve()) for s in source]
    kept = {key: first[key] for key in ("pan_px_per_frame", "oversampling") if key in first}
    if "scene" in first:
        kept.pop("oversampling", None)
    elif "encoding" in first:
        kept["encoding"] = first["encoding"]
    if "stills" in first:
        return [{**kept, "stills": paths}]
    stem = re.sub(r"[\d*?\[\]]+$", "", Path(paths[0]).stem)
    return [{**kept, "name": still_name(Path(stem or "footage")), "files": paths}]


def _footage(content: Content, folder: Path) -> tuple[Path, ...]:
    if content.stills is not None:
        return tuple(p for p in find_files(folder, content.stills) if still_name(p) == content.name)
    return find_files(folder, content.files or ())


def _misfits(
    contents: tuple[Content, ...], sequence: Sequence, folder: Path, file: str
) -> list[Fault]:
    """Return the faults of footage that is too small or too short, and of doubled names."""
    faults = []
    names: Counter[str] = Counter()
    for i, content in enumerate(contents):
        for key in ("files", "stills"):
            paths = find_files(folder, getattr(content, key) or ())
            at = f"content[{i}].{key}"
            names.update({still_name(p): 1 for p in paths} if key == "stills" and paths else {})
            still = key == "stills" or len(paths) == 1
            if paths and not still and len(paths) < sequence.frames:
                fact = f"{len(paths)} frames found, sequence needs {sequence.frames}"
                faults.append(Fault(file, at, fact))
            faults += _too_small(paths if still else paths[:1], content, sequence, still, file, at)
        names.update([content.name] if content.name and content.stills is None else [])
    twice = [name for name, count in names.items() if count > 1]
    faults += [Fault(file, "content", f"two contents have the name {name!r}") for name in twice]
    return faults


def _too_small(
    paths: tuple[Path, ...], content: Content, sequence: Sequence, still: bool, file: str, key: str
) -> list[Fault]:
    faults: list[Fault] = []
    scale = content.oversampling or 1
    travel = abs(content.pan_px_per_frame) * (sequence.frames - 1) if still else 0.0
    rows, columns = scale * sequence.height, int(-(-scale * (sequence.width + travel) // 1))
    for path in paths:
        try:
            found = info(path)
        except InputError as error:
            faults += error.faults
            continue
        if found.rows < rows or found.columns < columns:
            fact = f"{path.name} is {found.columns}x{found.rows} pixels, must be {columns}x{rows} "
            fact += f"or more ({scale} x sequence {sequence.width}x{sequence.height}"
            fact += f" + a pan of {travel:g})" if travel else ")"
            faults.append(Fault(file, key, fact))
    return faults


def _too_long(session: Session, sequence: Sequence, file: str) -> list[Fault]:
    return [
        Fault(
            file,
            f"session.{key}",
            f"is {value:g} s, must be <= sequence.seconds = {sequence.seconds:g}",
        )
        for key, value in (("reference_s", session.reference_s), ("test_s", session.test_s))
        if value > sequence.seconds
    ]
