"""What a fit leaves on disk: camera.toml, its figures, all numbers as JSON, a table to read."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from analysis.figures_camera import draw_distribution, draw_photon_transfer
from analysis.photon_transfer.checksum import check_camera_file, with_checksum
from analysis.photon_transfer.fit import Fit
from analysis.photon_transfer.quantity import Quantity
from dsis.camera import Camera, camera_values
from dsis.outdir import check_parents, said_of
from dsis.simulate.maps import MAPS, check_maps_file, kept_for, owner_of, write_maps

SCHEMA = "dsis-camera-fit/1"


def write_fit(fit: Fit, out_toml: Path, origin: str = "") -> tuple[Path, ...]:
    """Write camera.toml and, beside it, -ptc.svg/.png, -distribution.png and -fit.json; maps.npz.

    Parameters
    ----------
    fit
        The fit; raises `InputError` where it is no possible camera.
    out_toml
        Where the camera model goes; the other names start with its stem. Raises `InputError` where
        a file lies there that was not written by dsis or was changed since. Maps of another
        camera model that lie beside it are kept, and these are not written.
    origin
        A comment that says what was recorded: source, copyright, licence.

    Returns
    -------
    The files written.
    """
    text = with_checksum(camera_text(fit, origin))  # first: where it fails, nothing is written
    with said_of(out_toml):
        check_parents(out_toml)
        check_camera_file(out_toml)
        if fit.maps is not None:
            check_maps_file(out_toml)
        return _written(fit, out_toml, text)


def _written(fit: Fit, out_toml: Path, text: str) -> tuple[Path, ...]:
    out_toml.parent.mkdir(parents=True, exist_ok=True)

    def beside(ending: str) -> Path:
        return out_toml.with_name(out_toml.stem + ending)

    numbers = beside("-fit.json")
    numbers.write_text(json.dumps(fit_values(fit), indent=1) + "\n", encoding="utf-8")
    written = [numbers, *draw_photon_transfer(fit, beside("-ptc"))]
    if fit.distribution is not None:
        written.append(draw_distribution(fit, fit.distribution, beside("-distribution.png")))
    maps = out_toml.parent / MAPS
    if fit.maps is not None and kept_for(out_toml) is None:
        write_maps(fit.maps, out_toml)
        written.append(maps)
    elif owner_of(maps) == out_toml.name:
        maps.unlink()  # of an earlier fit
    unfinished = beside(".toml.partial")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(out_toml)
    return (out_toml, *written)


def camera_text(fit: Fit, origin: str = "") -> str:
    """Return camera.toml: comments on what limits the numbers, then the model."""
    comments = [line for line in origin.splitlines() if line]
    comments.append(
        "Fitted by photon transfer; slopes in DN, intercepts in DN^2, rounding taken off."
    )
    if fit.black_se_dn is not None:
        comments.append(
            f"black_level = {fit.black_dn:.6g} +- {fit.black_se_dn:.2g} DN; of this one sensor "
            f"+- {fit.black_noise_se_dn:.2g} DN"
        )
    for number, switch in enumerate(fit.segments.switches):
        comments.append(
            f"segment {number} ends between {switch.low_dn:.6g} and {switch.high_dn:.6g} DN "
            "(95 %); upper_dn is the middle"
        )
    comments += [
        f"{e.kind}.{e.parameter} = {e.value:.6g} +- {e.standard_error:.2g}"
        + "".join(f", {name} = {value:.6g}" for name, value in e.beside.items())
        + (f" +- {e.beside_error:.2g}" if e.beside_error else "")
        for e in fit.effects
    ]
    comments += fit.remarks
    head = "".join(f"# {line}\n" for line in comments)
    return head + camera_tables(camera_values(fit.camera))


def camera_tables(values: dict[str, Any]) -> str:
    """Return camera.toml with a table per segment and effect, so that more can be appended.

    What a fit cannot know (white balance, matrix) is left out where it is the default.
    """
    unsaid = {"effect"} | {
        name
        for name in ("white_balance", "camera_from_scene")
        if values.get(name) == _plain(Camera.model_fields[name].default)
    }
    kept = {name: value for name, value in values.items() if name not in unsaid}
    noise = dict(kept.pop("noise"))
    segments = noise.pop("segment")
    text = tomli_w.dumps({**kept, "noise": noise})
    text += "".join(f"\n[[noise.segment]]\n{tomli_w.dumps(segment)}" for segment in segments)
    effects = values.get("effect", ())
    return text + "".join(f"\n[[effect]]\n{tomli_w.dumps(effect)}" for effect in effects)


def fit_values(fit: Fit) -> dict[str, Any]:
    """Return every number of a fit as plain values, as JSON holds them; nan becomes null."""
    values = asdict(replace(fit, maps=None))  # the maps have a file of their own
    del values["maps"]
    values["black_level_is"] = (
        "of all such sensors: black_se_dn holds the fixed pattern; black_noise_se_dn does not"
    )
    values["segments"]["error_of_intervals"] = "standard errors; switches: 95 % intervals"
    plain: dict[str, Any] = {"schema": SCHEMA, **_plain(values)}
    return plain


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value


def summary(fit: Fit) -> str:
    """Return the fit as Markdown: model, quantities, channels, remarks."""
    black = "nominal"
    if fit.black_se_dn is not None:
        black = f"standard error {fit.black_se_dn:.2g}, of this sensor {fit.black_noise_se_dn:.2g}"
    lines = [f"# {fit.name}", "", "| segment | from DN | slope DN | intercept DN^2 |"]
    lines.append("|---|---|---|---|")
    starts = ["0"] + [f"{s.low_dn:.5g} .. {s.high_dn:.5g}" for s in fit.segments.switches]
    for number, (start, line) in enumerate(zip(starts, fit.segments.lines, strict=True)):
        slope = f"{line.slope_dn:.5g} +- {line.slope_se_dn:.2g}"
        lines.append(
            f"| {number} | {start} | {slope} | "
            f"{line.intercept_dn2:.5g} +- {line.intercept_se_dn2:.2g} |"
        )
    lines += ["", f"Black level {fit.black_dn:.6g} DN ({black}). "]
    misfit = f"{fit.segments.deviance:.4g} / {fit.segments.dof}"
    lines[-1] += f"Misfit: deviance / dof = {misfit}."
    if math.isfinite(fit.homogeneity_p):
        lines[-1] += f" Channels alike: p = {fit.homogeneity_p:.2g}."
    lines += ["", "## The model", "", *_table(fit.quantities)]
    for name, channel in fit.channels.items():
        if channel.figures:
            lines += ["", f"## EMVA 1288, {name}", "", *_table(channel.figures)]
    if fit.remarks:
        lines += ["", "## Remarks", "", *(f"- {remark}" for remark in fit.remarks)]
    return "\n".join(lines) + "\n"


def _table(quantities: Sequence[Quantity]) -> list[str]:
    rows = ["| quantity | value | standard error | unit | definition |", "|---|---|---|---|---|"]
    for q in quantities:
        value = "-" if q.value is None else f"{q.value:.5g}"
        error = "-" if q.standard_error is None else f"{q.standard_error:.2g}"
        rows.append(f"| {q.name} | {value} | {error} | {q.unit} | {q.means} |")
    return rows
