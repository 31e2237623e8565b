"""What stood on the screen: one line of JSON for every clip that was shown and voted on."""

import gzip
import io
import json
from collections.abc import Iterator
from typing import Any

from dsis.session.store import Store


def frame_log(store: Store) -> Iterator[dict[str, Any]]:
    """Yield a log for every clip, in the order of the votes.

    `frames` are [frame, time in ms after the first]; `refresh_hz`, `device_pixel_ratio` and
    `full_screen` are what the page measured when the presentation began.
    """
    rows = {row.id: row for row in store.rows()}
    started = {(e["presentation"], e["showing"]): e for e in store.events("started")}
    for event in store.events("voted"):
        row = rows[event["presentation"]]
        start = started.get((row.id, event.get("showing")), {})
        page = start.get("display", {})
        for clip in event.get("clips", []):
            p = row.presentation
            yield {
                "observer": row.observer,
                "presentation": p.place,
                "showing": event["showing"],
                "stimulus": p.stimulus if clip["show"] == "test" else p.reference,
                "started_at": start.get("at"),
                "refresh_hz": page.get("refresh_hz"),
                "device_pixel_ratio": page.get("device_pixel_ratio"),
                "full_screen": page.get("full_screen"),
                **clip,
            }


def packed(lines: Iterator[dict[str, Any]]) -> bytes:
    """Return lines of JSON, compressed; the same lines give the same bytes."""
    out = io.BytesIO()
    with gzip.GzipFile(fileobj=out, mode="wb", filename="", mtime=0) as file:
        for line in lines:
            file.write(json.dumps(line, ensure_ascii=False, separators=(",", ":")).encode() + b"\n")
    return out.getvalue()
