"""Fixtures that several promises share, and how the tests run: side by side, quickly, alike."""

import gc
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# There are as many processes as cores: a library's own threads would only be in their way.
for library in ("OMP", "OPENBLAS"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# The first example of a test may compile a kernel; the same examples every time.
settings.register_profile("dsis", deadline=None, derandomize=True)
settings.load_profile("dsis")


def pytest_configure(config: pytest.Config) -> None:
    """Keep panoramas with pytest's cache, not among the user's: rendered once for many runs."""
    if hasattr(config, "cache"):  # absent with `-p no:cacheprovider`
        os.environ.setdefault("DSIS_CACHE", str(config.cache.mkdir("panoramas")))


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Understand the options of pyproject.toml where xdist is off (`-p no:xdist`)."""
    if not pluginmanager.hasplugin("xdist"):
        for option in ("--numprocesses", "--dist"):
            parser.addoption(option)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return one process more than there are cores, of which a few are enough.

    Tests that wait, for a browser, a player or time to pass, leave their core to another.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return min((cores or 1) + 1, 8)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    from spreading import ByFile

    config.option.loadscopereorder = False  # the order of `pytest_collection_modifyitems`
    return ByFile(config, log) if config.option.dist == "loadfile" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take long."""
    from spreading import rank

    items.sort(key=lambda item: rank(item.path.name))


def _exempt() -> None:
    """Exempt what is held from garbage collection: some libraries collect at every call."""
    gc.collect()
    gc.freeze()


def pytest_collection_finish() -> None:
    _exempt()


def pytest_sessionfinish() -> None:
    gc.unfreeze()


@pytest.fixture(scope="module")
def swept() -> None:
    """Exempt what earlier tests left, too: a whole run leaves so much that each sweep is slow."""
    _exempt()


@pytest.fixture(scope="module")
def unproven() -> Iterator[None]:
    """Leave out of findings what is told last, the proof and what pictures show.

    For what is promised of many recordings: nothing that is named, nor its numbers, hangs on it.
    """
    from analysis.mismatch import diagnose
    from analysis.mismatch.trial import Trial
    from mismatch_findings import NOTHING

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Trial, "proof", lambda *_: NOTHING.proof)
        patch.setattr(diagnose, "evidence_of", lambda *_: None)
        yield


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real images, recordings and votes; tests that need it skip where it is absent."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("DSIS_SHARED_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"no real data: {folder} is absent (set DSIS_SHARED_DATA)")
    return folder


@pytest.fixture
def spec(tmp_path: Path) -> Callable[..., Path]:
    """Return what writes the small spec, parts of its text replaced, beside a still of 70 x 60."""
    import numpy as np

    from dsis.imagefile import write
    from written_spec import SPEC

    write(tmp_path / "still.exr", np.full((60, 70, 3), 0.2, np.float32), "exr")

    def with_changes(*changes: tuple[str, str]) -> Path:
        text = SPEC
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        path = tmp_path / "spec.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return with_changes


@pytest.fixture
def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave pictures empty: what is promised here stands in tables and words."""
    from matplotlib.figure import Figure

    monkeypatch.setattr(Figure, "savefig", lambda _, path, **__: path.write_bytes(b""))
