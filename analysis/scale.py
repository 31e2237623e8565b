"""The scale that observers voted on, and the test's title."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dsis.errors import InputError

PACKAGE = "datapackage.json"


@dataclass(frozen=True)
class Scale:
    """Lowest and highest grade, and the words at its ends (empty: none).

    BT.500's impairment scale has five grades; the paper's has ten.
    """

    low: float
    high: float
    low_label: str = ""
    high_label: str = ""

    def __str__(self) -> str:
        ends = [
            f"{grade:g} ({label})" if label else f"{grade:g}"
            for grade, label in ((self.low, self.low_label), (self.high, self.high_label))
        ]
        return " to ".join(ends)


@dataclass(frozen=True)
class Description:
    """What stands beside the votes: the scale and the title (empty: none)."""

    scale: Scale
    title: str = ""


def describe_test(votes_csv: Path, scale: tuple[float, float] | None = None) -> Description:
    """Return scale and title of the test whose votes are in `votes_csv`.

    Parameters
    ----------
    votes_csv
        The file of votes; the `datapackage.json` beside it is read where there is one.
    scale
        Lowest and highest grade, before what the package says.

    Raises
    ------
    InputError
        The ends are neither given nor in the package, or are no two ascending numbers.
    """
    file = votes_csv.parent / PACKAGE
    package = _read(file) if file.is_file() else {}
    stated = package.get("scale")
    if scale is not None:
        low, high = _ends(list(scale), "--scale", "")
    elif stated is not None:
        low, high = _ends(stated, str(file), "scale")
    elif not votes_csv.exists():
        raise InputError.of(votes_csv, "", "cannot be read: No such file or directory")
    else:
        raise InputError.of(
            votes_csv,
            "scale",
            f"is not known: give --scale LOW HIGH (such as --scale 1 10), "
            f'or "scale": [1, 10] in {file}',
        )
    labels = package.get("labels", ["", ""])
    # The words belong to the package's own grades.
    if stated != [low, high] or not _are_texts(labels):
        labels = ["", ""]
    title = package.get("title", "")
    return Description(Scale(low, high, *labels), title if isinstance(title, str) else "")


def _read(file: Path) -> dict[str, Any]:
    try:
        package = json.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise InputError.of(file, "", f"cannot be read: {error}") from None
    if not isinstance(package, dict):
        raise InputError.of(file, "", "must hold a JSON object")
    return package


def _ends(ends: Any, file: str, key: str) -> tuple[float, float]:
    sound = (
        isinstance(ends, list)
        and len(ends) == 2
        and all(type(end) in (int, float) and math.isfinite(end) for end in ends)
        and ends[0] < ends[1]
    )
    if not sound:
        fact = f"is {json.dumps(ends)}, must be two numbers, the lower first, such as [1, 10]"
        raise InputError.of(file, key, fact)
    return float(ends[0]), float(ends[1])


def _are_texts(labels: Any) -> bool:
    return (
        isinstance(labels, list)
        and len(labels) == 2
        and all(isinstance(label, str) for label in labels)
    )
