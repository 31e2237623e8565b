"""Frozen, strict models of what users write in TOML; every fault with its path in the file."""

import difflib
import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from dsis.errors import Fault, InputError


class Model(BaseModel):
    """Base of all values that come from a file: frozen, no unknown keys, no silent conversion."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, populate_by_name=True
    )


M = TypeVar("M", bound=Model)


def read_toml(path: Path) -> dict[str, Any]:
    """Return a TOML file as a dictionary; raise `InputError` where it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is not UTF-8 text"
        raise InputError.of(path, "", f"cannot be read: {reason}") from None
    except tomllib.TOMLDecodeError as error:
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
    if found is None:
        raise InputError(faults)
    return found


def attempt(
    kind: Any, values: Any, file: str, prefix: str = "", context: object = None
) -> tuple[Any, list[Fault]]:
    """Return (value of type `kind` or None, faults): for callers that gather more faults."""
    # JSON's rules accept an array for a tuple and a whole number for a float, and nothing else.
    text = json.dumps(values, default=str)
    try:
        return TypeAdapter(kind).validate_json(text, context=context), []
    except ValidationError as error:
        return None, [_fault(kind, item, file, prefix) for item in error.errors()]


def _fault(kind: Any, item: Any, file: str, prefix: str) -> Fault:
    location = tuple(part for part in item["loc"] if not _is_tag(part, item))
    key = _path(prefix, location)
    problem = item["type"]
    value = item.get("input")
    if problem == "extra_forbidden":
        known = _known_keys(kind, location[:-1])
        near = difflib.get_close_matches(str(location[-1]), known, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        return Fault(
            file,
            key,
            f"unknown key{hint} Allowed here: {', '.join(known)}".replace("y Al", "y. Al"),
        )
    if problem == "missing":
        return Fault(file, key, "is missing")
    if problem == "value_error":
        return Fault(file, key, str(item["ctx"]["error"]))
    fact = item["msg"][:1].lower() + item["msg"][1:]
    fact = fact.removeprefix("input should be ").removeprefix("value should be ")
    shown = json.dumps(value, default=str)
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    return Fault(file, key, f"is {shown}, must be {fact}" if fact != item["msg"] else fact)


def _is_tag(part: object, item: Any) -> bool:
    """Pydantic puts the tag of a tagged union into the location: `effect.0.row_noise.sigma_dn`."""
    del item
    return isinstance(part, str) and part.startswith("tag:")


def _path(prefix: str, location: Sequence[object]) -> str:
    path = prefix
    for part in location:
        if isinstance(part, int):
            path += f"[{part}]"
        else:
            path += f".{part}" if path else str(part)
    return path


def _known_keys(kind: Any, location: Sequence[object]) -> list[str]:
    """Return the keys that the model at `location` inside `kind` allows."""
    for part in location:
        if isinstance(part, int):
            kind = next((a for a in get_args(kind) if a is not Ellipsis), kind)
        else:
            kind = _field_type(kind, str(part))
    fields = getattr(_model_of(kind), "model_fields", {})
    return [field.alias or name for name, field in fields.items()]


def _model_of(kind: Any) -> Any:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind
    return next((found for a in get_args(kind) if (found := _model_of(a)) is not None), None)


def _field_type(kind: Any, name: str) -> Any:
    for key, field in getattr(_model_of(kind), "model_fields", {}).items():
        if name in (key, field.alias):
            return field.annotation
    return None
