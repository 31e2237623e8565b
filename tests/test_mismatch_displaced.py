"""What is left unexplained and makes the same: laws of statistics, without a word for the cause."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import convolve
from scipy.signal import lfilter
from scipy.stats import norm, skew

from analysis.mismatch.bank.key import Key
from analysis.mismatch.displaced import displaced

Array = NDArray[np.float64]
BENDS = ("nonlinearity", "dual_gain", "dual_gain_mismatch")
SIGNALS = {"dark": 0.0, "a": 200.0, "b": 700.0, "c": 1800.0, "d": 4000.0}
READ, GAIN, FRAMES = 9.0, 0.5, 8
DOF = 98304 * 7
ERROR = 0.003  # of a correlation


def _frames(seed: int) -> dict[str, Array]:
    """Return noise of each exposure, (row, column): of read-out and of shots."""
    rng = np.random.default_rng(seed)
    sd = {name: (READ + GAIN * s) ** 0.5 for name, s in SIGNALS.items()}
    return {name: sd[name] * rng.standard_normal((600, 900)) for name in SIGNALS}


def _correlations(frame: Array) -> dict[str, float]:
    square = float((frame**2).mean())
    return {
        "correlation_0_1": float((frame[:, 1:] * frame[:, :-1]).mean()) / square,
        "correlation_1_0": float((frame[1:] * frame[:-1]).mean()) / square,
        "correlation_1_1": float(
            (frame[1:, 1:] * frame[:-1, :-1] + frame[1:, :-1] * frame[:-1, 1:]).mean()
        )
        / square
        / 2,
    }


def _state(
    variances: Mapping[str, float],
    values: Mapping[tuple[str, str], float],
    *,
    left: tuple[str, ...],
    expected: Mapping[tuple[str, str], float] | None = None,
) -> Any:
    """Return a state of one channel: numbers by statistic and exposure, or by statistic and lag."""
    keys, found, means = [], [], []
    for (statistic, place), value in values.items():
        lag = place.startswith("lag")
        keys.append(
            Key(
                statistic=statistic,
                scope="all" if lag else "exposure",
                exposure="" if lag else place,
                channel="MONO",
                detail=place if lag else "",
            )
        )
        found.append(value)
        means.append((expected or {}).get((statistic, place), 0.0))
    at = {(name, "MONO"): SIGNALS[name] for name in variances}
    levels = {
        (name, "MONO"): SimpleNamespace(variance_dn2=v, dof=DOF, clipped_low=0.0, clipped_high=0.0)
        for name, v in variances.items()
    }
    uniform = [SimpleNamespace(name=name, numbers=tuple(range(FRAMES))) for name in variances]
    segment = SimpleNamespace(bits=12, segment=())
    clues = SimpleNamespace(
        signal=lambda place: at[place],
        shot_share=lambda place: max(1 - READ / levels[place].variance_dn2, 0.0),
        seen=SimpleNamespace(levels=levels, images={}, lines={}, surfaces={}),
        camera=SimpleNamespace(effect=(), noise=segment),
    )
    return SimpleNamespace(
        camera=SimpleNamespace(effect=(), noise=segment),
        clues=lambda: clues,
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn=at)),
        setting=SimpleNamespace(
            seen=SimpleNamespace(levels=levels, images={}, lines={}, surfaces={}),
            layout=SimpleNamespace(uniform=uniform, channels=("MONO",)),
            noisy_rows=lambda: -np.inf,
        ),
        vector=SimpleNamespace(keys=tuple(keys), values=np.array(found)),
        null=SimpleNamespace(
            mean=np.array(means), sd=np.full(len(keys), ERROR), known=np.ones(len(keys), bool)
        ),
        mismatches=[SimpleNamespace(statistic=name) for name in left],
    )


def _none(state: Any) -> Array:
    return np.zeros(len(state.vector.keys))


def _shared(frame: Array, fraction: float) -> Array:
    """Return a frame whose pixels give a fraction to their four neighbours: nothing is lost."""
    kernel = fraction / 4 * np.array([[0.0, 1, 0], [1, -4, 1], [0, 1, 0]])
    kernel[1, 1] += 1
    return convolve(frame, kernel, mode="wrap")


@pytest.mark.parametrize("kind", BENDS)
def test_charge_that_neighbours_share_as_it_grows_is_no_bend(kind: str) -> None:
    made = {name: _shared(f, 1e-5 * SIGNALS[name]) for name, f in _frames(1).items()}
    variances = {name: float(f.var()) for name, f in made.items()}
    values = {(s, name): r for name, f in made.items() for s, r in _correlations(f).items()}
    assert variances["d"] < 0.97 * (READ + GAIN * SIGNALS["d"])
    state = _state(variances, values, left=("correlation_0_1", "correlation_1_0"))
    denial = displaced(state, kind, _none(state))
    assert denial is not None
    assert denial.share < 0.2
    assert "neighbours" in denial.why


@pytest.mark.parametrize("kind", BENDS)
def test_a_bend_beside_neighbours_that_share_alike_everywhere_stays(kind: str) -> None:
    made = {name: _shared(f, 0.03) for name, f in _frames(2).items()}
    variances = {n: float(f.var()) * (1 - 2e-5 * SIGNALS[n]) for n, f in made.items()}
    values = {(s, name): r for name, f in made.items() for s, r in _correlations(f).items()}
    state = _state(variances, values, left=("correlation_0_1", "correlation_1_0"))
    assert displaced(state, kind, _none(state)) is None


def test_neighbours_that_are_explained_deny_nothing() -> None:
    made = {name: _shared(f, 1e-5 * SIGNALS[name]) for name, f in _frames(1).items()}
    variances = {name: float(f.var()) for name, f in made.items()}
    values = {(s, name): r for name, f in made.items() for s, r in _correlations(f).items()}
    state = _state(variances, values, left=(), expected=values)
    assert displaced(state, "nonlinearity", _none(state)) is None


@pytest.mark.parametrize("kind", BENDS)
@pytest.mark.parametrize("left", [(), ("correlation_0_1",)])
def test_a_law_that_no_correlation_shows_by_itself_denies_a_bend(
    kind: str, left: tuple[str, ...]
) -> None:
    """Charge that is shared as it grows, of which one direction stands out at most.

    That one, place by place, is too noisy to say what variances lack.
    """
    rng = np.random.default_rng(0)
    for share, denied in ((8e-6, True), (0.0, False)):
        made = {name: _shared(f, share * SIGNALS[name]) for name, f in _frames(1).items()}
        variances = {name: float(f.var()) for name, f in made.items()}
        if not denied:  # as much less, with no covariance
            variances = {name: v * (1 - 1.6e-5 * SIGNALS[name]) for name, v in variances.items()}
        values = {
            (s, name): r + rng.normal(0, ERROR)
            for name, f in made.items()
            for s, r in _correlations(f).items()
        }
        state = _state(variances, values, left=left)
        assert (displaced(state, kind, _none(state)) is not None) == denied


@pytest.mark.parametrize("limit", [0.2, 1.0, 2.0])
def test_noise_that_is_cut_off_is_no_second_path(limit: float) -> None:
    made = _frames(3)
    made["d"] = np.minimum(made["d"], limit * (READ + GAIN * SIGNALS["d"]) ** 0.5)
    variances = {name: float(f.var()) for name, f in made.items()}
    values = {("skewness", name): float(skew(f, None)) for name, f in made.items()}
    state = _state(variances, values, left=("skewness",))
    denial = displaced(state, "dual_gain", _none(state))
    assert denial is not None
    assert denial.share < 0.1


def test_a_second_path_beside_noise_that_leans_elsewhere_stays() -> None:
    made = _frames(4)
    made["c"], made["d"] = 0.8 * made["c"], 0.8 * made["d"]
    made["a"] = np.minimum(made["a"], 2.5 * made["a"].std())
    variances = {name: float(f.var()) for name, f in made.items()}
    values = {("skewness", name): float(skew(f, None)) for name, f in made.items()}
    state = _state(variances, values, left=("skewness",))
    assert displaced(state, "dual_gain", _none(state)) is None


def test_a_bend_that_levels_show_is_asked_nothing_more() -> None:
    made = {name: _shared(f, 1e-5 * SIGNALS[name]) for name, f in _frames(1).items()}
    variances = {name: float(f.var()) for name, f in made.items()}
    values = {(s, name): r for name, f in made.items() for s, r in _correlations(f).items()}
    values["level", "d"] = -40.0
    state = _state(variances, values, left=("correlation_0_1", "correlation_1_0", "level"))
    explained = np.where([key.statistic == "level" for key in state.vector.keys], -39.0, 0.0)
    assert displaced(state, "nonlinearity", explained) is None
    assert displaced(state, "nonlinearity", _none(state)) is not None


def _converted(sd: float, rms: float, rng: np.random.Generator) -> float:
    """Return the variance of Gaussian noise of `sd` codes read by codes of unequal width."""
    half = int(8 * sd)
    codes = np.arange(-half, half + 1)
    edges = np.concatenate([[0.0], np.cumsum(1 + rms * rng.standard_normal(codes.size))])
    share = np.diff(norm.cdf((edges - edges[half] - 0.5) / sd))
    share /= share.sum()
    return float((share * codes**2).sum() - (share * codes).sum() ** 2)


def _of_codes(rms: float, bend: float, seed: int, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr("analysis.mismatch.displaced.code_step", lambda _: 1.0)
    rng = np.random.default_rng(seed)
    variances = {
        name: _converted((READ + GAIN * s) ** 0.5, rms, rng) * (1 - bend * s / 4000)
        for name, s in SIGNALS.items()
    }
    values = {("code_imbalance", name): rms for name in SIGNALS}
    return _state(variances, values, left=("code_imbalance",))


def test_codes_that_are_not_equally_wide_scatter_variances(monkeypatch: pytest.MonkeyPatch) -> None:
    states = [_of_codes(0.08, 0.0, seed, monkeypatch) for seed in range(60)]
    assert all(displaced(state, "dual_gain", _none(state)) is not None for state in states)


def test_a_bend_beyond_what_codes_scatter_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    states = [_of_codes(0.08, 0.3, seed, monkeypatch) for seed in range(20)]
    assert all(displaced(state, "dual_gain", _none(state)) is None for state in states)


def _rows(alike: float, white: float, length: float, seed: int) -> Any:
    """Return a state of rows of unit noise of pixels, with offsets that last, and white ones."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-1 / length)
    drawn = rng.standard_normal((400, 200)) * (1 - keep**2) ** 0.5
    rows = alike**0.5 * lfilter([1.0], [1.0, -keep], drawn, axis=1)[:, 60:]
    return _of_rows(rows + (1 + white) ** 0.5 * rng.standard_normal(rows.shape))


