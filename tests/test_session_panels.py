"""Promise: plans of a panel are drawn ahead and printed; typed votes are taken all or none."""

import csv

import pytest

from dsis.cli import main
from dsis.errors import InputError
from dsis.manifest import read_manifest
from dsis.session import plan_panel, read_typed_votes, serve, status, write_sheets
from dsis.session.panel import enrol, held
from dsis.session.plan import draw_plan
from dsis.session.store import Vote, open_store, read_store
from tiny_clips import NOW, table, write_test


@pytest.fixture
def folder(tmp_path):
    write_test(tmp_path / "stimuli")
    return tmp_path / "stimuli"


def test_the_plans_of_a_panel_are_stored_shown_and_balanced(folder, capsys):
    assert main(["session", str(folder), "--plan", "--seed", "5"]) == 0
    said = capsys.readouterr().out
    assert said.count("5 presentations in 1 viewing sessions of 5 minutes") == 4
    assert "rules: kept by all 4 plans" in said
    assert "at most 0 times more often in one half" in said
    with read_store(folder) as store:
        plans = {row.observer: [] for row in store.rows()}
        for row in store.rows():
            plans[row.observer].append(row.presentation)
    assert list(plans) == ["P01", "P02", "P03", "P04"]
    orders = [[p.stimulus for p in plan if p.kind == "test"] for plan in plans.values()]
    assert orders[0] == orders[1][::-1]
    assert orders[2] == orders[3][::-1]
    assert plan_panel(folder, seed=5) == said.rstrip("\n")  # nothing is drawn twice
    assert "anna: 5 presentations" in plan_panel(folder, "anna", seed=5)
    assert "P01" not in plan_panel(folder, "anna", seed=5)


def test_a_planned_observer_begins_without_resume(folder):
    plan_panel(folder, "anna", seed=3)
    manifest = read_manifest(folder)
    with open_store(folder, manifest) as store:
        plan = [row.presentation for row in store.rows("anna")]
        with pytest.raises(InputError, match="'anna' has no session to resume"):
            enrol(store, manifest, "anna", resume=True, seed=1, say=print)
        enrol(store, manifest, "anna", resume=False, seed=1, say=print)
        assert [row.presentation for row in store.rows("anna")] == plan
        with pytest.raises(InputError, match="'anna' is there already"):
            enrol(store, manifest, "anna", resume=False, seed=1, say=print)
        assert [known.observer for known in store.observers()] == ["anna"]


def test_one_process_at_a_time_holds_an_observer(folder):
    with (
        held(folder, "anna"),
        held(folder, "bert"),
        pytest.raises(InputError, match="'anna' is held by another process"),
    ):
        serve(folder, "anna", open_browser=False)
    with pytest.raises(InputError, match="must be up to 64 letters"), held(folder, "../anna"):
        pass


def typed(folder, rows, name="typed.csv", delimiter=","):
    path = folder.parent / name
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter=delimiter).writerows(
            [("observer", "presentation", "vote"), *rows]
        )
    return path


def test_sheets_show_the_observer_no_stimulus_and_votes_are_typed_in(folder, tmp_path):
    with pytest.raises(InputError, match="nobody has a plan yet"):
        write_sheets(folder, tmp_path / "sheets")
    plan_panel(folder, seed=5)
    out = tmp_path / "sheets"
    assert write_sheets(folder, out) == 4
    sheet = (out / "P01-sheet.html").read_text(encoding="utf-8")
    assert "city" not in sheet
    assert sheet.count("<tr><td>") == 5
    assert "10: imperceptible" in sheet
    plan = table(out / "P01-plan.csv")
    assert [row["presentation"] for row in plan] == ["1", "2", "3", "4", "5"]
    lines = table(out / "votes-to-type.csv")
    assert len(lines) == 20
    write_sheets(folder, out)  # nothing was typed in yet

    rows = [(r["observer"], r["presentation"], 1 + i % 10) for i, r in enumerate(lines[:-1])]
    rows.append((lines[-1]["observer"], lines[-1]["presentation"], ""))
    for delimiter in ",;":
        path = typed(folder, rows, delimiter=delimiter)
        stored = read_typed_votes(folder, path)
        assert stored == ((19, 1) if delimiter == "," else (0, 1))
    with read_store(folder) as store:
        store.check()
        votes = [row.vote for row in store.rows() if row.vote is not None]
        assert [vote.vote for vote in votes] == [1 + i % 10 for i in range(19)]
        assert all(v.valid and v.dropped_frames is None and v.reaction_ms is None for v in votes)
    (out / "votes-to-type.csv").write_bytes(typed(folder, rows).read_bytes())
    with pytest.raises(InputError, match=r"votes in votes-to-type\.csv"):
        write_sheets(folder, out)
    assert "votes-to-type" not in str(status(folder))


@pytest.mark.parametrize(
    ("row", "why"),
    [
        (("P01", 1, 11), "row 3: vote: is '11', must be a whole number from 1 to 10"),
        (("P01", 1, "good"), "row 3: vote: is 'good'"),
        (("P01", 6, 4), "row 3: presentation: '6' is not in the plan of 'P01'"),
        (("P99", 1, 4), "row 3: observer: 'P99' has no plan; who has: P01, P02, P03, P04"),
        (("robot-001", 99, 4), "row 3: observer: 'robot-001' is a simulated observer"),
        (("robot-001", 1, 4), "row 3: observer: 'robot-001' is a simulated observer"),
        (("P02", 1, 5), "row 3: presentation: 1 of P02 is in row 2 already"),
        (("P02", "01", 7), "row 3: presentation: 01 of P02 is in row 2 already"),
        (("P01", 1, "--5"), "row 3: vote: is '--5'"),
        (("P03", 1, 9), "row 3: vote: is 9, but 4 is stored already"),
    ],
)
def test_faulty_typed_votes_are_refused_all_or_none(folder, row, why, capsys):
    write_test(folder)
    plan_panel(folder, seed=5)
    manifest = read_manifest(folder)
    with open_store(folder, manifest) as store:
        store.add_observer("robot-001", draw_plan(manifest, "robot-001", 1), simulated=True)
        first = store.rows("P03")[0]
        store.record_vote(first.id, Vote(4, None, NOW, True, None, False))
    path = typed(folder, [("P02", 1, 5), row])
    assert main(["session", str(folder), "--typed", str(path)]) == 2
    assert why in capsys.readouterr().err
    with read_store(folder) as store:
        assert [r.vote.vote for r in store.rows() if r.vote is not None] == [4]


def test_a_table_without_its_columns_is_refused(folder):
    plan_panel(folder, seed=5)
    path = folder.parent / "typed.csv"
    path.write_text("observer,vote\nP01,3\n", encoding="utf-8")
    with pytest.raises(InputError, match="must have observer, presentation, vote"):
        read_typed_votes(folder, path)


def test_only_one_thing_is_asked_of_the_command(folder, capsys):
    with pytest.raises(SystemExit) as left:
        main(["session", str(folder), "--plan", "--status"])
    assert left.value.code == 2
    assert main(["session", str(folder)]) == 2
    assert "give --observer ID, --plan" in capsys.readouterr().err
