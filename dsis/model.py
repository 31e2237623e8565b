"""Frozen, strict models of what users write in TOML; every fault with its path in the file."""

import datetime as dt
import difflib
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from dsis.errors import Fault, InputError


class Model(BaseModel):
    """Base of all values that come from a file: frozen, no unknown keys, no silent conversion."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, populate_by_name=True
    )


@dataclass(frozen=True)
class Elsewhere:
    """Marks a tagged union: kinds that users look for in it, and what to write instead."""

    instead: Mapping[str, str]


M = TypeVar("M", bound=Model)


def read_toml(path: Path) -> dict[str, Any]:
    """Return a TOML file as a dictionary; raise `InputError` where it cannot be read."""
    try:  # Windows' editors begin UTF-8 with a byte order mark
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is not UTF-8 text"
        raise InputError.of(path, "", f"cannot be read: {reason}") from None
    except (ValueError, RecursionError) as error:  # numbers of 5000 digits, 1000 brackets
        raise InputError.of(path, "", f"is not TOML: {error}") from None


def structure(
    kind: type[M], values: Mapping[str, Any], file: str, prefix: str = "", context: object = None
) -> M:
    """Return `values` as a model of `kind`; raise `InputError` with every fault there is.

    Parameters
    ----------
    kind
        The model.
    values
        What the file holds, as `tomllib` or `json` gives it.
    file
        Name of the file, for messages.
    prefix
        Path of `values` inside the file, for messages.
    context
        Handed to the validators (`ValidationInfo.context`): the folder that paths start from.
    """
    found, faults = attempt(kind, values, file, prefix, context)
    if not isinstance(found, kind):
        raise InputError(faults)
    return found


def attempt(
    kind: Any, values: Any, file: str, prefix: str = "", context: object = None
) -> tuple[Any, list[Fault]]:
    """Return (value of type `kind` or None, faults): for callers that gather more faults."""
    # JSON's rules accept an array for a tuple and a whole number for a float, and nothing else.
    text = json.dumps(values, default=str)
    dates = list(_dates(values, file, prefix))  # as text they would pass for titles and names
    try:
        value = TypeAdapter(kind).validate_json(text, strict=True, context=context)
    except ValidationError as error:
        items = error.errors()
        places = [item["loc"] for item in items]

        def alone(place: Sequence[object]) -> bool:
            return sum(p[: len(place)] == place for p in places) == 1

        faults = [
            _fault(kind, item, file, prefix)
            for item in items
            # An array whose items are all at fault is not empty besides.
            if item["type"] != "too_short" or alone(item["loc"])
        ]
        dated = {fault.key for fault in dates}
        return None, [*dates, *(fault for fault in faults if fault.key not in dated)]
    return (None, dates) if dates else (value, [])


def _dates(values: Any, file: str, key: str) -> Iterator[Fault]:
    """Yield a fault for every TOML date or time: no key of ours takes one."""
    if isinstance(values, dt.date | dt.time):
        yield Fault(file, key, f"is the date or time {values}, must be a number, or text in quotes")
    elif isinstance(values, Mapping):
        for name, value in values.items():
            yield from _dates(value, file, f"{key}.{name}" if key else str(name))
    elif isinstance(values, list | tuple):
        for i, value in enumerate(values):
            yield from _dates(value, file, f"{key}[{i}]")


def _fault(kind: Any, item: Any, file: str, prefix: str) -> Fault:
    key, parent = _walk(kind, item["loc"], prefix)
    problem, context = item["type"], item.get("ctx", {})
    if problem.startswith("union_tag"):
        key = f"{key}.{context['discriminator'].strip(chr(39))}"
    return Fault(file, key, _fact(problem, item, context, parent))


def _fact(problem: str, item: Any, context: Any, parent: Any) -> str:
    """Return what is wrong, in words that name the value and what was allowed."""
    match problem:
        case "extra_forbidden":
            known = _keys(parent)
            hint = _near(str(item["loc"][-1]), known, "; did you mean {}?")
            return f"unknown key{hint} (allowed here: {', '.join(known)})"
        case "missing" | "union_tag_not_found":
            return "is missing"
        case "value_error":
            return str(context["error"])
        case "union_tag_invalid":
            return _no_such_kind(context["tag"], context["expected_tags"], _instead(parent))
        case "too_short" | "too_long":
            least = context.get("min_length")
            bound = f"at least {least}" if least else f"at most {context['max_length']}"
            return f"has {context['actual_length']} items, must have {bound}"
    must = item["msg"][:1].lower() + item["msg"][1:]
    must = must.removeprefix("input should be ").removeprefix("value should be ")
    shown = json.dumps(item.get("input"), default=str, ensure_ascii=False)
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    return f"is {shown}, must be {must}"


def _no_such_kind(tag: str, expected: str, instead: Mapping[str, str]) -> str:
    if tag in instead:
        return f"is {tag!r}, which {instead[tag]}"
    known = sorted(expected.replace("'", "").split(", "))
    hint = _near(tag, known, " (did you mean {}?)")
    return f"is {tag!r}{hint}, must be one of: {', '.join(known)}"


def _instead(parent: Any) -> Mapping[str, str]:
    """Return what the union that `parent` is or lists says of kinds that it lacks."""
    marks = (mark for part in (parent, *get_args(parent)) for mark in get_args(part))
    return next((mark.instead for mark in marks if isinstance(mark, Elsewhere)), {})


def _near(word: str, known: Sequence[str], says: str) -> str:
    near = difflib.get_close_matches(word, known, 1)
    return says.format(near[0]) if near else ""


def _walk(kind: Any, location: Sequence[object], prefix: str) -> tuple[str, Any]:
    """Return the path of `location` as users write it, and the type that holds its last part.

    Pydantic names the tag of a tagged union (`effect[0].row_noise.sigma_dn`); the file does not.
    """
    path, parent = prefix, kind
    for part in location:
        parent = kind
        if isinstance(part, int):
            path += f"[{part}]"
            kind = next((a for a in get_args(_bare(kind)) if a is not Ellipsis), None)
            continue
        member = _tagged(kind, str(part))
        if member is not None:
            kind = member
            continue
        path += f".{part}" if path else str(part)
        kind = _fields(kind).get(str(part))
    return path, parent


def _bare(kind: Any) -> Any:
    """Return a type without `Annotated`."""
    return _bare(get_args(kind)[0]) if get_origin(kind) is Annotated else kind


def _tagged(kind: Any, tag: str) -> Any:
    """Return the member of a union whose `kind` is `tag`, if `kind` is such a union."""
    for member in get_args(_bare(kind)):
        field = getattr(member, "model_fields", {}).get("kind")
        if field is not None and field.default == tag:
            return member
    return None


def _model_of(kind: Any) -> Any:
    kind = _bare(kind)
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind
    return next((found for a in get_args(kind) if (found := _model_of(a)) is not None), None)


def _fields(kind: Any) -> dict[str, Any]:
    """Return the type of every key that the model `kind` allows, by its name in the file."""
    fields = getattr(_model_of(kind), "model_fields", {})
    return {field.alias or name: field.annotation for name, field in fields.items()}


def _keys(kind: Any) -> list[str]:
    return list(_fields(kind))