def _of_rows(rows: NDArray[np.float64]) -> Any:
    """Return a state of means of rows, (frame, row)."""
    power = float((rows**2).mean())
    values = {
        ("row_correlation", f"lag {k}"): float((rows[:, k:] * rows[:, :-k]).mean()) / power
        for k in (1, 2)
    }
    values["row_variance", "dark"] = power ** (1 / 3)
    return _state({"dark": READ}, values, left=("row_correlation", "row_variance"))


@pytest.mark.parametrize("length", [1.5, 4.0, 12.0])
def test_rows_that_are_alike_are_no_white_noise_of_rows(length: float) -> None:
    state = _rows(2.0, 0.0, length, 5)
    denial = displaced(state, "row_noise", _none(state))
    assert denial is not None
    assert denial.share < 0.25
    state.setting.noisy_rows = lambda: 4.0  # nats, by which frames show it besides
    assert displaced(state, "row_noise", _none(state)) is None


def test_a_half_that_moves_is_no_white_noise_of_rows() -> None:
    """Rows beside one another are as alike as those farther off, or by chance a little less."""
    seen = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        halves = np.where(np.arange(140) < 70, 0.7, -0.7) * rng.choice([-1, 1], (100, 1))
        state = _of_rows(halves + rng.standard_normal(halves.shape))
        seen.append(displaced(state, "row_noise", _none(state)))
    assert all(seen)


