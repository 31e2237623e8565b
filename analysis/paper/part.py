"""What a table, a figure or the claims of the paper come out as: rows, tables, pictures, words."""

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

_NUMBER = re.compile("([-+\u2212]?[0-9.]+( \u00b1 [0-9.]+)?)?")

_MINUS = re.compile(r"(?<![\w.-])-(?=\d)")

HEADER = ("what", "published", "recomputed", "deviation", "standard error", "unit", "remark")


@dataclass(frozen=True)
class Row:
    """One number of the paper beside ours.

    Attributes
    ----------
    what
        Names it.
    published, recomputed
        In `unit`; None: not printed, or not to be had.
    standard_error
        Of `recomputed`; None: not known.
    unit
        Empty: a pure number.
    remark
        Why the two cannot agree, or what else a reader must know.
    """

    what: str
    published: float | None
    recomputed: float | None
    standard_error: float | None = None
    unit: str = ""
    remark: str = ""

    @property
    def deviation(self) -> float | None:
        """Ours less the paper's."""
        if self.published is None or self.recomputed is None:
            return None
        return self.recomputed - self.published

    def cells(self) -> tuple[str, ...]:
        """Return the row as text, in the order of `HEADER`."""
        values = (self.published, self.recomputed, self.deviation, self.standard_error)
        remark = _MINUS.sub("\u2212", self.remark)
        return (self.what, *(number(value) for value in values), self.unit, remark)


@dataclass(frozen=True)
class Table:
    """A table of text: file name without suffix, caption, header, rows."""

    name: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def is_text(self, column: int) -> bool:
        """Return whether a column holds words: some cell of it that is neither number nor blank."""
        return not all(_NUMBER.fullmatch(row[column]) for row in self.rows)

    def csv(self) -> str:
        """Return the table as CSV with line feeds."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.header)
        writer.writerows([[cell.replace("\u2212", "-") for cell in row] for row in self.rows])
        return text.getvalue()

    def markdown(self) -> str:
        """Return the table as Markdown, caption above."""
        ruler = ("---",) * len(self.header)
        lines = [f"| {' | '.join(cells)} |" for cells in (self.header, ruler, *self.rows)]
        return "\n".join([f"**{self.caption}**", "", *lines, ""])


@dataclass(frozen=True)
class Picture:
    """A figure: file name without suffix, and its caption."""

    name: str
    caption: str


@dataclass(frozen=True)
class Part:
    """One table, figure or equation of the paper, recomputed.

    Attributes
    ----------
    name, title
        What the command line calls it, and its heading.
    says
        Paragraphs: what was done, on what, and where agreement cannot be expected.
    rows
        The comparison, number by number.
    pictures, tables
        In the order of the page.
    """

    name: str
    title: str
    says: tuple[str, ...]
    rows: tuple[Row, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()

    def all_tables(self) -> tuple[Table, ...]:
        """Return the comparison as a table, where there is one, and the others."""
        if not self.rows:
            return self.tables
        cells = tuple(row.cells() for row in self.rows)
        compared = Table(self.name, f"{self.title}: published and recomputed", HEADER, cells)
        return (_without_empty(compared), *self.tables)


def number(value: float | None, digits: int = 4) -> str:
    """Return a number in `digits` significant digits with a typographic minus; blank for None."""
    if value is None or math.isnan(value):
        return ""
    if value == 0 or math.isinf(value):
        return f"{value:g}".replace("-", "\u2212")
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{min(places, digits)}f}"
    return text.replace("-", "\u2212") if float(text) else text.removeprefix("-")


def table_of(
    name: str, caption: str, header: Sequence[str], rows: Sequence[Sequence[object]]
) -> Table:
    """Return a table whose numbers are set as `number` does, with its minus in texts too."""

    def cell(given: object) -> str:
        return number(given) if isinstance(given, float) else _MINUS.sub("\u2212", str(given))

    cells = tuple(tuple(map(cell, row)) for row in rows)
    return Table(name, caption, tuple(header), cells)


def _without_empty(table: Table) -> Table:
    """Leave out columns in which nothing stands."""
    kept = [i for i, _ in enumerate(table.header) if any(row[i] for row in table.rows)]
    rows = tuple(tuple(row[i] for i in kept) for row in table.rows)
    return Table(table.name, table.caption, tuple(table.header[i] for i in kept), rows)
