"""Reading a test spec: all faults in one message."""

import json
import re
from collections.abc import Mapping
from collections.abc import Sequence as Many
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from dsis.camera import Camera
from dsis.errors import Fault, InputError
from dsis.imagefile import find_files
from dsis.model import attempt, read_toml
from dsis.spec.checked import Test
from dsis.spec.fits import misfits, too_long
from dsis.spec.footage import footage_of, still_name
from dsis.spec.schema import SEED_MAX, SOLVED_SIGMA_MAX, CameraChoice, Spec

# Beside the packages, in a checkout as in an installation.
SHIPPED = Path(__file__).resolve().parents[2] / "stimuli_specs"

Sigmas = dict[str, dict[str, Annotated[float, Field(ge=0, le=SOLVED_SIGMA_MAX)]]]


def spec_path(name: str | Path) -> Path:
    """Return the file of a spec or camera: as given, or of that name among those shipped."""
    path = Path(name)
    shipped = SHIPPED / name
    try:
        return path if path.exists() or not shipped.is_file() else shipped
    except OSError:  # a name longer than file systems take: reading it says so
        return path


def read_spec(name: str | Path, source: Many[str | Path] = (), seed: int | None = None) -> Test:
    """Return the test that a spec describes; raise `InputError` with every fault in it.

    Parameters
    ----------
    name
        A TOML file, one of those shipped with dsis (`seybold.toml`), or a `manifest.json`: the same
        stimuli again, with the white noise that it has solved unless `source` or `seed` is given.
    source
        Image files, globs or folders that take the place of the spec's contents, from the current
        folder.
    seed
        Takes the place of the spec's seed.
    """
    path = spec_path(name)
    values, sigma = _values(path)
    if source or seed is not None:
        values |= _overrides(values, source, seed)
        sigma = {}  # solved for other noise, or on other footage
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
        faults += misfits(sections["content"], sections["sequence"], folder, str(path))
    if sections.get("session") and sections.get("sequence"):
        faults += too_long(sections["session"], sections["sequence"], str(path))
    if faults or camera is None:
        raise InputError(faults)
    spec = Spec.model_construct(**sections)
    footage = [found for content in spec.content for found in footage_of(content, folder)]
    return Test(spec, camera, folder, {found.name: found for found in footage}, sigma)


def _names() -> list[str]:
    return [field.alias or key for key, field in Spec.model_fields.items()]


def _values(path: Path) -> tuple[dict[str, Any], dict[tuple[str, int], float]]:
    """Return what a spec or the spec inside a manifest holds, and the sigmas that are solved."""
    if path.suffix != ".json":
        return read_toml(path), {}
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        values = dict(manifest["spec"])
        solved, faults = attempt(Sigmas, manifest["awgn_sigma"], str(path), "awgn_sigma")
        if faults:
            raise InputError(faults)
        sigma = {(name, int(n)): s for name, per in solved.items() for n, s in per.items()}
    except OSError as error:
        raise InputError.of(path, "", f"cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
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
    try:
        file = beside if beside.exists() else spec_path(model)
        found = file.is_file()
    except OSError:  # longer than file systems take
        found = False
    if not found:
        shipped = sorted(p.name for p in SHIPPED.glob("cameras/*.toml"))
        shown = model if len(model) <= 60 else model[:57] + "..."
        fact = f"is {shown!r}: no such file, neither from {path.parent.resolve()} nor shipped"
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


def _overrides(
    values: Mapping[str, Any], source: Many[str | Path], seed: int | None
) -> dict[str, Any]:
    """Return the values that options of the command line put in the place of the spec's."""
    found: dict[str, Any] = {}
    if seed is not None:
        if not 0 <= seed <= SEED_MAX:
            raise InputError.of("--seed", "", f"is {seed}, must be from 0 to {SEED_MAX}")
        found["seed"] = seed
    if source:
        _check_source(source)
        found["content"] = _replaced(values.get("content"), source)
    return found


def _check_source(source: Many[str | Path]) -> None:
    empty = [str(s) for s in source if not find_files(Path.cwd(), [str(s)])]
    if empty:
        raise InputError(
            Fault("--source", "", f"is {name!r}: no image file found there") for name in empty
        )


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
