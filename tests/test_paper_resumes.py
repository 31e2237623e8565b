"""Promise: what `dsis paper` has finished outlasts an interruption; nothing else is in the way."""

from dataclasses import replace

import pytest

from analysis.paper import PARTS, Setting, denoised, table2, write_paper
from dsis.errors import InputError
from small_paper import Two, read, write_pictures


@pytest.fixture
def quick(monkeypatch):
    """Denoisers that change nothing, tried once, and no figure."""

    def unchanged(image, *_, **__):
        return image

    def undrawn(_, path):
        for end in (".svg", ".png"):
            path.with_suffix(end).write_bytes(b"")

    monkeypatch.setattr(denoised, "DENOISERS", dict.fromkeys(denoised.DENOISERS, unchanged))
    monkeypatch.setattr(denoised, "FACTORS", (1.0,))
    monkeypatch.setattr(table2, "draw_gains", undrawn)
    return monkeypatch


def refuses(*_):
    raise InputError.of("votes.csv", "", "was moved meanwhile")


def interrupted(*_):
    raise KeyboardInterrupt


def test_an_interrupted_table_2_goes_on_where_it_stopped(tmp_path, quick):
    whole, out = tmp_path / "whole", tmp_path / "out"
    told = []
    write_paper(whole, Two(), ["table2"], lambda *said: told.append(said))
    assert told == [
        (0, 3, "frame 1 of 2 of table2"),
        (1, 3, "frame 2 of 2 of table2"),
        (2, 3, "table2"),
    ]
    frame, made = denoised._frame, []

    def killed_at_the_second(city, number, *rest, **whole):
        made.append(number)
        if made == [0, 1]:
            raise KeyboardInterrupt
        return frame(city, number, *rest, **whole)

    quick.setattr(denoised, "_frame", killed_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        write_paper(out, Two(), ["table2"])
    assert not out.exists()
    with pytest.raises(InputError, match="unfinished work of another"):
        write_paper(out, replace(Two(), seed=2), ["table2"])
    with quick.context() as patch:  # an error takes no finished frame away either
        patch.setattr(denoised, "scene", refuses)
        with pytest.raises(InputError, match="was moved"):
            write_paper(out, Two(), ["table2"])
    write_paper(out, replace(Two(), jobs=2), ["table2"])
    assert made == [0, 1, 1]
    one, two = ({p.name: p.read_bytes() for p in folder.iterdir()} for folder in (whole, out))
    assert one == two


@pytest.mark.usefixtures("quick")
def test_frames_after_the_first_hold_what_the_paper_has(tmp_path):
    """And their number is that of the rows beside the paper's: a mean with its standard error."""
    write_paper(tmp_path / "out", Two(), ["table2"])
    rows = read(tmp_path / "out" / "table2_frames.csv")
    kept = {(r["demosaicking"], r["adapted"]) for r in rows if r["frame"] == "1"}
    assert kept == {("none", "false"), ("bilinear", "false")}
    assert len({(r["demosaicking"], r["adapted"]) for r in rows if r["frame"] == "0"}) == 8
    beside = read(tmp_path / "out" / "table2.csv")
    assert len(beside) == 18
    values = [float(r["psnr_db"]) for r in rows if r["noise"] == "sd" and r["stage"] == "2"
              and (r["demosaicking"], r["denoiser"]) == ("bilinear", "noisy")]  # fmt: skip
    noisy = next(r for r in beside if r["what"] == "SD / 2, noisy, dem.")
    assert float(noisy["recomputed"]) == pytest.approx(sum(values) / 2, abs=0.006)
    error = abs(values[0] - values[1]) / 2
    assert float(noisy["standard error"]) == pytest.approx(error, rel=0.01)
    page = (tmp_path / "out" / "paper.html").read_text(encoding="utf-8")
    assert "measured on 1 of the frames only" in page


def test_work_that_was_stopped_before_it_finished_anything_gives_way(tmp_path, monkeypatch):
    """Other names, another seed: nobody has to remove a folder in which nothing is finished."""
    setting = Setting(kodak=write_pictures(tmp_path))
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setitem(PARTS, "fig3", interrupted)
        with pytest.raises(KeyboardInterrupt):
            write_paper(out, setting, ["fig3"])
    assert out.with_name("out.partial").is_dir()
    write_paper(out, replace(setting, seed=2), ["table1"])
    assert (out / "table1.csv").is_file()
    assert not out.with_name("out.partial").exists()
