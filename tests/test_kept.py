"""Promise: arrays that are asked for again are kept as long as they fit, and no longer."""

import numpy as np

from dsis.kept import Kept


def test_what_was_not_asked_for_longest_goes_first() -> None:
    made: list[int] = []

    def array(key: int) -> np.ndarray:
        made.append(key)
        return np.full(4, key, np.float32)

    kept = Kept(32)  # two arrays of 16 bytes
    for key in (1, 2, 1, 3, 1, 2):
        assert (kept.of(key, lambda key=key: array(key)) == key).all()
    assert made == [1, 2, 3, 2]


def test_an_array_larger_than_all_is_made_each_time() -> None:
    kept = Kept(8)
    first, second = (kept.of("a", lambda: np.zeros(4)) for _ in range(2))
    assert first is not second
    assert not first.flags.writeable


def test_where_more_than_fits_is_asked_for_in_turn_some_stay() -> None:
    kept, made = Kept(32, patience=4), []

    def asked(key: int) -> None:
        kept.of(key, lambda: made.append(key) or np.zeros(4, np.float32))

    for key in (1, 2, 3) * 4:
        asked(key)
    assert made == [1, 2, 3, 3, 3, 3]
    for key in (4, 5) * 8:
        asked(key)
    assert made.count(4) + made.count(5) < 16  # what nobody asks for any more goes


def test_nothing_is_made_for_which_there_is_no_room() -> None:
    kept = Kept(16, patience=4)
    assert kept.if_room("a", 16, lambda: np.zeros(4, np.float32)) is not None
    assert kept.if_room("b", 16, lambda: 1 / 0) is None
    assert kept.if_room("a", 16, lambda: 1 / 0) is not None
