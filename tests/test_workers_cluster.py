"""Promise: a Dask cluster gives the bytes of `--jobs 1`, even where a worker is killed."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dsis.cli import main
from dsis.errors import InputError
from dsis.imagefile import write
from dsis.scenes import Strip, renderer
from dsis.scenes.cache import cache_folder
from dsis.spec import read_spec
from dsis.stimuli import build_stimuli
from dsis.workers import WorkersLostError, _refuse_unlike, versions, workers
from folder_bytes import every_byte
from written_spec import write_spec

distributed = pytest.importorskip("distributed")

SECONDS = 60.0  # in which a cluster of this machine must stand, however busy it is


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("spec")
    light = np.random.default_rng(0).uniform(0, 1, (56, 104, 3)).astype(np.float32)
    write(folder / "picture.exr", light, "exr")
    return write_spec(
        folder / "spec.toml",
        formats=["player", "png8"],
        sequence={"seconds": 0.64},
        content=[{"name": "picture", "files": "picture.exr", "pan_px_per_frame": 0.5}],
        conditions={"demosaic": ["none", "dlmmse"]},
        session={"reference_s": 0.64, "test_s": 0.64},
    )


@pytest.fixture(scope="module")
def built(spec: Path) -> dict[str, bytes]:
    assert main(["stimuli", str(spec), "--jobs", "1", "--out", str(spec.parent / "one")]) == 0
    return every_byte(spec.parent / "one")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Yield a client of a scheduler and two workers, each a process of its own."""
    folder = tmp_path_factory.mktemp("cluster")
    contact = str(folder / "scheduler.json")
    program = [sys.executable, "-W", "ignore", "-m"]
    scheduler = [*program, "distributed.cli.dask_scheduler", "--scheduler-file", contact]
    scheduler += ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show"]
    worker = [*program, "distributed.cli.dask_worker", "--scheduler-file", contact]
    worker += ["--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
    worker += ["--host", "127.0.0.1", "--local-directory", str(folder)]
    with (folder / "log").open("wb") as log:
        processes = [
            subprocess.Popen(one, stdout=log, stderr=log, cwd=folder) for one in (scheduler, worker)
        ]
        try:
            client = joined(folder, contact)
            yield client
            client.close()
        finally:
            for process in reversed(processes):
                process.terminate()
                process.wait(SECONDS)


def joined(folder: Path, contact: str) -> Any:
    """Return a client once both workers are there."""
    end = time.monotonic() + SECONDS
    while not Path(contact).exists():
        assert time.monotonic() < end, (folder / "log").read_text()
        time.sleep(0.05)
    client = distributed.Client(scheduler_file=contact, timeout=SECONDS, set_as_default=False)
    client.wait_for_workers(2, timeout=SECONDS)
    return client


def test_two_worker_processes_give_the_same_bytes(
    cluster: Any, spec: Path, built: dict[str, bytes], tmp_path: Path
) -> None:
    address = cluster.scheduler.address
    assert len(set(cluster.run(os.getpid).values()) - {os.getpid()}) == 2
    said = main(["stimuli", str(spec), "--scheduler", address, "--out", str(tmp_path / "out")])
    assert said == 0
    assert every_byte(tmp_path / "out") == built


def test_the_cluster_renders_the_scenes(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = write_spec(
        tmp_path / "spec.toml",
        content=[{"name": "land", "scene": "landscape", "scene_seed": 77}],
        sequence={"width": 32, "height": 24, "seconds": 0.04},
        awgn={"sigma": 2.0},
        session={"reference_s": 0.04, "test_s": 0.04},
    )

    @lru_cache
    def prepared(strip: Strip) -> None:
        pytest.fail(f"{strip} is rendered here")

    with monkeypatch.context() as here:
        here.setattr(renderer, "_prepared", prepared)
        build_stimuli(read_spec(spec), tmp_path / "far", scheduler=cluster.scheduler.address)
    rendered = list(cache_folder().glob("landscape-77-*"))
    assert rendered
    for path in rendered:
        path.unlink()
    build_stimuli(read_spec(spec), tmp_path / "near")
    assert every_byte(tmp_path / "far") == every_byte(tmp_path / "near")


def test_workers_with_other_versions_are_refused() -> None:
    alike, unlike = versions(), versions() | {"numba": "0.1", "processor": "abacus"}
    _refuse_unlike("there", {"a": alike})
    with pytest.raises(InputError, match="none has joined"):
        _refuse_unlike("there", {})
    with pytest.raises(InputError) as refused:
        _refuse_unlike("there", {"a": alike, "b": unlike})
    assert [fault.key for fault in refused.value.faults] == ["there", "there"]
    assert "worker b has numba 0.1, must have" in str(refused.value)


def test_a_worker_that_is_killed_is_no_loss(
    cluster: Any, spec: Path, built: dict[str, bytes], tmp_path: Path
) -> None:
    killed: list[int] = []

    def kill_one(done: int, total: int, what: str) -> None:
        del total, what
        if done == 2 and not killed:
            killed.append(min(cluster.run(os.getpid).values()))
            os.kill(killed[0], signal.SIGKILL)

    build_stimuli(
        read_spec(spec),
        tmp_path / "out",
        scheduler=cluster.scheduler.address,
        progress=kill_one,
    )
    assert killed
    assert every_byte(tmp_path / "out") == built


def test_work_that_kills_every_worker_is_given_up(cluster: Any) -> None:
    with (
        workers(scheduler=cluster.scheduler.address) as pool,
        pytest.raises(WorkersLostError, match="a worker died each time"),
    ):
        pool.submit(os._exit, 1).result(SECONDS)
