"""Mappings read by their tables: words, units, limits and what holds where nothing is written."""

import pytest

from formiga_bt.lang.keyed import Keys, check_version, read_root
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.text.reading import Problems

TABLE = (
    Option("file", "value", "", type="int", required=True),
    Option("who", "name", "", default="somebody"),
    Option("how", "word", "", values=("slow", "fast"), default="slow"),
    Option("loud", "flag", ""),
    Option("lat", "value", "", least=-90.0, most=90.0),
    Option("after", "value", "", type="duration", least=0.0, default=3.0),
    Option("apart", "value", "", type="distance", above=0.0, default=15.0),
    Option("count", "value", "", type="int", least=1, default=1),
    Option("all", "value", ""),
    Option("inner", "options", ""),
)


def read(text: str) -> tuple[Keys, Problems]:
    problems = Problems()
    keys = read_root(f"file: 1\n{text}", "a.yaml", TABLE, problems, what="thing", owner="a thing", begin="file: 1")
    assert keys is not None
    return keys, problems


def test_what_holds_where_nothing_is_written() -> None:
    keys, problems = read("")

    assert (keys.word("who"), keys.word("how"), keys.flag("loud")) == ("somebody", "slow", False)
    assert [keys.number(key) for key in ("lat", "after", "apart")] == [0.0, 3.0, 15.0]
    assert (keys.whole("count"), keys.text("who"), list(keys.listed("all")), keys.words("all")) == (1, None, [], [])
    assert problems.found == []


def test_values_as_they_are_written() -> None:
    keys, problems = read(
        "{who: anna, how: fast, loud: true, lat: 66.5, after: 2 min, apart: 3 m, count: 4}"[1:-1].replace(", ", "\n")
    )

    assert [keys.value(key) for key in ("who", "how", "lat", "after", "apart", "count")] == [
        "anna", "fast", 66.5, 120.0, 3.0, 4,
    ]  # fmt: skip
    assert keys.flag("loud")
    assert problems.found == []


@pytest.mark.parametrize(
    ("key", "text", "code"),
    [
        ("lat", "91", "E062"),
        ("lat", "north", "E008"),
        ("after", "-1 s", "E062"),
        ("after", "5", "E017"),
        ("apart", "0 m", "E062"),
        ("count", "0", "E062"),
        ("count", "1.5", "E062"),
        ("count", "1e12", "E062"),
        ("how", "quick", "E008"),
        ("who", "1st", "E008"),
    ],
)
def test_what_is_wrong_is_reported_and_counts_as_not_written(key: str, text: str, code: str) -> None:
    keys, problems = read(f"{key}: {text}")

    assert keys.value(key) == read("")[0].value(key)
    assert [(one.code, one.mark.line) for one in problems.found] == [(code, 2)]


def test_an_empty_list_is_reported_where_it_may_not_be_empty() -> None:
    keys, problems = read("all: []")

    assert (list(keys.listed("all")), problems.found) == ([], [])
    assert list(keys.mappings("all", "one", such_as="[{id: anna}]")) == []
    assert [one.code for one in problems.found] == ["E044"]


def test_a_mapping_with_a_table_of_its_own() -> None:
    keys, problems = read("inner: {count: 2, cuont: 3}")

    assert keys.inside("inner", TABLE[7:8], "the inner").whole("count") == 2
    assert [one.code for one in problems.found] == ["E004"]
    assert not keys.inside("all", TABLE, "all")


@pytest.mark.parametrize(
    ("text", "codes"), [("", ["E008"]), ("- 1", ["E008"]), ("who: anna", ["E008"]), ("a: [", ["E001"])]
)
def test_files_that_begin_otherwise(text: str, codes: list[str]) -> None:
    problems = Problems()

    read_root(text, "a.yaml", TABLE, problems, what="thing", owner="a thing", begin="file: 1")

    assert [one.code for one in problems.found] == codes


def test_another_version() -> None:
    keys, problems = read("")
    check_version(keys, "file", "this thing needs")
    assert problems.found == []

    keys = read_root("file: 2", "a.yaml", TABLE, problems, what="thing", owner="a thing", begin="file: 1") or keys
    check_version(keys, "file", "this thing needs")
    assert [one.code for one in problems.found] == ["E007"]
