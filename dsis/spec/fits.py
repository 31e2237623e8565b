"""Whether the parts of a spec fit one another: sizes, lengths, names."""

from collections import Counter
from pathlib import Path

from dsis.errors import Fault, InputError
from dsis.imagefile import find_files, info
from dsis.spec.schema import TRAINING, Content, Sequence, Session, still_name


def misfits(
    contents: tuple[Content, ...], sequence: Sequence, folder: Path, file: str
) -> list[Fault]:
    """Return the faults of footage that is too small or too short, and of doubled names."""
    faults = []
    names: Counter[str] = Counter()
    for i, content in enumerate(contents):
        for key in ("files", "stills"):
            paths = find_files(folder, getattr(content, key) or ())
            at = f"content[{i}].{key}"
            names.update({still_name(p): 1 for p in paths} if key == "stills" and paths else {})
            still = key == "stills" or len(paths) == 1
            if paths and not still and len(paths) < sequence.frames:
                fact = f"{len(paths)} frames found, sequence needs {sequence.frames}"
                faults.append(Fault(file, at, fact))
            faults += _too_small(paths if still else paths[:1], content, sequence, still, file, at)
        names.update([content.name] if content.name and content.stills is None else [])
    if TRAINING in names:
        fact = f"{TRAINING!r} is the name of the training's own content: give another"
        faults.append(Fault(file, "content", fact))
    twice = [name for name, count in names.items() if count > 1]
    faults += [Fault(file, "content", f"two contents have the name {name!r}") for name in twice]
    return faults


def _too_small(
    paths: tuple[Path, ...], content: Content, sequence: Sequence, still: bool, file: str, key: str
) -> list[Fault]:
    faults: list[Fault] = []
    scale = content.oversampling or 1
    travel = abs(content.pan_px_per_frame) * (sequence.frames - 1) if still else 0.0
    rows, columns = scale * sequence.height, int(-(-scale * (sequence.width + travel) // 1))
    for path in paths:
        try:
            found = info(path)
        except InputError as error:
            faults += error.faults
            continue
        if found.rows < rows or found.columns < columns:
            fact = f"{path.name} is {found.columns}x{found.rows} pixels, must be {columns}x{rows} "
            fact += f"or more ({scale} x sequence {sequence.width}x{sequence.height}"
            fact += f" + a pan of {travel:g})" if travel else ")"
            faults.append(Fault(file, key, fact))
    return faults


def too_long(session: Session, sequence: Sequence, file: str) -> list[Fault]:
    """Return the faults of clips that are to be shown for longer than they last."""
    return [
        Fault(
            file,
            f"session.{key}",
            f"is {value:g} s, must be <= sequence.seconds = {sequence.seconds:g}",
        )
        for key, value in (("reference_s", session.reference_s), ("test_s", session.test_s))
        if value > sequence.seconds
    ]
