"""`maps.npz` beside `camera.toml`: the fixed pattern of one sensor, pixel by pixel."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar
from zipfile import BadZipFile

import numpy as np
from pydantic import ConfigDict

from dsis.camera import Camera
from dsis.effects import Effect, Exposure, Image, Stage, registry
from dsis.effects.line_settling import LineSettling
from dsis.errors import Fault, InputError
from dsis.grid import PixelGrid

MAPS = "maps.npz"
REPLACED = frozenset(
    {
        "dsnu",
        "prnu",
        "smooth_prnu",
        "row_fpn",
        "column_fpn",
        "row_prnu",
        "column_prnu",
        "shading",
        "tap_mismatch",
        "line_settling",
    }
)
"""Effects that draw a pattern which the maps hold as it was measured."""
GROWN = frozenset({"dark_current", "hot_pixels", "amp_glow"})
"""Those that a map of dark currents holds."""
_CURRENT = "dark_current_dn_per_s"

_DTYPE = np.dtype(np.float32)


@dataclass(frozen=True)
class SensorMaps:
    """Fixed patterns of a sensor, float32 (row, column).

    Attributes
    ----------
    dsnu_dn
        Offset of each pixel that depends neither on light nor on exposure time, DN: dark-signal
        non-uniformity with its rows, columns and taps; mean 0 over each colour.
    prnu_gain
        Response of each pixel relative to the mean of its colour: photo-response non-uniformity
        with shading and taps; mean 1 over each colour.
    dsnu_noise_dn, prnu_noise
        By how much the maps miss the sensor's pattern, standard deviation of a pixel; 0 where it is
        not known. Maps are best linear estimates, so the sensor has this much more variance.
    dark_current_dn_per_s
        Dark current of each pixel, DN/s; None where it is not known, or the same in all.
    """

    dsnu_dn: Image
    prnu_gain: Image
    dsnu_noise_dn: float = 0.0
    prnu_noise: float = 0.0
    dark_current_dn_per_s: Image | None = None


def read_maps(camera_file: Path) -> SensorMaps:
    """Return the maps that lie beside a `camera.toml`; raise `InputError` where they do not."""
    path = camera_file.parent / MAPS
    if not path.is_file():
        fact = "is missing: the same sensor needs the fixed patterns that a fit wrote beside "
        raise InputError.of(path, "", f"{fact}{camera_file.name}; without them draw a new sensor")
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise InputError.of(path, "", f"is damaged: {str(error).splitlines()[0]}") from None
    owner = str(arrays.pop("camera", camera_file.name))
    if owner != camera_file.name:
        fact = (
            f"holds the patterns of {owner}, must be those of {camera_file.name}: a folder holds "
        )
        raise InputError.of(path, "camera", f"{fact}the maps of one camera; fit into another")
    noise = {name: arrays.pop(name, np.float64(0)) for name in ("dsnu_noise_dn", "prnu_noise")}
    faults = [
        Fault(str(path), name, f"is {value}, must be a number >= 0")
        for name, value in noise.items()
        if value.ndim or value.dtype.kind not in "fiu" or not 0 <= value < np.inf
    ]
    faults += [
        Fault(str(path), name, "is missing, must be an array (row, column)")
        for name in ("dsnu_dn", "prnu_gain")
        if name not in arrays
    ]
    faults += [
        Fault(str(path), name, f"has shape {array.shape}, must be finite numbers (row, column)")
        for name, array in arrays.items()
        if array.ndim != 2 or array.dtype.kind not in "fiu" or not np.isfinite(array).all()
    ]
    if not faults:
        wanted = arrays["dsnu_dn"].shape
        faults += [
            Fault(str(path), name, f"has shape {own.shape}, must be {wanted} like dsnu_dn")
            for name in ("prnu_gain", _CURRENT)
            if (own := arrays.get(name)) is not None and own.shape != wanted
        ]
    if not faults and arrays["prnu_gain"].min() <= 0:
        faults.append(Fault(str(path), "prnu_gain", "holds a gain <= 0, must be greater than 0"))
    current = arrays.get(_CURRENT)
    if not faults and current is not None and current.min() < 0:
        faults.append(Fault(str(path), _CURRENT, "holds a current < 0, must be 0 or more"))
    if faults:
        raise InputError(faults)
    return SensorMaps(
        arrays["dsnu_dn"].astype(_DTYPE),
        arrays["prnu_gain"].astype(_DTYPE),
        float(noise["dsnu_noise_dn"]),
        float(noise["prnu_noise"]),
        None if current is None else current.astype(_DTYPE),
    )


def owner_of(maps_file: Path) -> str | None:
    """Return the file name of the camera whose maps these are; None where no maps say it."""
    try:
        with np.load(maps_file, allow_pickle=False) as stored:
            return str(stored["camera"])
    except (OSError, ValueError, EOFError, KeyError, BadZipFile):
        return None


def check_maps_file(camera_file: Path) -> None:
    """Refuse to write the maps of a camera over what does not say that it is such a file."""
    path = camera_file.parent / MAPS
    if not path.exists():
        return
    if owner_of(path) is None:
        fact = "does not say whose patterns it holds, and would be lost: fit into another folder"
        raise InputError.of(path, "camera", fact)


def kept_for(camera_file: Path) -> str | None:
    """Return the other camera model, still there, whose maps lie beside a camera model."""
    owner = owner_of(camera_file.parent / MAPS)
    others = owner is not None and owner != camera_file.name
    return owner if others and (camera_file.parent / str(owner)).exists() else None


def write_maps(maps: SensorMaps, camera_file: Path) -> None:
    """Write the maps beside a `camera.toml`; `read_maps` returns equal ones."""
    arrays: dict[str, Any] = {
        "dsnu_dn": maps.dsnu_dn.astype(_DTYPE),
        "prnu_gain": maps.prnu_gain.astype(_DTYPE),
        "dsnu_noise_dn": np.float64(maps.dsnu_noise_dn),
        "prnu_noise": np.float64(maps.prnu_noise),
        "camera": np.str_(camera_file.name),
    }
    if maps.dark_current_dn_per_s is not None:
        arrays[_CURRENT] = maps.dark_current_dn_per_s.astype(_DTYPE)
    np.savez(camera_file.parent / MAPS, **arrays)


class OffsetMap(Effect):
    """The measured offset of every pixel: no effect of the vocabulary."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    kind: str = "offset_map"
    offsets_dn: Any
    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 4"
    measures: ClassVar[frozenset[str]] = frozenset({"level"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offsets of the pixels."""
        part: Image = image + _part(self.offsets_dn, exposure.grid)
        return part


class CurrentMap(Effect):
    """The measured dark current of every pixel: no effect of the vocabulary."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    kind: str = "current_map"
    dn_per_s: Any
    stage: ClassVar[Stage] = Stage.LIGHT
    rank: ClassVar[int] = 50  # after what acts on light alone
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 7"
    measures: ClassVar[frozenset[str]] = frozenset({"level"})
    grows_with_time: ClassVar[bool] = True

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add what the pixels collect in the exposure time."""
        time = np.float32(exposure.exposure_time_s)
        part: Image = image + _part(self.dn_per_s, exposure.grid) * time
        return part


class GainMap(Effect):
    """The measured gain of every pixel: no effect of the vocabulary."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    kind: str = "gain_map"
    gains: Any
    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 4"
    measures: ClassVar[frozenset[str]] = frozenset({"level"})

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply by the gains of the pixels."""
        part: Image = image * _part(self.gains, exposure.grid)
        return part


def with_maps(camera: Camera, maps: SensorMaps, grid: PixelGrid) -> Camera:
    """Return the camera with measured patterns in the place of the drawn ones.

    What the maps miss is drawn anew, white: the pattern as a whole then has the sensor's variance.
    """
    if maps.dsnu_dn.shape != grid.shape:
        found, wanted = (" x ".join(map(str, s)) for s in (maps.dsnu_dn.shape, grid.shape))
        raise InputError.of(MAPS, "", f"is of {found} pixels, must be of {wanted} (rows x columns)")
    current = maps.dark_current_dn_per_s
    held = REPLACED if current is None else REPLACED | GROWN
    kept = tuple(effect for effect in camera.effect if effect.kind not in held)
    offset, gain = np.float32(0), np.float32(1)
    for effect in camera.effect:
        if isinstance(effect, LineSettling):  # a map has no mean of its own
            offset += np.float32(effect.mean_offset_dn(grid.sensor_shape))
            gain *= np.float32(effect.mean_gain(grid.sensor_shape))
    links: list[Effect] = [
        GainMap(gains=maps.prnu_gain * gain),
        OffsetMap(offsets_dn=maps.dsnu_dn + offset),
    ]
    if current is not None:
        links.append(CurrentMap(dn_per_s=current))
    if maps.prnu_noise:
        links.append(registry()["prnu"].model_validate({"sigma_percent": 100 * maps.prnu_noise}))
    if maps.dsnu_noise_dn:
        links.append(registry()["dsnu"].model_validate({"sigma_dn": maps.dsnu_noise_dn}))
    return camera.model_copy(update={"effect": (*kept, *links)})


def _part(whole: Image, grid: PixelGrid) -> Image:
    row, column = grid.first_row, grid.first_column
    return whole[row : row + grid.rows, column : column + grid.columns]
