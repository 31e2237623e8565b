"""`dsis camera`: camera models, fitted to recordings and simulated."""

import argparse
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from dsis.cli.arguments import Add, Commands, add_jobs, add_seed, adder, whole
from dsis.cli.progress import progress_bar
from dsis.errors import InputError


def add_camera(commands: Commands) -> None:
    """Say what `dsis camera` takes."""
    says = "Camera models: fitted to recordings, and simulated."
    group = commands.add_parser(
        "camera",
        help=says,
        description=says,
        epilog="example:\n  dsis camera fit RECORDING -o camera.toml",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = adder(group.add_subparsers(required=True, metavar="COMMAND"), "camera ")
    _add_fit(add)
    _add_simulate(add)


def _add_fit(add: Add) -> None:
    sub = add(
        "fit",
        camera_fit,
        "Fit the paper's camera model to a recording by photon transfer.",
        "fit recording -o camera.toml",
    )
    recording = "folder with recording.toml, or an EMVA 1288 descriptor file"
    sub.add_argument("recording", type=Path, metavar="RECORDING", help=recording)
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="camera.toml")
    segments = "read-out segments (default: as the data need)"
    sub.add_argument("--segments", type=whole(1), metavar="N", help=segments)
    add_jobs(sub)


def _add_simulate(add: Add) -> None:
    sub = add(
        "simulate",
        camera_simulate,
        "Write a recording of a camera model, laid out like another recording.",
        "simulate camera.toml --like recording -o simulated",
    )
    sub.add_argument("camera", type=Path, metavar="camera.toml")
    like = "recording whose exposures, frame counts, size and signal levels are taken"
    sub.add_argument("--like", type=Path, required=True, metavar="RECORDING", help=like)
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="DIR")
    same = "fixed patterns from the maps.npz beside camera.toml instead of a new sensor's"
    sub.add_argument("--same-sensor", action="store_true", help=same)
    add_jobs(sub)
    add_seed(sub, "default: 0")


def camera_fit(options: argparse.Namespace) -> None:
    """Fit a camera model to a recording by photon transfer."""
    from analysis.photon_transfer import fit_camera, summary, write_fit
    from analysis.photon_transfer.checksum import check_camera_file
    from dsis.recording import read_recording
    from dsis.simulate.maps import MAPS, kept_for

    recording = read_recording(options.recording)
    check_camera_file(options.out)  # before the work, not after
    with _called({recording.sensor.name: options.recording}):
        with progress_bar("fit") as progress:
            fit = fit_camera(recording, options.segments, threads=options.jobs, progress=progress)
        write_fit(fit, options.out)
    print(summary(fit))
    print(f"camera model in {options.out}")
    other = kept_for(options.out)
    if fit.maps is not None and other is not None:
        print(
            f"{options.out.parent / MAPS} keeps the fixed patterns of {other}: those of "
            f"{options.out.name} were not written, fit into another folder for them"
        )


def camera_simulate(options: argparse.Namespace) -> None:
    """Write a recording of a camera model with the layout of another recording."""
    from dsis.camera import read_camera
    from dsis.recording import read_recording
    from dsis.simulate import read_maps, simulate_like

    camera = read_camera(options.camera)
    maps = read_maps(options.camera) if options.same_sensor else None
    recording = read_recording(options.like)
    named = _called({f"camera {camera.name!r}": options.camera})
    with named, progress_bar("simulate") as progress:
        simulate_like(
            camera,
            recording,
            options.out,
            seed=options.seed or 0,
            maps=maps,
            jobs=options.jobs,
            progress=progress,
        )
    frames = sum(len(exposure.frames) for exposure in recording.exposures)
    print(f"{frames} frames in {len(recording.exposures)} exposures, simulated, in {options.out}")


@contextmanager
def _called(files: Mapping[str, Path]) -> Iterator[None]:
    """Name files as the user did, in faults that know the name of a sensor or a camera only."""
    try:
        yield
    except InputError as error:
        faults = [replace(f, file=str(files.get(f.file, f.file))) for f in error.faults]
        raise InputError(faults) from None
