"""Arrays that are asked for again and again: kept as long as they fit, the latest of them."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from threading import Lock
from typing import Any

from numpy.typing import NDArray


@dataclass
class _Asked:
    """An array, and the number of the last request for it."""

    array: NDArray[Any]
    when: int


class Kept:
    """Arrays by key, up to so many bytes in all; what was not asked for longest goes first.

    Parameters
    ----------
    most_bytes
        Of all arrays; a larger one is not kept.
    patience
        How often, for each array kept, others may be asked for before the oldest goes. Where more
        arrays than fit are asked for in turn, without it each would go before its turn.
    """

    def __init__(self, most_bytes: int, patience: int = 0) -> None:
        self._most, self._bytes, self._lock = most_bytes, 0, Lock()
        self._patience, self._asked = patience, 0
        self._arrays: OrderedDict[Hashable, _Asked] = OrderedDict()

    def keep(self, most_bytes: int) -> None:
        """Keep so much at least from now on."""
        with self._lock:
            self._most = max(self._most, most_bytes)

    def of(self, key: Hashable, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return the array of a key, read-only, made now unless it is there."""
        found = self._found(key)
        return self._made(key, make) if found is None else found

    def if_room(
        self, key: Hashable, size_bytes: int, make: Callable[[], NDArray[Any]]
    ) -> NDArray[Any] | None:
        """Return the array of a key as `of` does; None, and nothing made, if it would not stay."""
        found = self._found(key)
        if found is None:
            with self._lock:
                room = self._room(size_bytes)
            found = self._made(key, make) if room else None
        return found

    def __contains__(self, key: Hashable) -> bool:
        """Return whether the array of a key is there; that is no request for it."""
        with self._lock:
            return key in self._arrays

    def _found(self, key: Hashable) -> NDArray[Any] | None:
        with self._lock:
            self._asked += 1
            found = self._arrays.get(key)  # once: keys of many parts are slow to compare
            if found is None:
                return None
            self._arrays.move_to_end(key)
            found.when = self._asked
            return found.array

    def _made(self, key: Hashable, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        made = make()
        made.flags.writeable = False
        with self._lock:
            if key not in self._arrays and self._room(made.nbytes):
                self._arrays[key] = _Asked(made, self._asked)
                self._bytes += made.nbytes
        return made

    def _room(self, size_bytes: int) -> bool:
        """Return whether there is room; what is in the way goes, unless its turn may come again."""
        if size_bytes > self._most:
            return False
        while self._bytes + size_bytes > self._most:
            key, oldest = next(iter(self._arrays.items()))
            if self._asked - oldest.when < self._patience * len(self._arrays):
                return False
            del self._arrays[key]
            self._bytes -= oldest.array.nbytes
        return True
