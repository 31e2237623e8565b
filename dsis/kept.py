"""Arrays that are asked for again and again: kept as long as they fit, the latest of them."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any

from numpy.typing import NDArray


class Kept:
    """Arrays by key, up to so many bytes in all; what was not asked for longest goes first.

    Parameters
    ----------
    most_bytes
        Of all arrays; a larger one is not kept.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most, self._bytes, self._lock = most_bytes, 0, Lock()
        self._arrays: OrderedDict[Hashable, NDArray[Any]] = OrderedDict()

    def keep(self, most_bytes: int) -> None:
        """Keep so much at least from now on."""
        with self._lock:
            self._most = max(self._most, most_bytes)

    def of(self, key: Hashable, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return the array of a key, read-only, made now unless it is there."""
        with self._lock:
            if key in self._arrays:
                self._arrays.move_to_end(key)
                return self._arrays[key]
        made = make()
        made.flags.writeable = False
        with self._lock:
            if key not in self._arrays and made.nbytes <= self._most:
                self._arrays[key] = made
                self._bytes += made.nbytes
            while self._bytes > self._most:
                self._bytes -= self._arrays.popitem(last=False)[1].nbytes
        return made
