"""camera.toml as somebody without the truth would have it: `dsis camera fit` on a recording."""

from pathlib import Path

from analysis.photon_transfer import camera_text, fit_camera
from dsis.recording import read_recording


def fit_into(folder: Path, recorded: Path) -> Path:
    """Fit the recording in `recorded`, write `folder`/camera.toml, return its path."""
    text = camera_text(fit_camera(read_recording(recorded)))
    out = folder / "camera.toml"
    out.write_text(text, encoding="utf-8")
    return out
