"""From files to files: a camera model and recordings in, a folder of results for each out."""

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from analysis.mismatch.diagnose import VOCABULARY, find_mismatch, processes_for
from analysis.mismatch.files import MARK, fill, finding_folder
from analysis.mismatch.finding import Finding
from analysis.mismatch.model import processes
from dsis.camera import Camera, read_camera
from dsis.cfa import Cfa
from dsis.errors import Fault, InputError
from dsis.recording import Recording, origin_of, read_recording
from dsis.simulate.maps import MAPS, SensorMaps, owner_of, read_maps
from dsis.workers import completed, workers

Progress = Callable[[int, int, str], None]
_LEAST_LINES = 4  # of each colour: surfaces of third degree fit fewer exactly


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
    locate_only: bool = False,
    scheduler: str | None = None,
    progress: Progress | None = None,
    finished: Callable[[Diagnosis], None] | None = None,
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
        Threads for one recording; for several, processes with one recording each. No influence on
        the results.
    scheduler
        Address of a Dask scheduler whose workers see the same files; see `dsis.workers`.
    without
        Effects that must not be named.
    locate_only
        Whether to say where they differ, and to look for no physics.
    progress
        Told (done, total, doing).
    finished
        Told each diagnosis as soon as its files are there: a later recording may fail.

    Raises
    ------
    InputError
        A file, an option or `out` cannot be used: all faults of files and options at once.
    """
    faults = _unknown(without)
    if locate_only and without:
        fact = "is given beside --locate-only, which names nothing: give one of the two"
        faults.append(Fault("--without", "", fact))
    camera, opened = _read(camera_file, recordings, faults)
    allowed = VOCABULARY - set(VOCABULARY if locate_only else without)
    maps = _maps(camera_file)
    folders = _folders(opened, out)
    _check_kept(camera_file, folders.values())
    found: dict[str, Diagnosis] = {}
    with ExitStack() as left:
        # All folders are refused before any work begins; each result is there as soon as it is.
        held = {name: ExitStack() for name in folders}
        partial_folders = {
            name: left.enter_context(held[name]).enter_context(finding_folder(folder))
            for name, folder in folders.items()
        }
        of = dict(zip(folders, opened, strict=True))
        for name, finding in _found(camera, of, (seed, jobs, scheduler), allowed, progress):
            fill(
                partial_folders[name], finding, _origin(of[name], camera_file, seed, without), maps
            )
            held[name].close()
            found[name] = Diagnosis(name, folders[name], finding)
            if finished is not None:
                finished(found[name])
    return tuple(found[name] for name in folders)


def _found(
    camera: Camera,
    recordings: Mapping[str, Recording],
    how: tuple[int, int, str | None],
    allowed: frozenset[str],
    progress: Progress | None,
) -> Iterator[tuple[str, Finding]]:
    """Yield the finding of each recording: one by one, or side by side in processes.

    `how` is the seed, the number of workers and the address of a cluster.
    """
    seed, jobs, scheduler = how
    tell = progress or _silent
    if scheduler is None and (jobs == 1 or len(recordings) == 1):
        for name, recording in recordings.items():

            def step(done: int, total: int, doing: str, of: str = name) -> None:
                tell(done, total, doing if len(recordings) == 1 else f"{of}: {doing}")

            with processes(processes_for(recording, jobs)):  # until the caller has drawn it
                finding = find_mismatch(
                    camera, recording, seed=seed, jobs=jobs, vocabulary=allowed, progress=step
                )
                yield name, finding
        return
    tell(0, len(recordings), "diagnosing")
    one = partial(_finding, camera, seed, allowed)
    with workers(jobs, kind="processes", scheduler=scheduler) as pool:
        finished = completed(pool, one, recordings.items())
        for done, ((name, _), finding) in enumerate(finished, 1):
            tell(done, len(recordings), name)
            yield name, finding


def _finding(
    camera: Camera, seed: int, allowed: frozenset[str], named: tuple[str, Recording]
) -> Finding:
    return find_mismatch(camera, named[1], seed=seed, vocabulary=allowed)


def _silent(_done: int, _total: int, _doing: str) -> None:
    """Tell nobody."""


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
        faults += _too_small(recording, path)
        if camera is not None:
            faults += _other_camera(camera, camera_file, recording, path)
    if camera is None or faults:
        raise InputError(faults)
    return camera, opened


def _too_small(recording: Recording, path: Path) -> list[Fault]:
    """Return what says that a channel has too few lines to tell patterns from smooth surfaces."""
    least = _LEAST_LINES * (1 if recording.sensor.cfa is Cfa.MONO else 2)
    if min(recording.rows, recording.columns) >= least:
        return []
    fact = f"are of {recording.columns} x {recording.rows} pixels, must have {least} x {least}"
    return [Fault(str(path), "frames", f"{fact} or more ({recording.sensor.cfa.value})")]


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


def _check_kept(camera_file: Path, folders: Iterable[Path]) -> None:
    """Refuse a folder that holds the camera model: the result would take its place."""
    for folder in folders:
        if camera_file.resolve().is_relative_to(folder.resolve()):
            fact = f"holds {camera_file.name}, the camera model that is read, which would be lost"
            raise InputError.of(folder, "", f"{fact}: give another folder")


def _origin(recording: Recording, camera_file: Path, seed: int, without: Sequence[str]) -> str:
    """Return what was compared, and that frames are simulated where the recording says so.

    The same files give the same words wherever they lie.
    """
    sensor, name = recording.sensor.name, recording.folder.resolve().name
    frames = sum(len(exposure.frames) for exposure in recording.exposures)
    made = origin_of(recording)
    how = f"; {made}" if made else ""
    said = (
        f"Recording {name} of sensor {sensor} ({len(recording.exposures)} exposures, {frames} "
        f"frames of {recording.columns} x {recording.rows} pixels{how}) against {camera_file.name}"
    )
    left_out = f"; not allowed to be named: {', '.join(without)}" if without else ""
    return f"{said}\nSeed {seed}{left_out}"
