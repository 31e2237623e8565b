"""What was shown: the stimuli's own figures, from the `stimuli.csv` beside exported votes."""

from pathlib import Path

import pandas as pd

from analysis.figures import DEMOSAICKERS, NOISES
from dsis.errors import InputError

STIMULI = "stimuli.csv"
_TEXT = ("stimulus", "role", "content", "noise", "demosaic")
_NUMBERS = (
    "level",
    "psnr_db",
    "psnr_demosaicked_db",
    "visible_noise",
    "visible_colour",
    "effects_psnr_db",
    "effects_visible_ratio",
)


def shown_stimuli(votes_csv: Path) -> list[dict[str, object]]:
    """Return a row per test clip of the `stimuli.csv` beside a file of votes.

    Empty where there is no such file, or where its clips carry no figures (made elsewhere). Raises
    `InputError` where the file is there and cannot be used.
    """
    path = votes_csv.resolve().with_name(STIMULI)
    if not path.is_file():
        return []
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(_TEXT, str), keep_default_na=True)
    except (ValueError, OSError) as error:
        raise InputError.of(path, "", f"cannot be read: {error}") from None
    missing = [name for name in (*_TEXT, *_NUMBERS) if name not in table]
    if missing:
        raise InputError.of(path, ", ".join(missing), "is missing (column)")
    tests = table[(table["role"] == "test") & table["psnr_db"].notna()]
    return [
        {str(key): value for key, value in row.items()}
        | {
            "noise": NOISES.get(row["noise"], row["noise"]),
            "demosaic": DEMOSAICKERS.get(row["demosaic"], row["demosaic"]),
            "kind": "test",
            "level": "" if pd.isna(row["level"]) else f"{row['level']:g}",
        }
        for row in tests.to_dict("records")
    ]
