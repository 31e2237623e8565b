"""A small test spec written by hand, and the same with other values."""

import tomllib
from pathlib import Path
from typing import Any

import tomli_w

SPEC = """\
schema = "dsis-test/1"
title = "a test"
seed = 1
formats = ["player"]

[sequence]
width = 64
height = 48
fps = 25
seconds = 0.2

[[content]]
name = "still"
files = "still.exr"

[camera]
model = "cameras/dual_gain_cinema.toml"

[optics]
f_number = 5.6
wavelength_nm = 550
pitch_um = 8.25
low_pass_spot_separation_px = 0.75
fill_factor = 1.0

[color]
display = "Rec.1886 Rec.709 - Display"
view = "ACES 1.0 - SDR Video"
scene_space = "Linear ARRI Wide Gamut 3"

[awgn]
match = "psnr"

[conditions]
noise = ["awgn", "sd"]
demosaic = ["none", "bilinear"]
levels = [0]

[session]
reference_s = 0.2
test_s = 0.2
training = 0
"""
SHORT = (("seconds = 0.2", "seconds = 0.04"), ("_s = 0.2", "_s = 0.04"))  # one frame


def write_spec(path: Path, **changes: Any) -> Path:
    """Write the spec with other values: a table's are put into it, what is no table replaces."""
    values = tomllib.loads(SPEC)
    for name, given in changes.items():
        merged = isinstance(given, dict) and name != "awgn"  # which holds one key, never two
        values[name] = {**values[name], **given} if merged else given
    path.write_text(tomli_w.dumps(values), encoding="utf-8")
    return path
