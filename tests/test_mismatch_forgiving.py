"""What was dropped beside something wrong is tried once more: what was dropped last, later."""

from types import SimpleNamespace
from typing import Any

import pytest

from analysis.mismatch.forgiving import to_forgive
from analysis.mismatch.judge import INSTEAD, LITTLE, NEEDLESS

SOME: dict[str, Any] = {name: SimpleNamespace(name=name) for name in ("bend", "residue", "glow")}


@pytest.mark.parametrize(
    ("refused", "named", "found"),
    [
        ({"bend": LITTLE, "residue": LITTLE}, [], ["bend"]),
        ({"residue": LITTLE, "bend": LITTLE}, [], ["residue"]),
        ({"bend": LITTLE}, [], ["bend"]),
        ({"bend": LITTLE, "residue": LITTLE, "glow": NEEDLESS}, [], ["bend", "residue"]),
        ({"bend": f"{INSTEAD} glow explains better"}, [], ["bend"]),
        ({"bend": f"{INSTEAD} glow explains better"}, ["glow"], []),
        ({"bend": f"{INSTEAD} afterglow explains better"}, ["glow"], ["bend"]),
        ({"bend": NEEDLESS}, [], []),
        ({}, ["glow"], []),
    ],
)
def test_which_are_tried_once_more(
    refused: dict[str, str], named: list[str], found: list[str]
) -> None:
    dropped = [SOME[name] for name in SOME if name not in named]
    made = to_forgive(refused, dropped, [SOME[name] for name in named])
    assert [one.name for one in made] == found
