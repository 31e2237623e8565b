"""Promise: what a laboratory needs around the page: plans, sheets, set-up, own clips, exports."""

import csv
import gzip
import json
import re
import shlex
import shutil
import sqlite3
import subprocess
from pathlib import Path

import numpy as np
import pytest

from dsis.cli import _parser, main
from dsis.errors import DamagedError, InputError
from dsis.imagefile import write_codes
from dsis.manifest import Clip, ClipFiles, Manifest, Quality, read_manifest, write_manifest
from dsis.session import (
    export_votes,
    plan_panel,
    read_setup,
    read_typed_votes,
    run_robots,
    serve,
    status,
    write_sheets,
)
from dsis.session.clips import check_playable, checked_clip, prepare_clips
from dsis.session.memory import available_memory_bytes, check_memory, clips_kept
from dsis.session.panel import enrol, held
from dsis.session.plan import draw_plan
from dsis.session.setup import Setup, current_setup, put_in_force
from dsis.session.store import STORE, Vote, open_store, read_store
from dsis.spec import Sequence, Session

SIZE = Sequence(width=16, height=12, fps=25.0, seconds=0.16)  # 4 frames
ROOT = Path(__file__).resolve().parents[1]
NOW = "2026-03-01T09:30:00.000+01:00"


def write_test(folder, files=None, **session):
    """Two contents of two test clips; `files` makes the manifest's entry for the first of them."""
    folder.mkdir(exist_ok=True)
    clips = []
    for content in ("city", "land"):
        for name in ("reference", "one", "two"):
            stimulus = f"{content}__{name}"
            (folder / f"{stimulus}.rgb").write_bytes(bytes(SIZE.frames * 16 * 12 * 3))
            entry = {"player": ClipFiles(path=f"{stimulus}.rgb")}
            if files is not None and stimulus == "city__one":
                entry = files
            role = "reference" if name == "reference" else "test"
            reference = None if role == "reference" else f"{content}__reference"
            clips.append(
                Clip(
                    stimulus=stimulus, content=content, role=role, reference=reference, files=entry
                )
            )
    manifest = Manifest(
        schema="dsis-manifest/1",
        title="By hand",
        sequence=SIZE,
        session=Session(**{"training": 0, "dummies": 1, "observers": 4, **session}),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)
    return manifest


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def folder(tmp_path):
    write_test(tmp_path / "stimuli")
    return tmp_path / "stimuli"


# ---- plans


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


# ---- score sheets


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
        (("P99", 1, 4), "row 3: presentation: '1' is not in the plan of 'P99'"),
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


# ---- set-up


def test_a_set_up_is_read_kept_and_exported(folder, tmp_path):
    path = tmp_path / "lab.toml"
    path.write_text(
        'schema = "dsis-session/1"\nlab = "TUM"\nhidden_references = true\nconsent = "Yes."\n'
        '[display]\nmodel = "BVM"\ndiagonal_inch = 24.5\npeak_cd_m2 = 100\ndistance_heights = 3\n',
        encoding="utf-8",
    )
    assert main(["session", str(folder), "--plan", "--setup", str(path)]) == 0
    with read_store(folder) as store:
        assert current_setup(store, Session()) == read_setup(path, (1, 10))
        kinds = [row.presentation.kind for row in store.rows("P01")]
        first = store.rows("P01")[0]
    assert kinds.count("reference") == 2
    with open_store(folder, read_manifest(folder)) as store:
        put_in_force(store, Setup(lab="EPFL", hidden_references=True), Session())  # what may change
        with pytest.raises(InputError, match="hidden_references: is false, must stay true"):
            put_in_force(store, Setup(), Session())
        store.record_vote(first.id, Vote(4, None, NOW, True, None, False))
    export_votes(folder, tmp_path / "votes")
    (row,) = table(tmp_path / "votes" / "votes.csv")
    assert row["lab"] == "EPFL"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "schema: is missing"),
        ('schema = "dsis-session/2"', "schema: is"),
        ('schema = "dsis-session/1"\nconsents = "x"', "did you mean consent"),
        ('schema = "dsis-session/1"\nlab = "a lab"', "lab: is"),
        ('schema = "dsis-session/1"\ngrade_words = ["bad", "good"]', "must have 10"),
        ('schema = "dsis-session/1"\n[display]\nmodel = "x"', "display.peak_cd_m2: is missing"),
    ],
)
def test_faults_of_a_set_up_are_named(tmp_path, text, why):
    path = tmp_path / "lab.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=why.replace(".", r"\.")):
        read_setup(path, (1, 10))


