"""From files to files: a camera model and recordings in, a folder of results for each out."""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.mismatch.diagnose import VOCABULARY, find_mismatch
from analysis.mismatch.files import MARK, fill, finding_folder
from analysis.mismatch.finding import Finding
from dsis.camera import Camera, read_camera
from dsis.errors import Fault, InputError
from dsis.recording import Recording, read_recording
from dsis.simulate.maps import MAPS, SensorMaps, owner_of, read_maps

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Diagnosis:
    """The finding of one recording, and the folder that holds its files."""

    name: str
    folder: Path
    finding: Finding


def diagnose_recordings(
    camera_file: Path,
    recordings: Sequence[Path],
    out: Path,
    *,
    seed: int = 0,
    jobs: int = 1,
    without: Sequence[str] = (),
    progress: Progress | None = None,
) -> tuple[Diagnosis, ...]:
    """Compare recordings with a camera model; what is wrong with the input is said before work.

    Parameters
    ----------
    camera_file
        camera.toml; `maps.npz` beside it is used where it is of that camera.
    recordings
        Folders with a recording.toml, or EMVA 1288 descriptor files.
    out
        Of one recording: the folder of its results; of several: holds such a folder for each.
    seed
        Fixes every random number.
    jobs
        Threads.
    without
        Effects that must not be named.
    progress
        Told (done, total, doing).

    Raises
    ------
    InputError
        A file, an option or `out` cannot be used: all faults of files and options at once.
    """
    camera, opened = _read(camera_file, recordings, _unknown(without))
    allowed = VOCABULARY - set(without) if without else None
    maps = _maps(camera_file)
    folders = _folders(opened, out)
    found = []
    for (name, folder), recording in zip(folders.items(), opened, strict=True):

        def tell(done: int, total: int, doing: str, of: str = name) -> None:
            if progress is not None:
                progress(done, total, doing if len(opened) == 1 else f"{of}: {doing}")

        with finding_folder(folder) as partial:
            finding = find_mismatch(
                camera,
                recording,
                seed=seed,
                jobs=jobs,
                vocabulary=allowed,
                maps=maps,
                progress=tell,
            )
            fill(partial, finding, _origin(recording, camera_file, seed, without), maps)
        found.append(Diagnosis(name, folder, finding))
    return tuple(found)


def _unknown(names: Sequence[str]) -> list[Fault]:
    """Return what is wrong with names of effects."""
    faults = []
    for name in dict.fromkeys(names):
        if name not in VOCABULARY:
            near = difflib.get_close_matches(name, sorted(VOCABULARY), 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            fact = f"is {name!r}{hint}, must be one of: {', '.join(sorted(VOCABULARY))}"
            faults.append(Fault("--without", "", fact))
    return faults


def _read(
    camera_file: Path, recordings: Sequence[Path], faults: list[Fault]
) -> tuple[Camera, list[Recording]]:
    """Return the camera and the recordings, or raise every fault that any of the files has."""
    camera, opened = None, []
    try:
        camera = read_camera(camera_file)
    except InputError as error:
        faults += error.faults
    for path in recordings:
        try:
            recording = read_recording(path)
        except InputError as error:
            faults += error.faults
            continue
        opened.append(recording)
        if camera is not None:
            faults += _other_camera(camera, camera_file, recording, path)
    if camera is None or faults:
        raise InputError(faults)
    return camera, opened


def _other_camera(
    camera: Camera, camera_file: Path, recording: Recording, path: Path
) -> list[Fault]:
    """Return what says that a recording is not of this camera."""
    sensor = recording.sensor
    pairs = (
        ("sensor.cfa", sensor.cfa.value, camera.cfa.value),
        ("sensor.white_level", f"{sensor.white_level:g}", f"{camera.white_level:g}"),
    )
    return [
        Fault(str(path), key, f"is {found}, must be {wanted} as in {camera_file}")
        for key, found, wanted in pairs
        if found != wanted
    ]


def _maps(camera_file: Path) -> SensorMaps | None:
    """Return the maps beside a camera model; None where there are none, or another camera's."""
    path = camera_file.parent / MAPS
    if not path.is_file() or owner_of(path) not in (None, camera_file.name):
        return None
    return read_maps(camera_file)


def _folders(opened: Sequence[Recording], out: Path) -> dict[str, Path]:
    """Return where the results of each recording go, by a name that tells it from the others."""
    if len(opened) == 1:
        return {opened[0].folder.resolve().name: out}
    if (out / MARK).exists():
        fact = f"holds {MARK}, the result of one recording: give another folder for several"
        raise InputError.of(out, "", fact)
    names: list[str] = []
    for recording in opened:
        name = wanted = recording.folder.resolve().name
        number = 2
        while name in names:
            name, number = f"{wanted}-{number}", number + 1
        names.append(name)
    return {name: out / name for name in names}


def _origin(recording: Recording, camera_file: Path, seed: int, without: Sequence[str]) -> str:
    """Return what was compared; the same files give the same words wherever they lie."""
    sensor, name = recording.sensor.name, recording.folder.resolve().name
    frames = sum(len(exposure.frames) for exposure in recording.exposures)
    said = (
        f"Recording {name} of sensor {sensor} ({len(recording.exposures)} exposures, {frames} "
        f"frames of {recording.columns} x {recording.rows} pixels) against {camera_file.name}"
    )
    left_out = f"; not allowed to be named: {', '.join(without)}" if without else ""
    return f"{said}\nSeed {seed}{left_out}"
