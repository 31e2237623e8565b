"""The page of effects, written from their docstrings and fields: `docs/effects.md`.

`python -m dsis.effects.catalogue > docs/effects.md` writes it; a test compares.
"""

import inspect
import sys
from typing import Any

from pydantic.fields import FieldInfo

from dsis.effects import Effect, Stage, registry

HEAD = """\
# The vocabulary of physics

Generated from the code: `python -m dsis.effects.catalogue > docs/effects.md`.

Effects beyond the paper's base model, in the order in which light and charge meet them. A camera
holds any number of them, each as an `[[effect]]` of its `camera.toml` with `kind` and parameters.
S is the expected signal in DN above black, V the temporal variance of a pixel, t the frame, y and x
row and column of the sensor. Amplitudes are standard deviations unless said. A second effect of one
kind has random fields of its own.

**Base model.** Shot noise of variance m S and read noise of variance t by read-out segment, then
rounding and clipping. `dual_gain` is no effect of its own: it is a second `[[noise.segment]]`,
which takes over at `upper_dn` of the first. `shot = "poisson"` of `[noise]` is
`poisson_shot_noise`.

**Neighbours.** Effects that couple pixels act between sites of a mosaic, whatever their colour
(`spatial_filtering`: sites of one colour), and within each of three full planes; at the border of
the array nothing enters or leaves. A crop equals the crop of the whole away from its border.
"""

STAGES = {
    Stage.LIGHT: "Light: what changes the expected signal, before shot noise",
    Stage.CHARGE: "Charge: from shot noise on",
    Stage.READ_OUT: "Read-out: amplifiers and lines",
    Stage.CODE: "Code: the converter and after",
}

_BOUNDS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}


def catalogue() -> str:
    """Return the page of all effects: Markdown."""
    parts = [HEAD]
    for stage, title in STAGES.items():
        kinds = [k for k in registry().values() if k.stage is stage]
        kinds.sort(key=lambda k: (k.rank, k.model_fields["kind"].default))
        parts += [f"## {title}\n", *(_section(kind) for kind in kinds)]
    return "\n".join(parts)


def _section(kind: type[Effect]) -> str:
    title, _, text = (inspect.getdoc(kind) or "").partition("\n\n")
    fields = {name: f for name, f in kind.model_fields.items() if name != "kind"}
    rows = [_row(name, field) for name, field in fields.items()]
    table = ["| parameter | allowed | default |", "|---|---|---|", *rows] if rows else ["None."]
    changed = ", ".join(f"`{name}`" for name in sorted(kind.measures))
    return "\n".join(
        [
            f"### `{kind.model_fields['kind'].default}`\n",
            f"{title}\n",
            f"{text}\n",
            "Parameters:" + ("\n" if rows else ""),
            *table,
            f"\nChanges: {changed}.\n",
            f"Resembles: {kind.confounders}\n",
            f"Reference: {kind.reference}.\n",
        ]
    )


def _row(name: str, field: FieldInfo) -> str:
    default = "required" if field.is_required() else f"`{field.default}`"
    default = "none" if field.default is None else default
    return f"| `{name}` | {_allowed(field)} | {default} |"


def _allowed(field: FieldInfo) -> str:
    """Return a field's type and bounds in words."""
    choices: tuple[Any, ...] = getattr(field.annotation, "__args__", ())
    if choices and all(isinstance(choice, str) for choice in choices):
        return ", ".join(f"`{choice}`" for choice in choices)
    if Ellipsis in choices:
        return "rows of numbers, of each colour"
    if type(None) in choices:  # may be left out
        return f"number, {_bounds(choices[0].__metadata__[0].metadata)}"
    if choices:
        return f"{len(choices)} numbers, {_bounds(choices[0].__metadata__[0].metadata)}"
    kind = "whole number" if field.annotation is int else "number"
    return ", ".join(part for part in (kind, _bounds(field.metadata)) if part)


def _bounds(metadata: Any) -> str:
    found = (
        f"{sign} {getattr(item, name):g}"
        for item in metadata
        for name, sign in _BOUNDS.items()
        if getattr(item, name, None) is not None
    )
    return ", ".join(found)


if __name__ == "__main__":
    sys.stdout.write(catalogue())
