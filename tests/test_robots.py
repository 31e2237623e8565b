"""Simulated observers vote as their stated model says, and leave tables that any reader takes."""

import csv
import hashlib
import json
import sqlite3

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dsis.errors import DamagedError, InputError
from dsis.manifest import Clip, ClipFiles, Manifest, Quality, read_manifest, write_manifest
from dsis.session import draw_plan, export_votes, run_robots, status
from dsis.session.robots import expected_vote, latent_grade, robot_votes
from dsis.session.store import STORE, Vote, open_store, read_store
from dsis.spec import Sequence, Session

TEN = Session()
FIVE = Session(scale=(1, 5))


def write_test(folder, *, energies=True, contents=("city", "land"), **session):
    """Write a test by hand: four levels of noise on each content, clips of four small frames."""
    folder.mkdir(exist_ok=True)
    clips = []
    for c, content in enumerate(contents):
        for i, role in enumerate(["reference", "test", "test", "test", "test", "training"]):
            name = f"{content}__{role}__{i}"
            data = np.full(4 * 16 * 16 * 3, 40 * c + i, np.uint8).tobytes()
            (folder / f"{name}.rgb").write_bytes(data)
            clips.append(
                Clip(
                    stimulus=name,
                    content=content,
                    role=role,
                    reference=None if role == "reference" else f"{content}__reference__0",
                    noise=None if role == "reference" else "sd",
                    demosaic=None if role == "reference" else "bilinear",
                    level=None if role == "reference" else i,
                    files={
                        "player": ClipFiles(
                            path=f"{name}.rgb", sha256=hashlib.sha256(data).hexdigest()
                        )
                    },
                    quality=Quality(visible_noise=2.0**i if energies else None),
                )
            )
    manifest = Manifest(
        schema="dsis-manifest/1",
        title="By hand",
        sequence=Sequence(width=16, height=16, fps=25.0, seconds=0.16),
        session=Session(**session),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)
    return manifest


@pytest.fixture
def folder(tmp_path):
    write_test(tmp_path / "stimuli")
    return tmp_path / "stimuli"


# ---- the model


def test_the_stated_law_at_its_stated_points():
    assert latent_grade(0.0, TEN) == 10
    assert latent_grade(16.0, TEN) == pytest.approx(5.5)  # half the scale at 4 Delta E
    assert latent_grade(1.0, TEN) == pytest.approx(9.5, abs=0.03)  # half a grade at 1 Delta E
    assert latent_grade(1e9, TEN) == pytest.approx(1.0)
    # the same on every scale: an affine map of it
    energy = np.geomspace(0.01, 1000, 50)
    fraction = (latent_grade(energy, TEN) - 1) / 9
    np.testing.assert_allclose((latent_grade(energy, FIVE) - 1) / 4, fraction, rtol=1e-12)


@pytest.mark.parametrize("session", [TEN, FIVE, Session(scale=(0, 100)), Session(scale=(-3, 3))])
def test_votes_average_to_the_expected_vote(session):
    robots = 4000
    energy = np.array([0.0, 0.5, 4.0, 16.0, 60.0, 400.0])
    votes = np.array([robot_votes(energy, session, f"r{i}", 3) for i in range(robots)])
    assert set(np.unique(votes)) <= set(range(session.scale[0], session.scale[1] + 1))
    error = votes.std(axis=0, ddof=1) / np.sqrt(robots)
    z = (votes.mean(axis=0) - expected_vote(energy, session)) / error
    assert np.abs(z).max() < 5


def test_expected_votes_integrate_the_latent_distribution():
    # rounding, clipping and lapses, over a fine grid of the normal latent grade
    quantiles = (np.arange(200_000) + 0.5) / 200_000
    for energy in (0.2, 5.0, 25.0, 300.0):
        x = 1 + 9 / (1 + energy / 16)
        sd = np.sqrt(max(0.19 * (10 - x) * (x - 1), 0.089 * 81 / 16))
        grades = np.clip(np.round(stats.norm.ppf(quantiles, x, sd)), 1, 10)
        # a step of a grade in 9 places, each known to one part in 200 000
        expected = 0.99 * grades.mean() + 0.01 * 5.5
        assert expected_vote(energy, TEN) == pytest.approx(expected, abs=9 / 200_000)


