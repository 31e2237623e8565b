"""What a diagnosis leaves on disk: mismatch.json, report.html, figures/, camera.toml, maps.npz."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from analysis.mismatch.finding import Finding
from analysis.mismatch.jsonfile import write_json
from analysis.mismatch.report import write_page
from analysis.mismatch.report.figures import drawn_by_dsis
from analysis.mismatch.report.sentences import fitted
from analysis.photon_transfer.checksum import unchanged, with_checksum
from analysis.photon_transfer.files import camera_tables
from dsis.camera import camera_values
from dsis.outdir import UNFINISHED, listed, result_folder
from dsis.simulate.maps import MAPS, SensorMaps, write_maps

MARK = "mismatch.json"
CAMERA = "camera.toml"
FIGURES = "figures"
FILES = frozenset({MARK, "report.html", CAMERA, MAPS, FIGURES})


def write_finding(
    finding: Finding, out: Path, origin: str = "", maps: SensorMaps | None = None
) -> None:
    """Write everything into the folder `out`, which appears when all of it is there.

    Parameters
    ----------
    finding
        The result.
    out
        New, empty, or an earlier diagnosis, which is replaced; anything else raises `InputError`.
    origin
        What was compared, in its first line; below it source, copyright, licence.
    maps
        The sensor's fixed patterns, for `dsis camera simulate --same-sensor`.
    """
    with finding_folder(out) as folder:
        fill(folder, finding, origin, maps)


@contextmanager
def finding_folder(out: Path) -> Iterator[Path]:
    """Yield a folder to work in that becomes `out`: refused before work begins, not after."""
    with result_folder(out, MARK, keep=_not_ours) as folder:
        yield folder


def fill(folder: Path, finding: Finding, origin: str = "", maps: SensorMaps | None = None) -> None:
    """Write the files of a diagnosis into a folder, `mismatch.json` last."""
    camera = folder / CAMERA
    text = with_checksum(camera_text(finding, origin))
    camera.write_text(text, encoding="utf-8", newline="")
    if maps is not None:
        write_maps(maps, camera)
    write_page(finding, folder, origin)
    write_json(finding, folder / MARK)


def camera_text(finding: Finding, origin: str = "") -> str:
    """Return camera.toml: the model with the physics named, comments on what it rests on."""
    comments = [line for line in origin.splitlines() if line]
    found = ", and with the physics found there" if finding.searched else ""
    comments.append(f"Re-calibrated on the training frames{found}.")
    comments += [
        f"{effect.effect}: {fitted(name, parameter)}"
        for effect in finding.omitted_physics
        for name, parameter in effect.parameters.items()
    ]
    if finding.unexplained:
        comments.append(f"{len(finding.unexplained)} departures stay; see mismatch.json.")
    comments += finding.remarks
    lines = [line for comment in comments for line in comment.splitlines()]
    return "".join(f"# {line}\n" for line in lines) + camera_tables(camera_values(finding.camera))


def _not_ours(out: Path) -> str | None:
    """Return what in an earlier result is no part of one, or was changed by the user."""
    other = [p.name for p in sorted(out.iterdir()) if p.name not in FILES | {UNFINISHED}]
    if (out / MARK).is_file():  # else unfinished: what was being written is cut off
        drawn = sorted((out / FIGURES).glob("*"))
        other += [f"{FIGURES}/{path.name}" for path in drawn if not drawn_by_dsis(path)]
        if (out / CAMERA).is_file() and not unchanged(out / CAMERA):
            other.append(f"changes to {CAMERA}")
    return listed(other)
