"""`dsis session --plan`: draw, check, store and show who sees what in which order."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from dsis.errors import DamagedError
from dsis.manifest import Manifest, read_manifest
from dsis.session.panel import add_to_panel, names_of_panel, plan_of
from dsis.session.plan import Presentation, early_and_late, plan_remarks
from dsis.session.setup import Setup, current_setup, put_in_force
from dsis.session.steps import presentation_s
from dsis.session.store import open_store
from dsis.session.validate import validate_panel, validate_plan

Plans = dict[str, Sequence[Presentation]]


def plan_panel(
    folder: Path, observer: str | None = None, *, seed: int = 1, setup: Setup | None = None
) -> str:
    """Store the plans that are missing and return all of them as text.

    Parameters
    ----------
    folder
        The stimuli folder.
    observer
        The one to plan for; None: as many as the spec asks for, named P01, P02 ...
    seed
        Of the plans that are drawn now.
    setup
        The laboratory's, in force from now on; None: as it was.

    Raises
    ------
    InputError
        The name cannot be one, or the set-up asks for other plans than those there are.
    DamagedError
        A plan breaks a rule.
    """
    manifest = read_manifest(folder)
    with open_store(folder, manifest) as store:
        if setup is not None:
            put_in_force(store, setup, manifest.session)
        hidden = current_setup(store, manifest.session).hidden_references
        with store.transaction():
            if observer is None:
                new = names_of_panel(store, manifest.session.observers)
            else:
                new = [] if store.observer(observer) else [observer]
            for name in new:
                add_to_panel(store, manifest, name, seed)
        people = [known.observer for known in store.observers() if not known.simulated]
        plans = {name: plan_of(store, name) for name in people}
    _check(plans, manifest, hidden_references=hidden)
    shown = plans if observer is None else {observer: plans[observer]}
    return "\n".join(_text(plans, shown, manifest))


def _check(plans: Plans, manifest: Manifest, *, hidden_references: bool) -> None:
    """Raise `DamagedError` where a plan in the store is not what its rules say."""
    faults = [
        f"{observer}: {fault}"
        for observer, plan in plans.items()
        for fault in validate_plan(_as_drawn(plan), manifest, hidden_references=hidden_references)
    ]
    if faults:
        raise DamagedError("\n".join(faults))


def _as_drawn(plan: Sequence[Presentation]) -> list[Presentation]:
    """Return a plan without what was repeated: it ends where second attempts begin."""
    drawn = list(plan)
    repeats = [i for i, p in enumerate(drawn) if p.attempt > 1]
    if not repeats:
        return drawn
    end = repeats[0]
    while drawn[end - 1].kind == "dummy":  # it parts a repeated presentation from the one before
        end -= 1
    return drawn[:end]


def _text(plans: Plans, shown: Plans, manifest: Manifest) -> Iterator[str]:
    for observer, plan in shown.items():
        numbers = Counter(p.session for p in plan)
        lengths = ", ".join(
            f"{n * presentation_s(manifest.session) / 60:.0f}" for n in numbers.values()
        )
        yield (
            f"{observer}: {len(plan)} presentations in {len(numbers)} viewing sessions "
            f"of {lengths} minutes"
        )
        width = max(len(p.kind) for p in plan)
        before = 0
        for p in plan:
            if p.session != before:
                yield f"  viewing session {p.session}"
                before = p.session
            attempt = f"  attempt {p.attempt}" if p.attempt > 1 else ""
            yield f"    {p.place:>3}  {p.kind:<{width}}  {p.stimulus}{attempt}"
    first = next(iter(shown.values()))
    yield from (f"remark: {remark}" for remark in plan_remarks(first, manifest))
    yield f"rules: kept by all {len(plans)} plans"
    counts = early_and_late(list(plans.values()))
    most = max(abs(early - late) for early, late in counts.values())
    unbalanced = validate_panel(list(plans.values()))
    yield (
        f"balance: a stimulus is at most {most} times more often in one half of the test"
        + (f" ({len(unbalanced)} stimuli out of balance)" if unbalanced else "")
    )
