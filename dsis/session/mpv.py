"""The player for reference monitors: mpv (0.35 or newer), driven over its JSON IPC.

Raw frames go to mpv as they are (`--demuxer=rawvideo`): no container, no decoder, no conversion of
colours. Its counters alone prove nothing (a clip that took eight times as long reported no drop),
so the wall clock from the first frame to the last must agree with them.
"""

import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, final

from dsis.errors import DamagedError, InputError
from dsis.session.cliplog import ClipLog
from dsis.session.clips import PlayerClip
from dsis.session.mpvipc import Connection
from dsis.session.steps import GREY, Step
from dsis.spec import Sequence as Size

OLDEST = (0, 35)
NEW_BACKGROUND = (0, 38)  # `--background` names a kind of background from here on
NEW_LOADFILE = (0, 38)  # `loadfile` takes a place in the playlist before the options from here on
COUNTERS = (
    "frame-drop-count",
    "decoder-frame-drop-count",
    "mistimed-frame-count",
    "vo-delayed-frame-count",
    "vsync-ratio",
    "vsync-jitter",
    "display-fps",
    "estimated-frame-number",
    "current-vo",
)
ANSWER_S = 10.0
LATE_FRAMES = 2  # messages about the first and the last frame may each come one frame late


@final
class MpvPlayer:
    """mpv on one screen, full screen and pixel for pixel.

    Parameters
    ----------
    size
        Width, height and frame rate of all clips.
    screen
        Number of the screen, from 0; None: the one that the window system chooses.
    output
        mpv's video output: `gpu`, or `x11` where there is no GPU.
    full_screen
        False: a window without border at the top left.

    Raises
    ------
    InputError
        mpv is missing or too old.
    """

    def __init__(
        self,
        size: Size,
        *,
        screen: int | None = None,
        output: str = "gpu",
        full_screen: bool = True,
    ) -> None:
        self._program, self.version = find_mpv()
        self._size = size
        self._folder = Path(tempfile.mkdtemp(prefix="dsis-mpv-"))
        self._grey = self._folder / "grey.rgb"
        code = bytes.fromhex(GREY.removeprefix("#"))
        self._grey.write_bytes(code * (size.width * size.height))
        self.command = self._command(screen, output, full_screen=full_screen)
        self._process: subprocess.Popen[bytes] | None = None
        self._ipc: Connection | None = None

    def describe(self) -> dict[str, Any]:
        """Return program, version and settings."""
        version = ".".join(map(str, self.version))
        return {"player": "mpv", "version": version, "command": self.command[1:]}

    def show(self, steps: Sequence[Step], clips: Mapping[str, PlayerClip]) -> tuple[ClipLog, ...]:
        """Show every step, grey at the end; see `Player`."""
        ipc = self._started()
        logs = []
        for step in steps:
            if step.show == "grey":
                self._load(ipc, self._grey, None)
                ipc.ask("show-text", step.label, round(1000 * step.seconds))
                time.sleep(step.seconds)
                ipc.ask("show-text", "", 1)
            else:
                logs.append(self._play(ipc, step.show, step.seconds, clips[step.show]))
        self._load(ipc, self._grey, None)
        return tuple(logs)

    def close(self) -> None:
        """End mpv and remove what was made for it."""
        if self._ipc is not None:
            self._ipc.close()
        if self._process is not None:
            self._process.terminate()
            self._process.wait(ANSWER_S)
        self._ipc = self._process = None
        shutil.rmtree(self._folder, ignore_errors=True)

    def _play(
        self, ipc: Connection, show: Literal["reference", "test"], seconds: float, clip: PlayerClip
    ) -> ClipLog:
        """Show one clip and return what mpv and the clock say of it."""
        frames = max(1, round(seconds * self._size.fps))
        if frames > len(clip.frame_sha256):
            fact = f"{show}_s is {seconds:g}: longer than the clip, which mpv shows once"
            raise InputError.of("session", "", fact)
        began = self._load(ipc, clip.path, frames)
        last = (frames - 1) / self._size.fps
        ended = ipc.until("eof-reached", began + last + ANSWER_S + last)
        counters = {name: ipc.get(name) for name in COUNTERS}
        time.sleep(1.0 / self._size.fps)  # the last frame stays as long as the others
        late = int(((ended - began) - last) * self._size.fps) - LATE_FRAMES
        counted = sum(int(counters[name] or 0) for name in COUNTERS[:2])
        if counters["estimated-frame-number"] != frames - 1:
            counted = max(counted, 1)
        facts = {**counters, "wall_s": round(ended - began, 4), "frames": frames}
        return ClipLog(show=show, dropped=max(counted, late, 0), counters=facts)

    def _load(self, ipc: Connection, path: Path, frames: int | None) -> float:
        """Show the first frame of a file, go on, and return when it was there."""
        options: list[object] = []
        if frames is not None:
            # Half a frame more: a limit on a frame's own time may take it in or leave it out.
            options = [f"end={(frames - 0.5) / self._size.fps:.6f}"]
            if self.version >= NEW_LOADFILE:
                options.insert(0, -1)
        ipc.forget()
        ipc.ask("loadfile", str(path), "replace", *options)
        return ipc.event("playback-restart", time.monotonic() + ANSWER_S)

    def _started(self) -> Connection:
        """Return the connection to mpv, which is started where it does not run."""
        if self._process is not None and self._process.poll() is None and self._ipc is not None:
            return self._ipc
        if self._ipc is not None:
            self._ipc.close()
        address = self._folder / "ipc"
        address.unlink(missing_ok=True)
        self._process = subprocess.Popen(  # noqa: S603  found by name, options of ours
            [*self.command, f"--input-ipc-server={address}"], stdin=subprocess.DEVNULL
        )
        self._ipc = Connection(address, self._process, ANSWER_S)
        self._load(self._ipc, self._grey, None)
        self._check_pixels(self._ipc)
        return self._ipc

    def _check_pixels(self, ipc: Connection) -> None:
        """Raise `DamagedError` unless one pixel of the clip is one pixel of the window."""
        inside = ipc.get("osd-dimensions") or {}
        width = inside.get("w", 0) - inside.get("ml", 0) - inside.get("mr", 0)
        height = inside.get("h", 0) - inside.get("mt", 0) - inside.get("mb", 0)
        wanted = (self._size.width, self._size.height)
        # Without a window manager a window may be larger than the monitor.
        monitor = (ipc.get("display-width") or width, ipc.get("display-height") or height)
        shown = (min(width, monitor[0]), min(height, monitor[1]))
        if shown != wanted:
            message = (
                f"mpv shows {shown[0]} x {shown[1]} pixels, the clips have {wanted[0]} x "
                f"{wanted[1]}: the monitor is too small, or its picture is scaled"
            )
            raise DamagedError(message)

    def _command(self, screen: int | None, output: str, *, full_screen: bool) -> list[str]:
        size = self._size
        grey = (
            [f"--background={GREY}"]
            if self.version < NEW_BACKGROUND
            else ["--background=color", f"--background-color={GREY}"]
        )
        place = ["--fs"] if full_screen else [f"--geometry={size.width}x{size.height}+0+0"]
        if screen is not None:
            place += [f"--screen={screen}", f"--fs-screen={screen}"]
        exact = (
            "--no-config --no-terminal --no-audio --hwdec=no --vf= --video-unscaled=yes "
            "--scale=nearest --cscale=nearest --dscale=nearest --correct-downscaling=no "
            "--dither-depth=no --framedrop=vo --video-sync=audio --demuxer=rawvideo "
            "--demuxer-rawvideo-mp-format=rgb24"
        )
        quiet = (
            "--idle=yes --force-window=yes --keep-open=yes --keep-open-pause=no --no-border "
            "--osc=no --osd-level=1 --osd-bar=no --osd-align-x=center --osd-align-y=center "
            "--osd-color=#000000 --osd-border-size=0 --cursor-autohide=always "
            "--no-input-default-bindings --no-input-builtin-bindings --input-vo-keyboard=no"
        )
        raw = [
            f"--demuxer-rawvideo-w={size.width}",
            f"--demuxer-rawvideo-h={size.height}",
            f"--demuxer-rawvideo-fps={size.fps:g}",
        ]
        words = [*exact.split(), *quiet.split(), *raw, *place, *grey, f"--vo={output}"]
        return [self._program, *words]


def find_mpv() -> tuple[str, tuple[int, int]]:
    """Return the program and its version; raise `InputError` where it is missing or too old."""
    program = shutil.which("mpv")
    wanted = ".".join(map(str, OLDEST))
    if program is None:
        fact = f"is not found: install mpv {wanted} or newer, or leave out --player mpv"
        raise InputError.of("mpv", "", fact)
    said = subprocess.run(  # noqa: S603  found by name
        [program, "--no-config", "--version"], capture_output=True, text=True, check=False
    ).stdout
    found = re.match(r"mpv v?(\d+)\.(\d+)", said)
    version = (int(found[1]), int(found[2])) if found else (0, 0)
    if version < OLDEST:
        fact = f"{program} says {said.splitlines()[:1]}, must be version {wanted} or newer"
        raise InputError.of("mpv", "", fact)
    return program, version
