"""One window at a time: which page of the browser holds the session.

A page holds it for as long as its connection to `/api/window` lives, so a closed, crashed or
reloaded page gives it back without a word, and no clock is needed.
"""

import secrets
from threading import Lock

from dsis.errors import InputError


class Windows:
    """Gives the session to one window, by a token that its every request carries."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._holder: str | None = None

    def claim(self) -> str:
        """Return the token of the window that holds the session from now on.

        Raises
        ------
        InputError
            Another window holds it.
        """
        with self._lock:
            if self._holder is not None:
                raise InputError.of("window", "", "the session is open in another window")
            self._holder = secrets.token_urlsafe(16)
            return self._holder

    def release(self, token: str) -> None:
        """Give the session back."""
        with self._lock:
            if self._holder == token:
                self._holder = None

    def check(self, token: str | None) -> None:
        """Raise `InputError` unless the window with this token holds the session."""
        with self._lock:
            held = token is not None and token == self._holder
        if not held:
            raise InputError.of("window", "", "this window does not hold the session: reload it")
