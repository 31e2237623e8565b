"""An independent simulator of recordings with hidden physics, to judge diagnosis with.

It shares no code with dsis: what each effect does is written here a second time, from the physics
(contracts of the vocabulary), with numpy's own random generators. `plant` writes a recording and
its camera.toml; `calibrate` scales an effect until the planter's own statistic stands at a wanted
number of standard deviations.
"""

from planter.case import Case, Effect, Plan, Segment
from planter.chain import KINDS, frame_codes, stack
from planter.disk import camera_values, plant
from planter.layout import LAYOUTS, Choice, Layout, draw_case

__all__ = [
    "KINDS",
    "LAYOUTS",
    "Case",
    "Choice",
    "Effect",
    "Layout",
    "Plan",
    "Segment",
    "camera_values",
    "draw_case",
    "frame_codes",
    "plant",
    "stack",
]
