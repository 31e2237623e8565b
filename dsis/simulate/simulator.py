"""A camera model's recording: frames by threads, written in order; the seed fixes every byte."""

import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis.camera import Camera
from dsis.draw import Draw
from dsis.effects import Image
from dsis.errors import Fault, InputError
from dsis.grid import PixelGrid
from dsis.recording import Recording, Sensor, write_recording
from dsis.recording.ahead import in_order
from dsis.simulate.imitation import Imitation
from dsis.simulate.maps import SensorMaps, with_maps
from dsis.simulate.shot import Shot

Progress = Callable[[int, int, str], None]


def simulate_like(
    camera: Camera,
    recording: Recording,
    out: Path,
    *,
    seed: int = 0,
    maps: SensorMaps | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Recording:
    """Write a recording of the same layout as another: what the camera model says it would be.

    Exposures, frame counts, size, exposure times and light are those of `recording`. Flats have
    the recorded mean of each colour filter site as their uniform signal, see `Imitation`; darks
    have none. A scene's signal is its recorded mean frame above black: the error of that mean and
    the recorded sensor's own pattern stay in it (with `maps` the pattern is taken off first).

    Parameters
    ----------
    camera
        The camera model.
    recording
        What to imitate.
    out
        Folder for the result, written whole or not at all.
    seed
        Fixes every byte, whatever the number of jobs. Another seed is another sensor as well.
    maps
        Fixed patterns of the sensor (`read_maps`): the same sensor. None: a new sensor of the same
        statistics.
    jobs
        Threads.
    progress
        Called with (frames done, frames in all, exposure).

    Raises
    ------
    InputError
        Where camera and recording do not fit: another colour filter array, a lower white level,
        maps of another size, codes of more than 16 bits; or where `out` may not be replaced.
    """
    faults = [*_faults(camera), *_unlike(camera, recording.sensor), *_overwrites(recording, out)]
    if faults:
        raise InputError(faults)
    used = camera if maps is None else with_maps(camera, maps, recording.grid)
    draw = _draw(seed, recording, maps)
    shots = Imitation(used, recording, draw.within("sensor"), maps, jobs).shots()
    frames = simulated_frames(used, shots, recording.grid, jobs=jobs, draw=draw)
    return _written(used, shots, frames, out, seed, progress)


def simulate(
    camera: Camera,
    shots: Sequence[Shot],
    rows: int,
    columns: int,
    out: Path,
    *,
    seed: int = 0,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Recording:
    """Write a recording of stated exposures (`flat`, `dark`, `Shot`); see `simulate_like`."""
    faults = _faults(camera)
    if faults:
        raise InputError(faults)
    grid = PixelGrid(rows, columns, camera.cfa)
    frames = simulated_frames(camera, shots, grid, seed=seed, jobs=jobs)
    return _written(camera, shots, frames, out, seed, progress)


def _written(
    camera: Camera,
    shots: Sequence[Shot],
    frames: Iterator[NDArray[np.uint16]],
    out: Path,
    seed: int,
    progress: Progress | None,
) -> Recording:
    sensor = Sensor(
        name=camera.name,
        cfa=camera.cfa,
        black_level=camera.black_level,
        white_level=camera.white_level,
        bit_depth=camera.bit_depth,
    )
    origin = f"simulated from camera model {camera.name!r}, seed {seed}"
    plans = [shot.plan for shot in shots]
    return write_recording(out, sensor, plans, frames, origin=origin, progress=progress)


def simulated_frames(
    camera: Camera,
    shots: Sequence[Shot],
    grid: PixelGrid,
    *,
    seed: int = 0,
    jobs: int = 1,
    draw: Draw | None = None,
) -> Iterator[NDArray[np.uint16]]:
    """Yield the codes of every frame, exposure after exposure: uint16 (row, column).

    One sensor serves the whole recording; each exposure has temporal noise of its own, by name.
    Raises `InputError` where a frame would hold no numbers.
    """
    draws = Draw(seed) if draw is None else draw
    sensor = draws.within("sensor")
    # Codes come less black and, where black is a fraction, are no whole numbers: round to nearest.
    offset = np.float32(camera.black_level + 0.5)

    def expose(work: tuple[Shot, Image, int]) -> NDArray[np.uint16]:
        shot, clean, frame = work
        temporal = draws.within("exposure", shot.plan.name)
        image = camera.expose(
            clean, temporal, sensor, frame, grid, exposure_time_s=shot.plan.exposure_time_s
        )
        if np.isnan(image).any():  # they have no code
            where = f"camera {camera.name!r}", f"exposure {shot.plan.name}"
            fact = f"signals of {shot.plan.exposure_time_s:g} s are too large to be computed"
            raise InputError.of(*where, fact)
        return (image + offset).astype(np.uint16)

    return in_order(expose, _work(shots, grid), 0 if jobs <= 1 else jobs)


def _work(shots: Sequence[Shot], grid: PixelGrid) -> Iterator[tuple[Shot, Image, int]]:
    for shot in shots:
        clean = shot.clean(grid)
        clean.flags.writeable = False  # threads share it
        for frame in range(shot.plan.frames):
            yield shot, clean, frame


def _draw(seed: int, recording: Recording, maps: SensorMaps | None) -> Draw:
    """Return the fields of an imitation: none that made the recording or the maps.

    A recording simulated with the same seed would meet its own sensor and noise again: as a new
    sensor it would be the old one; with maps, its noise, part of which is in them, and its pattern,
    part of which they miss, would come a second time and add up.
    """
    content = 0
    for exposure in recording.exposures:
        content = zlib.crc32(recording.frame(exposure, 0).astype("<u2").tobytes(), content)
    if maps is not None:
        content = zlib.crc32(maps.prnu_gain.tobytes(), zlib.crc32(maps.dsnu_dn.tobytes(), content))
    return Draw(seed).within("like", f"{content}")


def _unlike(camera: Camera, sensor: Sensor) -> list[Fault]:
    """Return why a camera cannot have the layout and the signal levels of a recording."""
    pairs: list[tuple[str, str]] = []
    if camera.cfa != sensor.cfa:
        pairs.append(("cfa", f"is {camera.cfa}, must be {sensor.cfa}"))
    if camera.white_level < sensor.white_level:  # it would clip what the recording shows
        fact = f"is {camera.white_level:g}, must be {sensor.white_level:g} or more"
        pairs.append(("white_level", fact))
    file = f"camera {camera.name!r}"
    return [Fault(file, key, f"{fact} as in the recording") for key, fact in pairs]


def _overwrites(recording: Recording, out: Path) -> list[Fault]:
    """Return why `out` may not be replaced: the recording, or some of its frames, lie there."""
    target, own = out.resolve(), recording.folder.resolve()
    if target == own:
        return [Fault(str(out), "", "is the recording itself: give another folder")]
    frames = {path.parent for exposure in recording.exposures for path in exposure.frames}
    if any(place.is_relative_to(target) for place in (own, *(p.resolve() for p in frames))):
        fact = "holds the recording that is read, which would be lost: give another folder"
        return [Fault(str(out), "", fact)]
    return []


def _faults(camera: Camera) -> list[Fault]:
    """Return why a camera's codes cannot be written."""
    if camera.bit_depth <= 16:
        return []
    fact = f"is {camera.bit_depth}, must be at most 16: frames hold 16-bit codes"
    return [Fault(f"camera {camera.name!r}", "bit_depth", fact)]
