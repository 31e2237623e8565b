"""Columns of a table, declared once: name, kind, unit, meaning.

What reads a cell, what checks it, what writes it and what explains it to a person all follow from
the declaration.
"""

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

import pandas as pd

# ASCII only, and no "nan", "inf" or "1_000", all of which float() would take.
_NUMBER = re.compile(r"[+-]?([0-9]+([.][0-9]*)?|[.][0-9]+)([eE][+-]?[0-9]+)?")
_FLAGS = {"true": True, "1": True, "false": False, "0": False}


class Kind(StrEnum):
    """What a cell holds; the value is the type name of the Table Schema (Frictionless)."""

    TEXT = "string"
    WHOLE = "integer"
    NUMBER = "number"
    FLAG = "boolean"
    TIME = "datetime"


DTYPES = {
    Kind.TEXT: "str",
    Kind.WHOLE: "Int64",
    Kind.NUMBER: "float64",
    Kind.FLAG: "bool",
    Kind.TIME: "str",
}


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name, kind, unit, meaning
        As the codebook shows them; an empty unit: none.
    required
        The table cannot be used without this column.
    filled
        A blank cell is a fault.
    default
        What a blank cell, or an absent column, means; None: not known.
    least
        Smallest value allowed, or None.
    allowed
        The words allowed; empty: any.
    """

    name: str
    kind: Kind
    unit: str
    meaning: str
    required: bool = False
    filled: bool = False
    default: str | float | bool | None = None
    least: float | None = None
    allowed: tuple[str, ...] = ()

    def parse(self, text: str, *, decimal_comma: bool = False) -> str | float | bool | None:
        """Return the value of a cell without surrounding blanks; `ValueError` says what is wrong.

        With `decimal_comma`, "3,5" is the number 3.5.
        """
        if not text:
            if self.filled:
                fact = "is blank"
                raise ValueError(fact)
            return self.default
        value = _parse(self.kind, text, decimal_comma=decimal_comma)
        if self.allowed and value not in self.allowed:
            fact = f"is {_quoted(text)}, must be one of {', '.join(self.allowed)}"
            raise ValueError(fact)
        if self.least is not None and isinstance(value, float) and value < self.least:
            fact = f"is {text}, must be at least {self.least:g}"
            raise ValueError(fact)
        return value


def _parse(kind: Kind, text: str, *, decimal_comma: bool) -> str | float | bool:
    if kind is Kind.TEXT:
        return text
    if kind is Kind.FLAG:
        if text.lower() not in _FLAGS:
            fact = f"is {_quoted(text)}, must be true or false"
            raise ValueError(fact)
        return _FLAGS[text.lower()]
    if kind is Kind.TIME:
        return _time(text)
    plain = text.replace(",", ".") if decimal_comma and text.count(",") == 1 else text
    if not _NUMBER.fullmatch(plain) or not math.isfinite(float(plain)):
        fact = f"is {_quoted(text)}, must be a number"
        if re.fullmatch(r"[+-]?[0-9]+,[0-9]+", text):
            fact += " (decimal commas need semicolons or tabs between the cells)"
        raise ValueError(fact)
    if kind is Kind.WHOLE and not float(plain).is_integer():
        fact = f"is {text}, must be a whole number"
        raise ValueError(fact)
    return float(plain)


def _time(text: str) -> str:
    try:
        offset = datetime.fromisoformat(text).utcoffset()
    except ValueError:
        offset = None
    if offset is None:
        fact = f"is {_quoted(text)}, must be ISO 8601 with offset, 2026-03-01T09:30:00+01:00"
        raise ValueError(fact)
    return text


def _quoted(text: str) -> str:
    return f'"{text}"' if len(text) <= 40 else f'"{text[:37]}..."'


def codebook(columns: Sequence[Column]) -> list[dict[str, str]]:
    """Return name, type, unit and description of each column, as a Table Schema's fields."""
    return [
        {"name": c.name, "type": c.kind.value, "unit": c.unit, "description": c.meaning}
        for c in columns
    ]


def to_csv(table: pd.DataFrame, columns: Sequence[Column]) -> str:
    """Return `table` as CSV text with line feeds: the declared columns, then any others.

    Numbers have the shortest form that reads back to the same value; what is not known is blank.
    """
    kinds = {column.name: column.kind for column in columns}
    others = [str(name) for name in table.columns if name not in kinds]
    cells = [_cells(table[name], kinds.get(name, Kind.TEXT)) for name in [*kinds, *others]]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*kinds, *others])
    writer.writerows(zip(*cells, strict=True))
    return text.getvalue()


def _cells(series: pd.Series, kind: Kind) -> list[str]:
    blank = series.isna().tolist()
    return [
        "" if empty else _cell(value, kind)
        for value, empty in zip(series.tolist(), blank, strict=True)
    ]


def _cell(value: object, kind: Kind) -> str:
    if kind is Kind.FLAG:
        return "true" if value else "false"
    if kind in (Kind.WHOLE, Kind.NUMBER):
        return repr(float(str(value))).removesuffix(".0")
    return str(value)
