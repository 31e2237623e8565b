"""The page: published and recomputed side by side, with style, figures and tables inside it."""

from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path

import jinja2

import analysis.report
from analysis.paper.part import Part
from analysis.paper.published import REFERENCE
from analysis.paper.setting import Setting
from dsis import __version__


def render(parts: Sequence[Part], setting: Setting, folder: Path) -> str:
    """Return the page; the SVG of each picture is read from `folder`."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    pictures = {
        picture.name: b64encode((folder / f"{picture.name}.svg").read_bytes()).decode("ascii")
        for part in parts
        for picture in part.pictures
    }
    return environment.get_template("paper.html.jinja").render(
        style=_style(),
        parts=parts,
        pictures=pictures,
        setting=setting,
        reference=REFERENCE,
        version=__version__,
    )


def _style() -> str:
    """Return the style of the MOS report: all pages of dsis look alike."""
    report = Path(analysis.report.__path__[0]) / "report.html.jinja"
    text = report.read_text(encoding="utf-8")
    return text.partition("<style>")[2].partition("</style>")[0]
