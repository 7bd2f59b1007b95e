import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.studies.document import fill_tables
from irlpilco_ros.studies.tables import markdown, spread


def test_tables_are_replaced_and_the_text_around_them_is_kept(tmp_path):
    page = tmp_path / "results.md"
    page.write_text("before\n<!-- table: a -->\nold\n<!-- end -->\nbetween\n<!-- table: b -->\n")
    page.write_text(page.read_text() + "<!-- end -->\nafter\n")
    fill_tables(page, {"a": r"| \1 new |"})
    fill_tables(page, {"a": r"| \1 new |"})
    assert page.read_text() == (
        "before\n<!-- table: a -->\n| \\1 new |\n<!-- end -->\nbetween\n"
        "<!-- table: b -->\n<!-- end -->\nafter\n"
    )


def test_a_document_without_a_place_is_an_error(tmp_path):
    page = tmp_path / "results.md"
    page.write_text("nothing\n")
    with pytest.raises(InvalidSettingError, match="no place for the table 'headline'"):
        fill_tables(page, {"headline": "x"})


def test_spread_gives_median_and_range_in_thousandths():
    assert spread([0.003, 0.001, 0.002]) == "2.0 (1.0 to 3.0)"
    assert spread([0.0015]) == "1.5"
    assert spread([]) == ""


def test_markdown_table():
    assert markdown(["a", "b"], [["x", "1"]]) == "| a | b |\n| --- | ---: |\n| x | 1 |"


def test_the_page_of_results_has_a_place_for_every_table(repository):
    from irlpilco_ros.commands.study import EXPERIMENTS
    from irlpilco_ros.studies.baxter import results

    page = (repository / "docs/results.md").read_text(encoding="utf-8")
    names = EXPERIMENTS["baxter"]
    assert tuple(results.EXPERIMENTS) == names
    for name in names:
        assert page.count(f"<!-- table: {name} -->") == 1
    assert page.count("<!-- end -->") == len(names)
