"""Promise: tables of any size and shape, and names of any letters, get a report."""

import numpy as np
import pandas as pd
import pytest

from opinions import Page, make_votes, page, report


def test_votes_without_conditions_are_listed(shared_data, tmp_path):
    votes = pd.read_csv(shared_data / "votes" / "nflx_public_last4outliers_votes.csv")
    votes = votes.rename(columns={"subject": "observer"})
    votes["kind"] = votes["is_reference"].map({0: "test", 1: "reference"})
    out = report(tmp_path, votes, (1, 5))
    figure, text = (out / "mos.svg").read_text(), page(out)
    for stimulus in votes["stimulus"].unique():
        assert f"<!-- {stimulus} -->" in figure
    assert "would reject s27, s30; the correlation screen s27, s28, s29, s30" in text
    assert "Far above on BigBuckBunny_30_384_550" in text
    assert "hidden reference" in text


def test_many_contents_have_a_panel_each(tmp_path):
    contents = [f"kodim{n:02}" for n in range(1, 25)]
    out = report(tmp_path, make_votes(contents, observers=6))
    figure = (out / "mos.svg").read_text()
    for content in contents:
        assert f"<!-- {content} -->" in figure
    assert figure.count("<!-- without -->") == 24


def test_names_are_text_wherever_they_stand(tmp_path):
    """Neither markup nor formula; a label may start with an underscore."""
    votes = make_votes(methods=("none", "$x_1$")).replace(
        {"content": {"city": "_<b>a&b"}, "observer": {"s1": "<script>alert(1)</script>"}}
    )
    out = report(tmp_path, votes)
    Page(page(out))
    assert "<script" not in page(out)
    assert "&lt;script&gt;" in page(out)
    assert "_&lt;b&gt;a&amp;b" in page(out)


def repeated_votes():
    """Votes of a test with places, two repetitions and a drift of a grade in ten presentations."""
    random = np.random.default_rng(2)
    rows = []
    for observer in range(16):
        shown = [(s, r) for s in range(8) for r in (1, 2)]
        order = random.permutation(len(shown))
        for place, at in enumerate(order, 1):
            stimulus, repetition = shown[at]
            vote = np.clip(np.rint(2 + stimulus / 2 + place / 10 + random.normal(0, 0.8)), 1, 10)
            rows.append((f"o{observer}", f"s{stimulus}", repetition, place, vote))
    columns = ["observer", "stimulus", "repetition", "presentation", "vote"]
    return pd.DataFrame(rows, columns=columns)


@pytest.mark.usefixtures("unpainted")
def test_order_and_repetition_are_shown_where_they_are_known(tmp_path):
    out = report(tmp_path, repeated_votes())
    text = page(out)
    assert "The order of presentations shows in the votes (drift)" in Page(text).remarks
    assert (out / "order.svg").is_file()
    assert "128 votes of 16 observers were cast twice on the same sequence" in text
    assert "<h3>Test and retest</h3>" in text
    assert pd.read_csv(out / "order.csv")["effect"].tolist() == ["drift", "fatigue", "contrast"]


def test_very_many_stimuli_are_drawn_without_names(tmp_path):
    random = np.random.default_rng(1)
    rows = [
        (f"o{o}", f"s{s}", np.clip(np.rint(random.normal(3 + s / 60, 1.2)), 1, 10))
        for s in range(200)
        for o in range(6)
    ]
    votes = pd.DataFrame(rows, columns=["observer", "stimulus", "vote"])
    out = report(tmp_path, votes)
    assert "200 stimuli, by MOS" in (out / "votes.svg").read_text()
    assert "<!-- s17 -->" not in (out / "votes.svg").read_text()
