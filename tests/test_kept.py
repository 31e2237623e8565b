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