def test_the_expected_vote_lies_in_the_confidence_interval():
    # Mid-scale and moderately high: visible noise of 6 to 1.5 Delta E, expected votes of 3.8 to
    # 8.7. Nearer the ends t intervals cover less than they say, whatever the model (0.87 at 9.6).
    tests, robots = 1000, 18
    energy = np.array([6.0, 4.0, 3.0, 2.5, 2.0, 1.5]) ** 2
    votes = np.array(
        [
            [robot_votes(energy, TEN, f"robot-{i:03d}", seed) for i in range(1, robots + 1)]
            for seed in range(tests)
        ]
    )
    half = stats.t.ppf(0.975, robots - 1) * votes.std(axis=1, ddof=1) / np.sqrt(robots)
    inside = np.abs(votes.mean(axis=1) - expected_vote(energy, TEN)) <= half
    coverage = inside.mean(axis=0)
    assert np.all((coverage > 0.93) & (coverage < 0.97)), coverage


def test_bias_is_common_to_all_votes_of_a_robot():
    energy = np.full(400, 16.0)
    means = [robot_votes(energy, TEN, f"r{i}", 1).mean() for i in range(300)]
    # between robots the bias, and a 400th of the inconsistency (and of rounding, 1/12)
    bias, total = 0.089 * 81 / 16, 0.19 * 4.5 * 4.5
    expected = (0.99**2) * bias + (total - bias + 1 / 12) / 400
    # relative error of a variance from 300 values; lapses and clipping move it by less than that
    assert np.var(means, ddof=1) / expected == pytest.approx(1, abs=5 * np.sqrt(2 / 299))


def test_votes_depend_on_nothing_but_seed_observer_and_place():
    energy = np.geomspace(0.5, 50, 20)
    votes = robot_votes(energy, TEN, "r1", 1)
    np.testing.assert_array_equal(robot_votes(energy[:7], TEN, "r1", 1), votes[:7])
    assert np.any(robot_votes(energy, TEN, "r1", 2) != votes)
    assert np.any(robot_votes(energy, TEN, "r2", 1) != votes)


# ---- through plan and store


def test_robots_go_through_the_plan_and_are_marked(folder):
    run_robots(folder, 3, seed=5)
    manifest = read_manifest(folder)
    with read_store(folder) as store:
        rows = store.rows()
        store.check()
        assert [o.observer for o in store.observers()] == ["robot-001", "robot-002", "robot-003"]
        assert all(o.simulated for o in store.observers())
        plan = draw_plan(manifest, "robot-002", 5, mirrors="robot-001")
        assert tuple(r.presentation for r in store.rows("robot-002")) == plan
    assert len(rows) == 3 * (2 + 3 + 8)
    assert all(r.vote.simulated and r.vote.valid and r.vote.reaction_ms is None for r in rows)
    assert rows[1].vote.voted_at == "1970-01-01T00:01:54.000+00:00"  # two presentations of 57 s
    assert "SIMULATED" in str(status(folder))
    assert [(p.planned, p.done, p.invalid, p.lost) for p in status(folder).observers] == [
        (13, 13, 0, 0)
    ] * 3


def test_more_robots_later_change_nothing(folder, tmp_path):
    run_robots(folder, 4, seed=5)
    export_votes(folder, tmp_path / "four")
    (folder / STORE).unlink()
    for robots in (2, 3, 4, 4):
        run_robots(folder, robots, seed=5)
    export_votes(folder, tmp_path / "growing")
    for name in ("votes.csv", "presentations.csv", "observers.csv", "datapackage.json"):
        assert (tmp_path / "four" / name).read_bytes() == (tmp_path / "growing" / name).read_bytes()
    with pytest.raises(InputError, match="there already with seed 5"):
        run_robots(folder, 4, seed=6)


