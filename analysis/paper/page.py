"""The page: published and recomputed side by side, with style, figures and tables inside it."""

from collections.abc import Sequence
from pathlib import Path

from analysis.page import embedded, render_page
from analysis.paper.part import Part
from analysis.paper.published import REFERENCE
from analysis.paper.setting import Setting
from dsis import __version__

TEMPLATE = Path(__file__).with_name("paper.html.jinja")


def render(parts: Sequence[Part], setting: Setting, folder: Path) -> str:
    """Return the page; the SVG of each picture is read from `folder`."""
    pictures = {
        picture.name: embedded((folder / f"{picture.name}.svg").read_bytes())
        for part in parts
        for picture in part.pictures
    }
    values = {
        "parts": parts,
        "pictures": pictures,
        "setting": setting,
        "reference": REFERENCE,
        "version": __version__,
    }
    return render_page(TEMPLATE, values)
