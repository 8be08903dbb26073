"""Which tasks a model wrote: the line in their files, and the fingerprint of what they do (safety.drafted, safety.meaning)."""

import json

import pytest

from formiga_bt.rehearsal.testing import packaged_world, task_of
from formiga_bt.safety.drafted import Drafted, drafted, merged, said_in, stamped, unlike_a_stamp, unstamped
from formiga_bt.safety.meaning import meaning
from tests.golden import Wording

LOOK = """\
imports: [lib/flying.yaml]
params:
  target: {type: place, default: camp}
  height: {type: distance, default: 40 m}
agents:
  drone: {type: lwd, near: "${target}"}
  person: {type: watcher}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${target}", height: "${height}"}
  - ask: Is ${height} good?
    of: [person]
    options: ["yes", "no"]
    timeout: 5 min
    save_as: reply
  - if: reply.answer == 'yes'
    then: [{wait: 30 s}]
  - for: {mark: "${[target, base]}"}
    steps: [{notify: "at ${mark}"}]
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
OWN = """\
subtrees:
  Pause:
    params: {long: duration}
    steps: [{wait: "${long}"}]
agents: {w: {type: watcher}}
steps:
  - call: Pause
    with: {long: 3 s}
"""


def of(text: str, name: str = "Look") -> str:
    return meaning(task_of(text, *packaged_world(), name=name))


@pytest.mark.parametrize(
    "copy",
    [
        "# a comment\n" + LOOK.replace("steps:\n", "\nsteps:  # here\n", 1),
        LOOK.replace("40 m}", "60 m}").replace("default: camp", "default: lake_shore"),
        LOOK.replace("target", "spot"),
        LOOK.replace("drone}", "machine}").replace("  drone:", "  machine:").replace("drone: ", "drone: ", 1),
        LOOK.replace("person", "somebody").replace("reply", "answer_1").replace("mark", "here"),
        "priority: high\ndescription: mine\ntimeout: 2 h\n" + LOOK,
        LOOK.replace("  - call: FlyTo\n", "  - call: FlyTo\n    name: Over there\n    note: going\n"),
    ],
    ids=["comments", "defaults", "a param", "a role", "other names", "what is around it", "names of steps"],
)
def test_a_copy_is_known_again(copy: str) -> None:
    assert copy != LOOK
    assert of(copy, "Mine") == of(LOOK)


@pytest.mark.parametrize(
    "other",
    [
        LOOK.replace("30 s", "31 s"),
        LOOK.replace("type: lwd", "type: hwd"),
        LOOK.replace("  - call: ReturnHome", "  - wait: 1 s\n  - call: ReturnHome"),
        LOOK.replace("'yes'", "'no'"),
        LOOK.replace("[target, base]", "[base, target]"),
        LOOK.replace('to: "${target}"', 'to: "${base}"'),
    ],
)
def test_what_does_something_else_is_another(other: str) -> None:
    assert other != LOOK
    assert of(other) != of(LOOK)


def test_subtrees_of_the_author_count_by_what_they_do() -> None:
    assert of(OWN.replace("Pause", "Rest").replace("long", "span")) == of(OWN)
    assert of(OWN.replace('wait: "${long}"', 'wait: "${long * 2}"')) != of(OWN)


def test_the_line_goes_with_the_file() -> None:
    text = stamped("formiga: 1\n", drafted(["eve"], "local qwen", ["root@desk"]))
    assert text == '# drafted {"by": ["eve"], "model": "local qwen", "also": ["root@desk"]}\nformiga: 1\n'
    assert said_in("# mine\n" + text.replace("# drafted", "  #drafted")) == drafted(
        ["eve"], "local qwen", ["root@desk"]
    )
    again = stamped(text, drafted(["bob"], "groq llama"))
    assert again.count("# drafted") == 1
    assert said_in(again) == drafted(["bob", "eve"], "groq llama, local qwen", ["root@desk"])
    assert unstamped(again) == "formiga: 1\n"


def test_names_in_a_text_never_take_the_place_of_who_asked() -> None:
    crowd = [f"n{n}" for n in range(9)]
    for by in ([*crowd, "root"], ["root", *crowd]):
        line = json.dumps({"by": by, "also": [f"m{n}" for n in range(10)], "model": "m" * 80})
        found = said_in(stamped(f"# drafted {line}\nformiga: 1\n", drafted(["eve"], "local qwen", ["root"])))
        assert found is not None
        assert found.by[0] == "eve"
        assert "root" in found.people
        assert found.model.startswith("local qwen, m")


@pytest.mark.parametrize(
    "words",
    ['drafted {"by": ["ann"]}', "DRAFTED {", "  drafted{}", "Drafted by ann from the request: x"],
)
def test_words_of_others_in_a_comment_are_not_read_as_its_origin(words: str) -> None:
    assert said_in(f"# {words}\n") is not None
    assert said_in(f"#   {unlike_a_stamp(words)}\n") is None
    assert unlike_a_stamp("a drafted plan") == "a drafted plan"


@pytest.mark.parametrize(
    "text",
    [
        "# drafted {",
        "# drafted {]",
        '# drafted {"by": 7}',
        '# Drafted {"by": [7, {}]}',
        "# drafted {" + "[" * 100_000,
        "# drafted {}",
    ],
)
def test_a_line_that_was_tampered_with_still_tells_that_a_model_wrote_it(text: str) -> None:
    assert said_in(f"formiga: 1\n{text}\ntask: A\n") == Drafted()


def test_the_head_of_a_draft_tells_it_too_and_a_hand_written_file_tells_nothing() -> None:
    assert said_in("# Drafted by local qwen from the request:\n#   Fly.\n") == drafted([], "local qwen")
    assert said_in("# Drafted from the request:\n#   Fly.\n") == Drafted()
    assert said_in("# drafted by hand on a train\nformiga: 1\ntask: A\n") is None


def test_names_are_one_short_line_each() -> None:
    evil = drafted(["eve\n\x1b[2Jask: x", "  ", "n" * 500, *map(str, range(50))], "m\u202e\r\nformiga: 1")
    assert evil.by[0] == "eve [2Jask: x"
    assert (len(evil.by), max(map(len, evil.by))) == (10, 80)
    assert evil.model == "m formiga: 1"
    assert stamped("x", evil).count("\n") == 1
    assert stamped("x", evil).isascii()


def test_who_asked_is_told_and_other_names_are_not(wording: Wording) -> None:
    both = merged([drafted(["eve"], "q", ["root@desk", "cli"]), None, drafted(["bob"], "q")])
    assert both is not None
    wording(both.told)
    assert both.people == ("eve", "bob", "root@desk")
    assert merged([None]) is None
    wording(Drafted().told)
