"""``tolalloc costs``: shop data in, cost models with their errors out."""

from __future__ import annotations

import pytest

from tests.builders import SHOP, shop_file
from tests.studies.command import answer_of, refused, tolalloc


@pytest.fixture
def shop(tmp_path):
    return shop_file(tmp_path / "shop.csv")


@pytest.mark.slow
def test_shop_data_become_the_form_that_made_them(shop):
    taken = [fit for fit in answer_of("costs", str(shop))["fits"] if fit["taken"] == "yes"]
    assert [fit["form, t in µm [cost units]"] for fit in taken] == ["0.5 + 40/t"]
    assert taken[0]["largest error [%]"] < 1e-6
    assert (taken[0]["valid from [µm]"], taken[0]["valid to [µm]"]) == (5, 40)


@pytest.mark.slow
def test_a_report_is_written_once(shop, tmp_path):
    folder = tmp_path / "report"
    assert tolalloc("costs", str(shop), "--out", str(folder)).returncode == 0
    assert (folder / "report.html").is_file()
    refused(tolalloc("costs", str(shop), "--out", str(folder)), "not empty")


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("ground,5,µm,1\nground,8,µm,2\nground,12,µm,3\n", "fall"),
        ("ground,5,µm,2\nground,8,µm,1\n", "number of points for a fit is 2"),
        ("ground,5,yard,2\nground,8,µm,1\n", "yard"),
        ("", "no rows"),
    ],
)
def test_bad_shop_data_end_in_one_sentence(tmp_path, rows, said):
    path = tmp_path / "bad.csv"
    path.write_text(SHOP + rows, encoding="utf-8")
    refused(tolalloc("costs", str(path)), said)
