"""Fig. 4: one frame of the test sequence."""

from pathlib import Path

from analysis.paper.figures.frames import draw_frames
from analysis.paper.part import Part, Picture
from analysis.paper.scene import SPEC, scene
from analysis.paper.setting import Setting
from dsis.stimuli.quality import delivered


def recompute(setting: Setting, folder: Path) -> Part:
    """Show the first reference frame of City and of Landscape."""
    frames = {}
    for name in ("city", "landscape"):
        content = scene(name, setting, 1)
        frames[name.capitalize()] = delivered(content.rendering.reference(content.clean(0)))
    draw_frames(frames, folder / "fig4")
    width, height = setting.size
    says = (
        "The paper's sequence City was rendered for it and is not public; here City and Landscape "
        f"are the scenes that come with dsis, {width} x {height} pixels, through the optics and "
        f"the camera of {SPEC}. Every number measured on them is a number of these scenes."
    )
    caption = "The reference frames: noise-free, never mosaicked."
    return Part("fig4", "Fig. 4", (says,), (), (Picture("fig4", caption),))