# ---- memory


def test_what_does_not_fit_into_memory_is_refused_before_anything_is_shown(folder):
    manifest = read_manifest(folder).model_copy(
        update={"sequence": Sequence(width=1920, height=1080, fps=25.0, seconds=10.0)}
    )
    needed = 2 * 250 * 1920 * 1080 * 4 + 512 * 2**20  # 4.7 GB
    check_memory(manifest, folder, needed)
    check_memory(manifest, folder, None)
    with pytest.raises(InputError, match=r"needs 4\.7 GB of memory, 4\.6 GB are free"):
        check_memory(manifest, folder, needed - 10**8)
    assert clips_kept(manifest, needed) == 2
    assert clips_kept(manifest, 10**12) == 8
    assert clips_kept(manifest, None) == 2
    assert available_memory_bytes() > 0


# ---- clips of one's own


def frames():
    return np.random.default_rng(3).integers(0, 256, (4, 12, 16, 3), np.uint8)


def write_images(folder, kind="png"):
    (folder / "mine").mkdir(parents=True)
    for i, frame in enumerate(frames(), 8):  # 8, 9, 10, 11: natural order
        write_codes(folder / "mine" / f"{i}.{kind}", frame)


@pytest.mark.parametrize("form", ["png8", "frames"])
@pytest.mark.parametrize("kind", ["png", "tif"])
def test_image_files_are_shown_as_they_are(tmp_path, form, kind):
    folder = tmp_path / "stimuli"
    write_images(folder, kind)
    manifest = write_test(folder, {form: ClipFiles(path=f"mine/*.{kind}")})
    check_playable(manifest, folder)
    said = []
    prepare_clips(manifest, folder, said.append)
    assert said == ["clip 2 of 6 made ready: city__one"]
    clip = checked_clip(manifest, folder, manifest.clip("city__one"))
    assert b"".join(clip.frame(i) for i in range(4)) == frames().tobytes()
    prepare_clips(manifest, folder, said.append)
    assert len(said) == 1  # nothing has changed
    clip.path.write_bytes(clip.path.read_bytes()[:-1] + b"\0")
    if frames().tobytes()[-1]:
        with pytest.raises(DamagedError, match="differs from the manifest"):
            checked_clip(manifest, folder, manifest.clip("city__one"))


def test_a_lossless_video_is_shown_as_it_is(tmp_path):
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    folder = tmp_path / "stimuli"
    folder.mkdir()
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "16x12", "-r", "25", "-i", "-"]
    for name, codec in {
        "good.mkv": ["-c:v", "ffv1", "-pix_fmt", "gbrp"],
        "subsampled.mkv": ["-c:v", "ffv1", "-pix_fmt", "yuv420p"],
        "lossy.avi": ["-c:v", "mjpeg"],
    }.items():
        command = ["ffmpeg", "-v", "error", *raw, *codec, str(folder / name)]
        subprocess.run(command, input=frames().tobytes(), check=True)
    manifest = write_test(folder, {"video": ClipFiles(path="good.mkv")})
    prepare_clips(manifest, folder)
    clip = checked_clip(manifest, folder, manifest.clip("city__one"))
    assert b"".join(clip.frame(i) for i in range(4)) == frames().tobytes()
    for name, why in (("subsampled.mkv", "must be 8-bit RGB"), ("lossy.avi", "must be lossless")):
        manifest = write_test(folder, {"video": ClipFiles(path=name)})
        with pytest.raises(InputError, match=why):
            prepare_clips(manifest, folder)


