"""Recordings of a camera model: of a stated layout, or of the layout of another recording.

`simulate_like` imitates a recording, `simulate` takes levels as they are stated, and
`simulated_frames` gives the frames without writing them.
"""

from dsis.simulate.maps import SensorMaps, read_maps, write_maps
from dsis.simulate.shot import Shot, dark, flat
from dsis.simulate.simulator import simulate, simulate_like, simulated_frames

__all__ = [
    "SensorMaps",
    "Shot",
    "dark",
    "flat",
    "read_maps",
    "simulate",
    "simulate_like",
    "simulated_frames",
    "write_maps",
]
