"""Self-contained pages: one environment, one style, figures inside; they need no network."""

from base64 import b64encode
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jinja2

STYLE = Path(__file__).with_name("page.css")


def render_page(
    template: Path,
    values: Mapping[str, Any],
    filters: Mapping[str, Callable[..., Any]] | None = None,
) -> str:
    """Return the page that a template makes of values; a name that is not given is an error.

    Parameters
    ----------
    template
        Its `<style>` begins with `{{ style|safe }}`, what all pages share (`page.css`), and goes on
        with its own. Values are escaped.
    values
        By name in the template.
    filters
        Functions that it calls by name, beside Jinja's own.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= dict(filters or {})
    style = STYLE.read_text(encoding="utf-8")
    return environment.get_template(template.name).render(style=style, **values)


def embedded(svg: bytes) -> str:
    """Return a figure as the text that a `data:image/svg+xml;base64,` address holds."""
    return b64encode(svg).decode("ascii")