def test_clips_that_cannot_be_shown_exactly_are_refused(tmp_path):
    folder = tmp_path / "stimuli"
    write_images(folder)
    deep = (frames()[0].astype(np.uint16)) << 8
    write_codes(folder / "deep" / "0.tif", deep)
    write_codes(folder / "small" / "0.png", frames()[0][:6])
    for path, why in (
        ("deep/*.tif", "is uint16, must be a lossless file of 8 bits"),
        ("small/*.png", "is 16 x 6, must be 16 x 12"),
        ("mine/8.png", "has 1 frames, must have 4"),
        ("none/*.png", "names 0 files"),
    ):
        manifest = write_test(folder, {"frames": ClipFiles(path=path)})
        with pytest.raises(InputError, match=why):
            prepare_clips(manifest, folder)
    wrong = ClipFiles(path="mine/*.png", frame_sha256=("0" * 64,) * 4)
    with pytest.raises(InputError, match=r"differs from the manifest \(SHA-256\)"):
        prepare_clips(write_test(folder, {"frames": wrong}), folder)


@pytest.mark.parametrize("form", ["player", "frames"])
def test_a_manifest_never_leads_out_of_its_folder(tmp_path, form):
    outside = tmp_path / "outside.rgb"
    outside.write_bytes(bytes(SIZE.frames * 16 * 12 * 3))
    folder = tmp_path / "stimuli"
    for path in ("../outside.rgb", str(outside)):
        write_test(folder, {form: ClipFiles(path=path)})
        with pytest.raises(InputError, match="must stay inside the manifest's folder"):
            serve(folder, "anna", open_browser=False)
    (folder / "link.rgb").symlink_to(outside)
    write_test(folder, {form: ClipFiles(path="link.rgb")})
    with pytest.raises(InputError, match="leads out of the manifest's folder"):
        serve(folder, "anna", open_browser=False)
    assert not (folder / "session" / "votes.sqlite").exists()


# ---- exports and status


def watched(store, row, vote, **display):
    """Store a vote on a presentation that was shown by the page."""
    store.log("started", presentation=row.id, showing=1, display=display)
    clip = {"longest_interval_ms": 41.5, "hidden": False, "dropped": None, "counters": {}}
    logs = [
        {"show": show, "frames": [[0, 0.0], [1, 40.0]], **clip} for show in ("reference", "test")
    ]
    details = {"showing": 1, "clips": logs}
    store.record_vote(row.id, Vote(vote, 5.0, NOW, True, 0, False), details=details)