def test_robots_need_to_know_how_visible_the_noise_is(tmp_path):
    write_test(tmp_path, energies=False)
    with pytest.raises(InputError, match=r"visible_noise: is missing.*people can vote") as refusal:
        run_robots(tmp_path, 1, seed=1)
    assert len(refusal.value.faults) == 10  # all clips but the two references
    assert not (tmp_path / STORE).exists()


# ---- the tables


def test_the_export_is_read_by_the_analysis_and_says_what_it_is(folder, tmp_path):
    from analysis import read_votes

    run_robots(folder, 3, seed=5)
    export_votes(folder, tmp_path / "votes")
    votes = read_votes(tmp_path / "votes" / "votes.csv")
    assert len(votes) == 39
    assert votes["simulated"].all()
    assert set(votes["kind"]) == {"training", "dummy", "test"}
    assert set(votes["content"]) == {"city", "land"}
    assert votes["vote"].between(1, 10).all()

    package = json.loads((tmp_path / "votes" / "datapackage.json").read_text(encoding="utf-8"))
    assert package["schema"] == "dsis-votes/1"
    assert (package["scale"], package["simulated"]) == ([1, 10], "all")
    assert package["labels"] == ["very annoying", "imperceptible"]
    for resource in package["resources"]:
        with (tmp_path / "votes" / resource["path"]).open(encoding="utf-8") as file:
            header = next(csv.reader(file))
        assert header == [field["name"] for field in resource["schema"]["fields"]]
        assert all(field["description"] for field in resource["schema"]["fields"])


def test_cells_are_those_of_the_store(folder, tmp_path):
    manifest = read_manifest(folder)
    with open_store(folder, manifest) as store:
        store.add_observer("anna", draw_plan(manifest, "anna", 1), simulated=False)
        row = store.rows("anna")[-1]
        at = "2026-03-01T09:30:00.000+01:00"
        store.record_vote(row.id, Vote(4, 812.5, at, False, 2, False))
        export_votes(folder, tmp_path / "votes")  # the session is still open
    table = pd.read_csv(tmp_path / "votes" / "votes.csv", dtype=str, keep_default_na=False)
    name = row.presentation.stimulus
    assert table.to_dict("records") == [
        {
            "observer": "anna",
            "stimulus": name,
            "vote": "4",
            "content": name.split("__")[0],
            "noise": "sd",
            "demosaic": "bilinear",
            "level": name.split("__")[2],
            "session": "1",
            "presentation": "13",
            "repetition": "1",
            "attempt": "1",
            "valid": "false",
            "kind": "test",
            "reaction_ms": "812.5",
            "voted_at": at,
            "dropped_frames": "2",
            "simulated": "false",
            "stimulus_sha256": hashlib.sha256((folder / f"{name}.rgb").read_bytes()).hexdigest(),
        }
    ]
    plan = pd.read_csv(tmp_path / "votes" / "presentations.csv")
    assert plan["state"].tolist() == ["planned"] * 12 + ["invalid"]
    package = json.loads((tmp_path / "votes" / "datapackage.json").read_text(encoding="utf-8"))
    assert package["simulated"] == "none"


def test_an_export_replaces_an_export_and_nothing_else(folder, tmp_path):
    out = tmp_path / "votes"
    with pytest.raises(InputError, match="no session has been held"):
        export_votes(folder, out)
    run_robots(folder, 1, seed=5)
    export_votes(folder, out)
    run_robots(folder, 2, seed=5)
    export_votes(folder, out)
    assert len(pd.read_csv(out / "observers.csv")) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["stimuli", "votes"]

    (out / "report").mkdir()
    with pytest.raises(InputError, match="holds report, which would be lost"):
        export_votes(folder, out)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").touch()
    with pytest.raises(InputError, match="not empty"):
        export_votes(folder, tmp_path / "other")
    (tmp_path / "other" / "datapackage.json").write_text('{"name": "mine"}', encoding="utf-8")
    with pytest.raises(InputError, match="no export of votes"):
        export_votes(folder, tmp_path / "other")


# ---- the store


