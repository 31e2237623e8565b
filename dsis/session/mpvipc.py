"""mpv's JSON IPC: one JSON object a line over a Unix socket, answers matched by number."""

import json
import socket
import subprocess
import time
from pathlib import Path
from typing import Any, final

from dsis.errors import DamagedError, InputError


@final
class Connection:
    """A connection to a running mpv.

    Raises
    ------
    DamagedError
        mpv does not answer within `answer_s`, or has ended.
    """

    def __init__(self, path: Path, process: subprocess.Popen[bytes], answer_s: float) -> None:
        self._answer_s, self._number = answer_s, 0
        self._events: list[tuple[float, dict[str, Any]]] = []
        self._rest = b""
        if not hasattr(socket, "AF_UNIX"):
            raise InputError.of("mpv", "", "is driven over Unix sockets, which this system lacks")
        self._socket = _connected(path, process, time.monotonic() + answer_s)
        self.ask("observe_property", 1, "eof-reached")

    def ask(self, *command: object) -> Any:
        """Send a command and return its data; None where mpv has none."""
        self._number += 1
        request = json.dumps({"command": command, "request_id": self._number})
        try:
            self._socket.sendall(request.encode() + b"\n")
        except OSError as error:
            text = f"mpv has ended: {error}"
            raise DamagedError(text) from None
        deadline = time.monotonic() + self._answer_s
        while True:
            message = self._line(deadline)
            if message.get("request_id") == self._number and "error" in message:
                return message.get("data")
            self._events.append((time.monotonic(), message))

    def get(self, name: str) -> Any:
        """Return a property; None where it is not available."""
        value = self.ask("get_property", name)
        # The frame rate of a virtual screen is no number.
        return None if value in ("nan", "-nan") else value

    def forget(self) -> None:
        """Drop the events that came so far."""
        self._events.clear()

    def event(self, name: str, deadline: float) -> float:
        """Wait for an event and return when it came (`time.monotonic`)."""
        return self._wait(lambda message: message.get("event") == name, name, deadline)

    def until(self, name: str, deadline: float) -> float:
        """Wait until an observed property is true, and return when that was."""

        def true(message: dict[str, Any]) -> bool:
            return message.get("name") == name and message.get("data") is True

        return self._wait(true, name, deadline)

    def close(self) -> None:
        """Close the connection; mpv goes on."""
        self._socket.close()

    def _wait(self, wanted: Any, name: str, deadline: float) -> float:
        while True:
            while self._events:
                at, message = self._events.pop(0)
                if wanted(message):
                    return at
            try:
                message = self._line(deadline)
            except TimeoutError:
                text = f"mpv never said {name}"
                raise DamagedError(text) from None
            self._events.append((time.monotonic(), message))

    def _line(self, deadline: float) -> dict[str, Any]:
        while b"\n" not in self._rest:
            self._socket.settimeout(max(deadline - time.monotonic(), 0.001))
            try:
                data = self._socket.recv(65536)
            except TimeoutError:
                raise DamagedError("mpv does not answer") from None
            except OSError as error:
                message = f"mpv has ended: {error}"
                raise DamagedError(message) from None
            if not data:
                raise DamagedError("mpv has ended")
            self._rest += data
        line, _, self._rest = self._rest.partition(b"\n")
        found = json.loads(line)
        return found if isinstance(found, dict) else {}


def _connected(path: Path, process: subprocess.Popen[bytes], deadline: float) -> socket.socket:
    """Return a socket to mpv once it listens."""
    while time.monotonic() < deadline and process.poll() is None:
        connection = socket.socket(socket.AF_UNIX)
        try:
            connection.connect(str(path))
        except OSError:
            connection.close()
            time.sleep(0.02)
        else:
            return connection
    message = f"mpv did not start (status {process.poll()})"
    raise DamagedError(message)
