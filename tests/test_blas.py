"""Promise: linear algebra runs in one thread once that was asked for, unless a user set more."""

import os
import subprocess
import sys

import pytest

ASK = """
import numpy, os
from dsis import blas
blas.one_thread()
names = [name.replace("_set_", "_get_") for name in blas._NAMES]
own = [getattr(one, name)() for one in blas._loaded() for name in names if hasattr(one, name)]
print(os.environ["OPENBLAS_NUM_THREADS"], *own)
"""


def _asked(**given: str) -> list[str]:
    rest = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", ASK], env=rest | given, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says which libraries are loaded")
def test_libraries_that_are_loaded_use_one_thread() -> None:
    assert set(_asked()) == {"1"}


def test_what_a_user_set_stays() -> None:
    assert _asked(OPENBLAS_NUM_THREADS="2")[0] == "2"
