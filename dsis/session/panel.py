"""The panel: who is planned, and who begins. Observers come in pairs of opposite order."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from dsis.errors import InputError
from dsis.manifest import Manifest
from dsis.session.plan import Presentation, draw_plan, plan_remarks
from dsis.session.setup import current_setup
from dsis.session.store import OBSERVER, STORE, Store


def add_to_panel(store: Store, manifest: Manifest, observer: str, seed: int) -> None:
    """Draw and store the plan of a new observer (a person), in reverse order if one waits for that.

    Raises
    ------
    InputError
        The observer is there already, or the name cannot be one.
    """
    with store.transaction():
        mirrors = unpaired(store, seed)
        hidden = current_setup(store, manifest.session).hidden_references
        plan = draw_plan(manifest, observer, seed, mirrors=mirrors, hidden_references=hidden)
        store.add_observer(observer, plan, simulated=False)
        store.log("paired", observer=observer, mirrors=mirrors)


def unpaired(store: Store, seed: int) -> str | None:
    """Return the last person whose order nobody has in reverse yet, of this seed; None: nobody."""
    seeds = {known.observer: known.seed for known in store.observers()}
    waiting: list[str] = []
    for fact in store.events("paired"):
        if fact["mirrors"] is None:
            waiting.append(fact["observer"])
        else:
            waiting.remove(fact["mirrors"])
    return next((name for name in reversed(waiting) if seeds[name] == seed), None)


def names_of_panel(store: Store, size: int) -> list[str]:
    """Return names for observers so that people with a plan come to `size` in number: P01, P02."""
    taken = {known.observer for known in store.observers()}
    missing = size - sum(not known.simulated for known in store.observers())
    names: list[str] = []
    number = 0
    while len(names) < missing:
        number += 1
        name = f"P{number:02d}"
        if name not in taken:
            names.append(name)
    return names


def enrol(
    store: Store,
    manifest: Manifest,
    observer: str,
    *,
    resume: bool,
    seed: int,
    say: Callable[[str], object],
) -> None:
    """Let an observer begin, with the plan that is stored or a new one, or go on.

    Raises
    ------
    InputError
        The observer has begun already; or, to resume, has not.
    """
    with store.transaction():
        known = store.observer(observer)
        if known is not None and known.simulated:
            raise InputError.of(store.path, "observer", f"{observer!r} is a simulated observer")
        begun = any(fact["observer"] == observer for fact in store.events("began"))
        if resume:
            if not begun:
                fact = f"{observer!r} has no session to resume"
                raise InputError.of(store.path, "observer", fact)
            store.log("resumed", observer=observer)
            return
        if begun:
            fact = f"{observer!r} is there already: take another id, or --resume"
            raise InputError.of(store.path, "observer", fact)
        if known is None:
            add_to_panel(store, manifest, observer, seed)
        store.log("began", observer=observer)
    for remark in plan_remarks(plan_of(store, observer), manifest):
        say(f"plan: {remark}")


@contextmanager
def held(folder: Path, observer: str) -> Iterator[None]:
    """Hold an observer's session for this process; `InputError` where another one holds it.

    The lock goes with the process, however that ends.
    """
    if not OBSERVER.fullmatch(observer):
        fact = f"is {observer!r}, must be up to 64 letters, digits, '_', '-' and '.'"
        raise InputError.of("observer", "", fact)
    (folder / STORE).parent.mkdir(exist_ok=True)
    lock = FileLock((folder / STORE).with_name(f"{observer}.lock"))
    try:
        lock.acquire(blocking=False)
    except Timeout:
        fact = f"{observer!r} is held by another process: end that one first"
        raise InputError.of(folder / STORE, "observer", fact) from None
    try:
        yield
    finally:
        lock.release()


def plan_of(store: Store, observer: str) -> Sequence[Presentation]:
    """Return the plan of an observer as it is stored, repeated presentations included."""
    return [row.presentation for row in store.rows(observer)]