def test_the_frame_log_and_sureals_votes_are_exported(folder, tmp_path):
    from analysis import read_votes
    from analysis.surealfile import read_sureal

    plan_panel(folder, seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        for observer in ("P01", "P02"):
            for row in store.rows(observer):
                watched(store, row, 7, refresh_hz=50.0, device_pixel_ratio=1, full_screen=True)
    out = tmp_path / "votes"
    export_votes(folder, out)
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    export_votes(folder, out)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == first

    lines = [json.loads(line) for line in gzip.decompress(first["frames.jsonl.gz"]).splitlines()]
    assert len(lines) == 2 * 5 * 2
    assert lines[0]["frames"] == [[0, 0.0], [1, 40.0]]
    assert {line["refresh_hz"] for line in lines} == {50.0}
    shown = table(out / "presentations.csv")
    assert shown[0]["longest_interval_ms"] == "41.5"
    assert (shown[0]["full_screen"], shown[-1]["full_screen"]) == ("true", "")
    votes = read_votes(out / "votes.csv")
    again = read_sureal(out / "sureal.json")
    scored = votes[votes["kind"] == "test"]
    assert len(again) == len(scored) == 8
    key = ["observer", "stimulus"]
    merged = scored.merge(again, on=key, suffixes=("", "_sureal"))
    assert len(merged) == 8
    assert (merged["vote"] == merged["vote_sureal"]).all()
    package = json.loads(first["datapackage.json"])
    described = {entry["path"] for entry in package["resources"] + package["files"]}
    assert described == set(first) - {"datapackage.json"}


def test_status_flags_what_may_spoil_a_sitting_and_tells_no_score(folder):
    plan_panel(folder, seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        for row in store.rows("P01"):
            watched(store, row, 7, refresh_hz=60.0, device_pixel_ratio=1.25, full_screen=False)
        for row in store.rows("P02"):
            watched(store, row, 7, refresh_hz=50.02, device_pixel_ratio=1, full_screen=True)
        store.log("interrupted", presentation=store.rows("P02")[0].id, showing=1)
    first, second, *_ = status(folder).observers
    assert first.flags == (
        "60 Hz is no multiple of 25 (5)",
        "not full screen (5)",
        "zoomed, pixel ratio 1.25 (5)",
    )
    assert second.flags == ("interrupted (1)",)
    assert "7" not in str(status(folder)).replace("P07", "")
    assert str(status(folder)).startswith("2 of 4 observers are done")


def test_the_same_grade_many_times_is_flagged(tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, repetitions=3)
    plan_panel(folder, "anna", seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        for row in store.rows("anna"):
            store.record_vote(row.id, Vote(4, None, NOW, True, None, False))
    (anna,) = status(folder).observers
    assert anna.flags == ("the same grade 10 times or more in succession",)


def test_robots_see_hidden_references_and_orders_in_pairs(tmp_path):
    folder = tmp_path / "stimuli"
    manifest = write_test(folder)
    clips = [
        clip.model_copy(update={"quality": Quality(visible_noise=2.0)}) for clip in manifest.clips
    ]
    write_manifest(manifest.model_copy(update={"clips": tuple(clips)}), folder)
    run_robots(folder, 2, seed=1, setup=Setup(hidden_references=True))
    with read_store(folder) as store:
        orders = [
            [r.presentation.stimulus for r in store.rows(n) if r.presentation.kind != "dummy"]
            for n in ("robot-001", "robot-002")
        ]
    assert orders[0] == orders[1][::-1]
    assert sorted(orders[0]) == sorted(clip.stimulus for clip in clips)


def test_only_one_thing_is_asked_of_the_command(folder, capsys):
    with pytest.raises(SystemExit) as left:
        main(["session", str(folder), "--plan", "--status"])
    assert left.value.code == 2
    assert main(["session", str(folder)]) == 2
    assert "give --observer ID, --plan" in capsys.readouterr().err


def test_the_examples_of_the_docs_work_as_they_stand_there(tmp_path):
    text = (ROOT / "docs" / "session.md").read_text(encoding="utf-8")
    for line in re.findall(r"^dsis .*$", text, re.MULTILINE):
        assert callable(_parser().parse_args(shlex.split(line.split(" #")[0])[1:]).command)
    for picture in re.findall(r"!\[.*?\]\((.*?)\)", text):
        assert (ROOT / "docs" / picture).is_file(), picture
    (tmp_path / "lab.toml").write_text(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])
    assert read_setup(tmp_path / "lab.toml", (1, 2)).hidden_references
    (tmp_path / "manifest.json").write_text(re.search(r"```json\n(.*?)```", text, re.DOTALL)[1])
    check_playable(read_manifest(tmp_path), tmp_path)


def test_consent_and_hidden_references_come_from_the_spec_where_no_set_up_says() -> None:
    session = Session(consent="I agree.", hidden_references=True)
    assert Setup(lab="TUM").completed(session).consent == "I agree."
    assert Setup(lab="TUM").completed(session).hidden_references
    own = Setup(consent="Ours.", hidden_references=False).completed(session)
    assert (own.consent, own.hidden_references) == ("Ours.", False)


def test_votes_that_were_altered_are_not_exported(folder, tmp_path):
    plan_panel(folder, seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        store.record_vote(store.rows("P01")[0].id, Vote(4, None, NOW, True, None, False))
    export_votes(folder, tmp_path / "votes")
    db = sqlite3.connect(folder / STORE)
    db.execute("DROP TRIGGER votes_no_UPDATE")
    db.execute("UPDATE votes SET vote = 9")
    db.commit()
    db.close()
    with pytest.raises(DamagedError, match="not those in the log"):
        export_votes(folder, tmp_path / "votes")
