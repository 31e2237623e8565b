"""What a deck of recordings hides, and a camera for each hand that can show it."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from third.cells import Bench, Cells
from third.drawing import draw_camera, log_uniform
from third.effect import Effect
from third.vocabulary import LISTED, UNLISTED, clash

ATTEMPTS = 400
BISECTIONS = 60
WEAKEST = 4.5  # z below which an effect is not planted
BEGINNING = 20261126  # the seeds of decks, apart from other uses of the same numbers
WRONG = [["slope"], ["intercept"], ["black"], ["slope", "intercept"], ["slope", "black"]]
SHARES = {"null": 0.2, "one": 0.4, "two": 0.2, "three": 0.1, "unlisted": 0.1}
COUNTS = {"one": 1, "two": 2, "three": 3}


@dataclass(frozen=True)
class Dealt:
    """A hand: its kind, a camera, the effects in it, and which numbers camera.toml has wrong."""

    kind: str
    bench: Bench
    effects: list[Effect]
    wrong: list[str]


@dataclass
class Dealer:
    """Deals effects in turn: all once before one comes twice."""

    chance: np.random.Generator
    listed: list[str] = field(default_factory=list)
    unlisted: list[str] = field(default_factory=list)
    nulls: int = 0

    def deal(self, kind: str) -> Dealt:
        """Return a hand of a kind of `SHARES`."""
        while True:
            strengths = [self._strength() for _ in range(3)]
            names, wrong = [], []
            if kind == "null":
                self.nulls += 1
                wrong = [] if self.nulls % 2 else WRONG[int(self.chance.integers(5))]
            elif kind == "unlisted":
                if not self.unlisted:
                    self.unlisted.extend(self.chance.permutation(list(UNLISTED)))
                names = [str(self.unlisted.pop())]
                strengths = [log_uniform(self.chance, 18, 80)] * 3
            else:
                names = self._taken(COUNTS[kind])
            if found := self.fitted(kind, names, strengths, wrong):
                return found
            self.listed.extend(names if kind != "unlisted" else [])
            self.chance.shuffle(self.listed)

    def alone(self, kind: str) -> Dealt | None:
        """Return a hand of one effect; None where no camera fits."""
        strengths = [self._strength() for _ in range(3)]
        return self.fitted("unlisted" if kind in UNLISTED else "one", [kind], strengths, [])

    def fitted(
        self, kind: str, names: list[str], strengths: list[float], wrong: list[str]
    ) -> Dealt | None:
        """Return a hand with a camera in which its effects stand out as far as wanted."""
        if names and self.chance.random() < 0.2:
            wrong = [str(self.chance.choice(["slope", "intercept", "black"]))]
        for _ in range(ATTEMPTS):
            if planted := self._planted(dict(zip(names, strengths, strict=False))):
                return Dealt(kind, *planted, wrong)
        return None

    def _strength(self) -> float:
        if self.chance.random() > 0.13:
            return log_uniform(self.chance, 11, 60)
        return float(self.chance.uniform(5, 10))

    def _taken(self, count: int) -> list[str]:
        taken: list[str] = []
        while len(taken) < count:
            if not self.listed:
                self.listed.extend(self.chance.permutation(list(LISTED)))
            fit = (i for i, kind in enumerate(self.listed) if not clash(str(kind), taken))
            place = next(fit, None)
            if place is None:
                self.listed.extend(self.chance.permutation(list(LISTED)))
            else:
                taken.append(str(self.listed.pop(place)))
        return taken

    def _planted(self, wanted: dict[str, float]) -> tuple[Bench, list[Effect]] | None:
        """Return a camera with effects of the wanted z; None where it does not fit."""
        kinds = [{**LISTED, **UNLISTED}[name] for name in wanted]
        needs = {name: value for kind in kinds for name, value in kind.needs.items()}
        camera = draw_camera(self.chance, **needs)
        fine = camera.low.slope < 0.5
        if "poisson_shot_noise" in wanted and fine and self.chance.random() < 0.7:
            return None  # of many electrons a code the skew is lost
        bench, effects = Bench(camera, Cells.of(camera)), []
        for kind in sorted(kinds, key=lambda kind: kind.order):
            effect = kind(bench, self.chance)
            if not effect.camera_fits() or not sized(effect, wanted[kind.kind]):
                return None
            effect.leave_floor()
            effects.append(effect)
        return bench, effects


def sized(effect: Effect, wanted: float) -> bool:
    """Give an effect the size at which it has the wanted z; tell whether there is one."""
    if effect.sized:
        low, high = np.log(effect.least), np.log(effect.most)
        if effect.z_of(np.exp(high)) < wanted or effect.z_of(np.exp(low)) > wanted:
            return False
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (middle, high) if effect.z_of(np.exp(middle)) < wanted else (low, middle)
        effect.size = float(np.exp(high))
        if not effect.size_fits():
            return False
    effect.z = effect.z_of(effect.size)
    return effect.z >= WEAKEST


def deck(seed: int, cases: int) -> Iterator[tuple[Dealt, np.random.Generator]]:
    """Yield each hand with the stream of chance, which goes on after the hand has been written."""
    chance = np.random.default_rng([BEGINNING, seed])
    counts = {kind: round(share * cases) for kind, share in SHARES.items()}
    counts["one"] = 0
    counts["one"] = cases - sum(counts.values())
    kinds = [kind for kind, count in counts.items() for _ in range(count)]
    dealer = Dealer(chance)
    for place in chance.permutation(cases):
        yield dealer.deal(kinds[place]), chance
