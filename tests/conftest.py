"""Fixtures that several promises share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The first example of a test may compile a kernel; the same examples every time.
settings.register_profile("dsis", deadline=None, derandomize=True)
settings.load_profile("dsis")


def pytest_configure(config: pytest.Config) -> None:
    """Keep panoramas with pytest's cache, not among the user's: rendered once for many runs."""
    if hasattr(config, "cache"):  # absent with `-p no:cacheprovider`
        os.environ.setdefault("DSIS_CACHE", str(config.cache.mkdir("panoramas")))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real images, recordings and votes; tests that need it skip where it is absent."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("DSIS_SHARED_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"no real data: {folder} is absent (set DSIS_SHARED_DATA)")
    return folder