def test_white_rows_beside_some_that_are_alike_stay() -> None:
    state = _rows(0.5, 3.0, 4.0, 6)
    assert displaced(state, "row_noise", _none(state)) is None


def _lines(anew: float, fixed: float) -> Any:
    """Return a state of lines that differ anew, and ones that stay: variance over pixels'."""
    values = {
        ("row_variance", "a"): (1 + anew) ** (1 / 3),
        ("fixed_row_variance", "a"): (1 + anew + FRAMES * fixed) ** (1 / 3),
        ("fixed_pixel_variance", "a"): 1.0,
    }
    expected = dict.fromkeys(values, 1.0)
    return _state({"a": 1.0}, values, left=("row_variance",), expected=expected)


@pytest.mark.parametrize(
    ("anew", "fixed", "denied"), [(2.0, 0.0, True), (2.0, 0.1, True), (2.0, 1.0, False)]
)
@pytest.mark.parametrize("kind", ["row_fpn", "row_prnu"])
def test_lines_that_differ_anew_are_no_fixed_ones(
    kind: str, anew: float, fixed: float, *, denied: bool
) -> None:
    state = _lines(anew, fixed)
    found = displaced(state, kind, state.vector.values, np.ones(3))
    assert (found is not None) == denied


def test_other_effects_are_not_asked() -> None:
    state = _lines(2.0, 0.0)
    assert displaced(state, "prnu", state.vector.values, np.ones(3)) is None


@pytest.mark.parametrize(("z", "denied"), [(3.0, False), (19.0, True)])
def test_columns_whose_spectrum_is_not_flat_are_no_white_noise(z: float, denied: bool) -> None:
    keys = (Key("column_spectrum_peak", "all"), Key("column_variance", "exposure", "dark"))
    null = SimpleNamespace(departures=lambda _: np.array([z, 30.0]), mean=np.zeros(2))
    state: Any = SimpleNamespace(
        vector=SimpleNamespace(keys=keys),
        null=null,
        mismatches=(),
        setting=SimpleNamespace(seen=SimpleNamespace(lines={}), layout=SimpleNamespace(uniform=())),
    )
    assert (displaced(state, "column_noise", null.mean) is not None) is denied
