"""Lines of which few move, beside offsets that all lines have."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.linemeans import AXES, line_means
from analysis.mismatch.fewlines import moving_farther, of_few_lines
from dsis.cfa import Cfa
from dsis.measures import Accumulator

ROWS, COLUMNS = 60, 80
FRAMES = (5, 9, 16)
NOISE_DN = (3.0, 8.0, 20.0)
FEW = (7, 30, 31, 66)
Array = NDArray[np.float64]


def _frames(seed: int, offsets: Any) -> list[Array]:
    """Return frames of exposures that get noisier; `offsets(rng, frames)`: (frame, column), DN."""
    rng = np.random.default_rng(seed)
    return [
        1000.0
        + rng.normal(0, noise, (count, ROWS, COLUMNS))
        + offsets(rng, count)[:, np.newaxis, :]
        for count, noise in zip(FRAMES, NOISE_DN, strict=True)
    ]


def _state(stacks: list[Array], cfa: Cfa) -> Any:
    sites = {"MONO": (0, 0)} if cfa is Cfa.MONO else {
        "R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)
    }  # fmt: skip
    lines, keys = {}, []
    for k, stack in enumerate(stacks):
        sums = Accumulator(ROWS, COLUMNS, cfa)
        for frame in stack:
            sums.add(np.floor(frame + 0.5).astype(np.uint16))
        found = sums.result().channels
        for axis in AXES:
            lines[f"F{k}", axis] = line_means(found, sites, (ROWS, COLUMNS), len(stack), axis)
        keys += [
            Key(name, "exposure", f"F{k}", c)
            for c in sites
            for name in ("column_variance", "fixed_pixel_variance", "fixed_column_variance")
        ]
    return SimpleNamespace(
        setting=SimpleNamespace(
            seen=SimpleNamespace(lines=lines),
            layout=SimpleNamespace(
                uniform=[SimpleNamespace(name=f"F{k}") for k in range(len(stacks))],
                channels=tuple(sites),
            ),
        ),
        calibrated=SimpleNamespace(
            fit=SimpleNamespace(signal_dn={(f"F{k}", c): 900.0 for k in range(3) for c in sites})
        ),
        vector=SimpleNamespace(keys=keys),
        null=SimpleNamespace(known=np.ones(len(keys), bool)),
    )


def _denied(stacks: list[Array], kind: str, cfa: Cfa) -> bool:
    state = _state(stacks, cfa)
    return of_few_lines(state, kind, np.ones(len(state.vector.keys))) is not None


def _jumping(rng: Any, frames: int) -> Array:
    found = np.zeros((frames, COLUMNS))
    found[:, FEW] = 8.0 * (rng.random((frames, len(FEW))) < 0.4)
    return found


def _new(rng: Any, frames: int) -> Array:
    return np.asarray(rng.normal(0, 1.2, (frames, COLUMNS)))


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("kind", ["column_noise", "column_fpn", "column_prnu"])
def test_columns_that_jump_are_no_columns_that_differ(kind: str, cfa: Cfa) -> None:
    assert _denied(_frames(1, _jumping), kind, cfa)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_columns_that_all_move_or_differ_are_believed(cfa: Cfa) -> None:
    assert not _denied(_frames(2, _new), "column_noise", cfa)
    fixed = np.random.default_rng(3).laplace(0, 1.2, COLUMNS)
    assert not _denied(_frames(3, lambda _, n: np.tile(fixed, (n, 1))), "column_fpn", cfa)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_offsets_of_all_are_believed_beside_few_that_jump(cfa: Cfa) -> None:
    fixed = np.random.default_rng(4).normal(0, 4.0, COLUMNS)
    stacks = _frames(4, lambda rng, n: _jumping(rng, n) + _new(rng, n) * 3 + fixed)
    assert not _denied(stacks, "column_noise", cfa)
    assert not _denied(stacks, "column_fpn", cfa)


@pytest.mark.parametrize(("offsets", "denied"), [(_jumping, True), (_new, False)])
@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_pink_noise_of_columns_is_in_all_of_them(offsets: Any, denied: bool, cfa: Cfa) -> None:
    """It is asked of the lines whose variance it changes."""
    state = _state(_frames(7, offsets), cfa)
    keys = state.vector.keys
    state.null.sd = np.full(len(keys), 0.01)
    without = np.ones(len(keys))
    mean = without + np.array([0.5 * (key.statistic == "column_variance") for key in keys])
    assert (of_few_lines(state, "pink_noise", without, mean) is not None) is denied
    assert of_few_lines(state, "pink_noise", without, without) is None  # of rows: none jump


def test_rows_and_other_effects_are_not_asked_of_columns() -> None:
    stacks = _frames(5, _jumping)
    assert not _denied(stacks, "row_noise", Cfa.MONO)
    assert not _denied(stacks, "dsnu", Cfa.MONO)


def test_chance_seldom_moves_a_line_so_far() -> None:
    """Of 400 recordings without such a line, 4 would be many: 0.4 are expected."""
    rng, found = np.random.default_rng(6), 0
    for _ in range(400):
        own = [
            SimpleNamespace(frames=n, moving=v * rng.chisquare(n - 1, COLUMNS) / (n - 1))
            for n, v in zip(FRAMES, (1.0, 2.5, 40.0), strict=True)
        ]
        found += bool(moving_farther(own).any())  # type: ignore[arg-type] # all that is asked
    assert found <= 4