def test_nothing_in_the_store_can_be_changed_removed_or_replaced(folder):
    run_robots(folder, 1, seed=5)
    db = sqlite3.connect(folder / STORE, isolation_level=None)
    for table in ("test", "observers", "presentations", "votes", "events"):
        columns = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
        for command in (
            f"DELETE FROM {table}",  # noqa: S608  a name from the line above
            f"UPDATE {table} SET {columns[0]} = {columns[0]}",  # noqa: S608  the same
            f"INSERT OR REPLACE INTO {table} SELECT * FROM {table}",  # noqa: S608  the same
        ):
            with pytest.raises(sqlite3.IntegrityError, match="append-only"):
                db.execute(command)
    with pytest.raises(sqlite3.IntegrityError, match="append-only"):
        db.execute(
            "INSERT OR REPLACE INTO presentations (observer, place, session, kind, stimulus, "
            "reference, repetition, attempt, seed) "
            "SELECT observer, place, 1, 'test', 'x', 'y', 1, 1, 1 FROM presentations"
        )
    db.close()


def test_an_altered_event_or_vote_is_noticed(folder):
    run_robots(folder, 1, seed=5)
    db = sqlite3.connect(folder / STORE, isolation_level=None)
    db.execute("DROP TRIGGER votes_no_UPDATE")
    db.execute("UPDATE votes SET vote = 11 - vote WHERE presentation = 4")
    with read_store(folder) as store, pytest.raises(DamagedError, match="votes are not those"):
        store.check()
    db.execute("UPDATE votes SET vote = 11 - vote WHERE presentation = 4")
    db.execute("DROP TRIGGER events_no_UPDATE")
    db.execute("UPDATE events SET payload = replace(payload, 'at', 'AT') WHERE id = 3")
    db.close()
    with read_store(folder) as store, pytest.raises(DamagedError, match="event 3 is not what"):
        store.check()


@pytest.mark.parametrize("grade", [0, 11, -1])
def test_a_vote_outside_the_scale_is_refused_twice_over(folder, grade):
    manifest = read_manifest(folder)
    with open_store(folder, manifest) as store:
        store.add_observer("anna", draw_plan(manifest, "anna", 1), simulated=False)
        with pytest.raises(InputError, match="must be a whole number from 1 to 10"):
            store.record_vote(1, Vote(grade, 1.0, "2026-03-01T09:30:00+01:00", True, 0, False))
    db = sqlite3.connect(folder / STORE, isolation_level=None)
    with pytest.raises(sqlite3.IntegrityError, match="outside the scale"):
        db.execute("INSERT INTO votes VALUES (1, ?, NULL, 'now', 1, 0, 0)", (grade,))
    with pytest.raises(sqlite3.IntegrityError, match="a robot is not a person"):
        db.execute("INSERT INTO votes VALUES (1, 5, NULL, 'now', 1, 0, 1)")
    db.close()


def test_votes_never_get_mixed_with_other_stimuli(folder):
    run_robots(folder, 1, seed=5)
    write_test(folder, dummies=2)
    for use in (lambda: run_robots(folder, 2, seed=5), lambda: status(folder)):
        with pytest.raises(InputError, match="holds votes on other stimuli"):
            use()


@pytest.mark.parametrize("name", ["", "anna maria", "../x", "a" * 65, "=1+1", "a,b", "a\n"])
def test_names_that_are_no_pseudonyms_are_refused(folder, name):
    manifest = read_manifest(folder)
    with (
        open_store(folder, manifest) as store,
        pytest.raises(InputError, match="must be up to 64 letters"),
    ):
        store.add_observer(name, draw_plan(manifest, name, 1), simulated=False)


def test_status_knows_what_is_lost(folder):
    manifest = read_manifest(folder)
    assert str(status(folder)) == "0 of 18 observers are done"
    with open_store(folder, manifest) as store:
        store.add_observer("anna", draw_plan(manifest, "anna", 1), simulated=False)
        for row in store.rows("anna"):
            spoilt = row.presentation.place in (1, 13)
            vote = Vote(5, 1.0, "2026-03-01T09:30:00+01:00", not spoilt, int(spoilt), False)
            store.record_vote(row.id, vote)
    (anna,) = status(folder).observers
    assert (anna.planned, anna.done, anna.invalid, anna.lost) == (13, 13, 2, 1)
