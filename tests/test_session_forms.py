"""Promise: forms come first and whole; what is personal is kept apart and can be erased."""

import pytest

from dsis.errors import InputError
from dsis.session import export_votes, forget
from dsis.session.personal import PERSONAL, read_records
from sitting import CONSENT, DISPLAY, FORMS, OBSERVER, Sitting, write_test


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "stimuli"


@pytest.fixture
def sitting(folder):
    with Sitting(folder, write_test(folder)) as found:
        yield found


def test_nothing_is_shown_before_the_forms_are_filled(folder):
    with Sitting(folder, write_test(folder), forms=False, setup=CONSENT) as sitting:
        session = sitting.http.get("/api/session").json()
        assert session["missing"] == ["observer", "consent", "display"]
        assert session["consent"] == "I agree to this."
        presentation = sitting.next()
        url = f"/api/presentations/{presentation['id']}/start"
        for name in ("observer", "consent", "display"):
            refused = sitting.http.post(url, json={})
            assert refused.status_code == 409
            assert "first come: " in refused.json()["error"]
            missing = sitting.fill(name, FORMS[name]).json()["missing"]
            assert name not in missing
        assert sitting.http.post(url, json={}).status_code == 200


@pytest.mark.parametrize(
    ("name", "change", "why"),
    [
        ("observer", {"age": 31}, "age"),
        ("observer", {"acuity": None}, "Acuity must be given"),
        ("observer", {"acuity": 40.0}, "less than or equal to 4"),
        ("observer", {"colour_read": 15}, "Plates read right is 15, more than Plates shown"),
        (
            "observer",
            {"colour_plates": None},
            "Plates shown and Plates read right must be given together",
        ),
        ("observer", {"colour_vision": "not tested"}, "Colour vision must say"),
        ("observer", {"name": "Anna Maier"}, "unknown key"),
        ("observer", {"note": "x" * 501}, "at most 500"),
        ("consent", {"sha256": "0" * 64}, "is of another text"),
        ("display", {"display": {"model": ""}}, "display.model"),
        ("display", {"steps_seen": "yes"}, "boolean"),
        ("votes", {}, "'votes' is none"),
    ],
)
def test_forms_that_are_not_whole_are_refused(folder, name, change, why):
    with Sitting(folder, write_test(folder), forms=False, setup=CONSENT) as sitting:
        values = {**FORMS.get(name, {}), **change}
        answer = sitting.fill(name, {k: v for k, v in values.items() if v is not None})
        assert answer.status_code == 409
        assert why in answer.json()["error"]
        assert sitting.http.get("/api/session").json()["missing"][0] == "observer"
    assert read_records(folder) == {}


def test_personal_data_is_kept_apart_and_can_be_erased(folder):
    marker = "wears-a-red-hat"
    with Sitting(folder, write_test(folder), forms=False) as sitting:
        record = {**OBSERVER, "note": marker, "acuity": 0.7, "colour_vision": "deficient"}
        assert sitting.fill("observer", record).status_code == 200
        assert sitting.fill("display", DISPLAY).status_code == 200
        assert "anna: visual acuity is 0.7, below 1" in sitting.said
        assert "anna: colour vision: deficient" in sitting.said
        while sitting.judge() is not None:
            pass
    votes = b"".join(path.read_bytes() for path in (folder / "session").glob("votes*"))
    assert marker.encode() not in votes
    assert b"Landolt" not in votes
    assert read_records(folder)["anna"][1].acuity == 0.7

    out = folder.parent / "votes"
    export_votes(folder, out)
    assert not (out / "people.csv").exists()
    assert all(marker.encode() not in path.read_bytes() for path in out.iterdir())
    export_votes(folder, out, personal=True)
    assert marker in (out / "people.csv").read_text(encoding="utf-8")
    export_votes(folder, out)  # an export with personal data can be replaced by one without
    assert not (out / "people.csv").exists()

    forget(folder, "anna")
    assert read_records(folder) == {}
    assert marker.encode() not in (folder / PERSONAL).read_bytes()
    with pytest.raises(InputError, match="holds nothing about 'anna'"):
        forget(folder, "anna")
