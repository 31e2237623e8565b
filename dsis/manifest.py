"""`manifest.json` beside the stimuli: what each clip is, and enough to build the same bytes again.

A manifest may also be written by hand, for clips made elsewhere: `schema`, `sequence` and `clips`
(each with `stimulus`, `content`, `reference` and `files`) are enough to run a session.
"""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from dsis.errors import Fault, InputError
from dsis.model import Model, structure
from dsis.spec import Sequence, Session
from dsis.visibility import Viewing

MANIFEST = "manifest.json"
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Db = float | None  # None: no difference at all, an infinite ratio


class ClipFiles(Model):
    """One clip in one format.

    Attributes
    ----------
    path
        `player`: one file, frame after frame of rgb24, row by row. Otherwise a glob, one file per
        frame in natural order. From the manifest's folder.
    sha256
        Of all frames' bytes in order.
    frame_sha256
        Of each frame's bytes: its part of the player file, or its whole image file.
    """

    path: str
    sha256: Sha256 | None = None
    frame_sha256: tuple[Sha256, ...] = ()


class Quality(Model):
    """How a clip differs from its reference, frame by frame where it is a tuple.

    Attributes
    ----------
    psnr_db
        10 log10(255^2 / MSE) of the delivered 8-bit frames over all pixels and channels.
    psnr_float_db
        The same before clipping to 0..255 and rounding.
    psnr_demosaicked_db
        As `psnr_db`, against the demosaicked noise-free frame.
    visible_noise, visible_lightness, visible_colour
        Mean squared visible difference (S-CIELAB Delta E^2) over `visible_frames`, and its parts.
    base_psnr_db, base_visible_noise
        What the camera without its effects beyond the base model would give in `visible_frames`;
        absent where the camera has none, or the noise is not the camera's.
    """

    psnr_db: tuple[Db, ...] = ()
    psnr_float_db: tuple[Db, ...] = ()
    psnr_demosaicked_db: tuple[Db, ...] = ()
    visible_frames: tuple[int, ...] = ()
    visible_noise: float | None = None
    visible_lightness: float | None = None
    visible_colour: float | None = None
    base_psnr_db: tuple[Db, ...] = ()
    base_visible_noise: float | None = None


class Clip(Model):
    """One stimulus.

    Attributes
    ----------
    stimulus
        Unique name, `content__noise__demosaic__level`; references end in `__reference`.
    role
        `reference`, `test`, or `training` (shown before the test, never scored).
    reference
        Stimulus that is shown as its reference; None for references themselves.
    noise, demosaic, level
        The condition; None where it does not apply.
    awgn_sigma
        Standard deviation of the white noise in 8-bit codes.
    """

    stimulus: str
    content: str
    role: Literal["reference", "test", "training"] = "test"
    reference: str | None = None
    noise: str | None = None
    demosaic: str | None = None
    level: int | None = None
    awgn_sigma: float | None = None
    files: dict[str, ClipFiles]
    quality: Quality = Quality()


class Manifest(Model):
    """All stimuli of a test.

    Attributes
    ----------
    spec
        The spec as resolved, the camera model in full: builds the same bytes again.
    awgn_sigma
        The solved standard deviations of the white noise, 8-bit codes, by content and level.
    remarks
        What a reader of the results must know of the footage.
    versions
        Of dsis and of what the bytes depend on.
    """

    schema_: Annotated[Literal["dsis-manifest/1"], Field(alias="schema")]
    title: str = ""
    sequence: Sequence
    viewing: Viewing | None = None
    session: Session = Session()
    clips: Annotated[tuple[Clip, ...], Field(min_length=1)]
    remarks: tuple[str, ...] = ()
    spec: dict[str, Any] | None = None
    awgn_sigma: Mapping[str, dict[str, float]] = Field(default_factory=dict)
    versions: Mapping[str, str] = Field(default_factory=dict)

    def clip(self, stimulus: str) -> Clip:
        """Return the clip of that name; raise `KeyError` where there is none."""
        return next((c for c in self.clips if c.stimulus == stimulus), None) or _no(stimulus)


def _no(stimulus: str) -> Clip:
    raise KeyError(stimulus)


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest in `folder`; raise `InputError` with all its faults."""
    path = folder / MANIFEST
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = "holds no stimuli" if not path.exists() else f"cannot be read: {error.strerror}"
        raise InputError.of(path, "", reason) from None
    except ValueError as error:
        raise InputError.of(path, "", f"is not JSON: {error}") from None
    manifest = structure(Manifest, values, str(path))
    _check_references(manifest, path)
    return manifest


def write_manifest(manifest: Manifest, folder: Path) -> None:
    """Write `manifest.json` into `folder`."""
    values = manifest.model_dump(mode="json", by_alias=True, exclude_none=True)
    text = json.dumps(values, indent=1, ensure_ascii=False) + "\n"
    (folder / MANIFEST).write_text(text, encoding="utf-8")


def _check_references(manifest: Manifest, path: Path) -> None:
    faults = []
    names = Counter(clip.stimulus for clip in manifest.clips)
    roles = {clip.stimulus: clip.role for clip in manifest.clips}
    for i, clip in enumerate(manifest.clips):
        key = f"clips[{i}]"
        if names[clip.stimulus] > 1:
            faults.append(Fault(str(path), f"{key}.stimulus", f"{clip.stimulus} is there twice"))
        if clip.role != "reference" and roles.get(clip.reference or "") != "reference":
            fact = f"is {clip.reference!r}, must name a clip with role 'reference'"
            faults.append(Fault(str(path), f"{key}.reference", fact))
        for name, files in clip.files.items():
            if Path(files.path).is_absolute() or ".." in Path(files.path).parts:
                fact = f"is {files.path!r}, must stay inside the manifest's folder"
                faults.append(Fault(str(path), f"{key}.files.{name}.path", fact))
    if faults:
        raise InputError(faults)
