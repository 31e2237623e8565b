"""`recording.toml`: what lies in a folder of raw frames."""

import glob
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import tomli_w
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from dsis.errors import Fault
from dsis.imagefile import natural_order
from dsis.model import Model, attempt, read_toml
from dsis.recording.listing import NAMED, Listed, Listing, absolute, counted
from dsis.recording.model import ExposurePlan, Kind, RecordedExposure, Sensor

RECORDING = "recording.toml"
SCHEMA: Literal["dsis-recording/1"] = "dsis-recording/1"


def _listed(value: object) -> object:
    if isinstance(value, str):
        return (value,)
    return tuple(value) if isinstance(value, list) else value


def _positive(time_s: float) -> float:
    if not time_s > 0:
        message = f"is {time_s}, must be greater than 0: give the time that the camera was set to, "
        message += "for bias frames the shortest that it has"
        raise ValueError(message)
    return time_s


class Entry(Model):
    """One `[[exposure]]`; attributes as those of `RecordedExposure`, frames as paths or a glob."""

    name: Annotated[str, Field(min_length=1)]
    kind: Kind
    exposure_time_s: Annotated[float, AfterValidator(_positive)]
    light: Annotated[float, Field(ge=0)] | None = None
    frames: Annotated[tuple[str, ...], BeforeValidator(_listed), Field(min_length=1)]

    @model_validator(mode="after")
    def _lit(self) -> Self:
        if self.light and self.kind == "dark":
            message = f"light is {self.light:g}, must be 0 or absent: the exposure is dark"
            raise ValueError(message)
        if self.light == 0 and self.kind != "dark":
            message = f"light is 0, must be greater than 0 in a {self.kind}, or absent: unknown"
            raise ValueError(message)
        return self


class RecordingFile(Model):
    """The whole file."""

    schema_: Annotated[Literal["dsis-recording/1"], Field(alias="schema")] = SCHEMA
    sensor: Sensor
    exposure: Annotated[tuple[Entry, ...], Field(min_length=1)]


def read_listing(path: Path) -> Listing:
    """Return what `recording.toml` lists; raise `InputError` only where it is no TOML at all."""
    values = read_toml(path)
    file, found = attempt(RecordingFile, values, str(path))
    faults = _said_once(found)
    if isinstance(file, RecordingFile):
        sensor, entries = file.sensor, list(enumerate(file.exposure))
    else:
        # The frames of sound entries are looked at nevertheless: all faults in one message.
        sensor = attempt(Sensor, values.get("sensor"), "")[0]
        entries = list(_sound_entries(values))
    listed = []
    for number, entry in entries:
        place = f"exposure[{number}].frames"
        frames, missing = _frames(path, entry, place)
        faults += missing
        exposure = RecordedExposure(
            entry.name, entry.kind, entry.exposure_time_s, entry.light, frames
        )
        listed.append(Listed(place, exposure))
    return Listing(path, sensor, tuple(listed), None, tuple(faults))


def write_listing(
    path: Path, sensor: Sensor, exposures: Mapping[str, tuple[ExposurePlan, str]]
) -> None:
    """Write `recording.toml`: `exposures` by name, each with the glob of its frames."""
    entries = [
        {"name": plan.name, "kind": plan.kind, "exposure_time_s": plan.exposure_time_s}
        | ({} if plan.light is None else {"light": plan.light})
        | {"frames": frames}
        for plan, frames in exposures.values()
    ]
    values = {"schema": SCHEMA, "sensor": sensor.model_dump(mode="json"), "exposure": entries}
    path.write_bytes(tomli_w.dumps(values).encode())


def _sound_entries(values: Mapping[str, Any]) -> Iterator[tuple[int, Entry]]:
    given = values.get("exposure")
    for number, entry in enumerate(given if isinstance(given, list) else []):
        found = attempt(Entry, entry, "")[0]
        if isinstance(found, Entry):
            yield number, found


def _said_once(faults: Sequence[Fault]) -> list[Fault]:
    """Return faults of which many exposures have the same, a misspelt key say, once."""
    alike: dict[tuple[str, str], list[Fault]] = defaultdict(list)
    for fault in faults:
        alike[re.sub(r"^exposure\[\d+\]", "exposure", fault.key), fault.fact].append(fault)
    return [fault for same in alike.values() for fault in counted(same, "such exposures")]


def _frames(file: Path, entry: Entry, key: str) -> tuple[tuple[Path, ...], list[Fault]]:
    """Return the files of an entry, each glob in natural order, and what is missing."""
    folder, found, faults, missing = file.parent, [], [], []
    for name in entry.frames:
        path = absolute(folder, name)
        if path.is_file():
            found.append(path)
        elif glob.has_magic(name):
            hits = glob.glob(name, root_dir=folder, recursive=True)  # noqa: PTH207 - `Path.glob` takes no absolute patterns
            paths = [p for p in (absolute(folder, hit) for hit in hits) if p.is_file()]
            found += sorted(paths, key=natural_order)
            if not paths:
                faults.append(Fault(str(file), key, f"{name!r} matches no file"))
        else:
            missing.append(Fault(str(file), key, f"{name!r} is missing"))
    return tuple(found), [*faults, *counted(missing, "missing frames", NAMED)]
