"""The paper's form: the programs after its appendices fly as their requests ask, and wrong ones are refused."""

from pathlib import Path

import pytest

from experiments.e2_llm.columns import COLUMNS
from experiments.e2_llm.fly import Scene, world_of
from experiments.e2_llm.paper_form.author import PaperFormAuthor
from experiments.e2_llm.paper_form.child import Limits
from experiments.e2_llm.paper_form.fly import fly_program
from experiments.e2_llm.paper_form.inside.names import problems
from experiments.e2_llm.paper_form.programs import example, function, reference
from experiments.e2_llm.paper_form.prompt import messages, program_in
from experiments.e2_llm.paper_form.runs import judged_program, run_of_program
from experiments.e2_llm.records import Whose, read
from experiments.e2_llm.requests import Request, requests
from experiments.e2_llm.run import experiment, main
from formiga_bt.llm.records import Message, ModelReply, Usage
from tests.golden import Wording

WORLD = world_of()
UP = 'name, kind = select_robot(None, [], ["lwd"])\nclient = action_client(kind, name, "TakeOff", True, task)\n'
WAIT = "while client.get_result() is None:\n    pass\n"

network = pytest.mark.network
"""Programs are run in a process of their own."""


def request(task: str, run: int = 0) -> Request:
    return requests(task, WORLD)[run]


@network
@pytest.mark.parametrize("task", ["T1", "T2", "T3", "T4", "T5", "T6", "T7", "T8", "T9", "T10", "T10+"])
def test_the_programs_after_the_paper_do_what_is_asked(task: str) -> None:
    asked = request(task, 16)

    assert judged_program(asked, reference(asked, WORLD), WORLD).said == "right"


WRONG = [
    ("T6", "half a circle, as in T9 of the paper", "i * 2 * math.pi / 36", "i * math.pi / 36", "no_circle"),
    ("T6", "not back to the centre", "    points_list.append(center)\n", "", "not_at_center"),
    ("T6", "heights that change", "point.z = center.z", "point.z = center.z + i", "not_level"),
    ("T6", "results are not awaited, as in the paper", "        while clientGoTo.get_result() is None:\n            pass\n", "",
     "no_circle"),
    ("T6", "a heavy drone", "['lwd']", "['hwd']", "wrong_machine"),
    ("T7", "three points in a line, as in the paper",
     "p3_Cartesian.x = p1_Cartesian.x\n    p3_Cartesian.y = p1_Cartesian.y + leg",
     "p3_Cartesian.x = p1_Cartesian.x - leg\n    p3_Cartesian.y = p1_Cartesian.y", "no_formation"),
    ("T7", "nobody waits for the others", "    while clientGoTo2.get_result() is None:\n        pass\n"
     "    while clientGoTo3.get_result() is None:\n        pass\n", "", "no_formation"),
    ("T8", "it never arrives, as in the paper", "    zigzag_points.append(Final_Cartesian)\n", "", "not_landed_there"),
    ("T8", "growing swings, as in the paper", "side = amplitude * (-1) ** i",
     "side = amplitude * i * (-1) ** i", "wrong_amplitude"),
    ("T8", "Land is no action, as in the paper", '"LandIn"', '"Land"', "not_landed_there"),
    ("T9", "the landing is a take-off, as in the paper", '"LandIn"', '"TakeOff"', "no_escort"),
    ("T9", "one after the other", "    t2.start()\n    t1.join()\n", "    t1.join()\n    t2.start()\n", "one_after_the_other"),
    ("T10", "nobody is asked", '    watcherResult = clientWatch.get_result().result\n',
     '    watcherResult = "positive"\n', "flew_on"),
    ("T10", "1 m apart, as in the paper", "first_Cartesian.x + spacing", "first_Cartesian.x + 1", "wrong_spacing"),
    ("T10", "the result is compared as in the paper", "get_result().result", "get_result()", "not_at_next_stop"),
]  # fmt: skip


@network
@pytest.mark.parametrize(("task", "_what", "old", "new", "code"), WRONG, ids=[f"{row[0]} {row[1]}" for row in WRONG])
def test_wrong_programs_are_no_success(task: str, _what: str, old: str, new: str, code: str) -> None:
    asked = request(task, 6 if task == "T6" else 0)
    program = reference(asked, WORLD)
    assert old in program

    found = judged_program(asked, program.replace(old, new), WORLD)

    assert found.valid
    assert code in found.faults, found.said


@pytest.mark.parametrize("task", ["T1", "T2", "T3", "T4", "T5", "T6", "T7", "T8", "T9"])
def test_examples_name_nothing_that_there_is_not(task: str) -> None:
    assert problems(example(task, WORLD)) == []


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("fly_home()", "line 1: there is no fly_home"),
        ("def f():\n    return land_all()\nf()", "line 2: there is no land_all"),
        ("import rospy", "line 1: there is no module rospy"),
        ("from time import sleep, ctime", "line 1: there is no time.ctime"),
        ("import math\nmath.turn(3)", "line 2: there is no math.turn"),
        ("print(", "line 1: '(' was never closed"),
        ("().__class__", "line 1: .__class__ is not for tasks"),
        ("async def f():\n    pass", "line 1: a task is not asynchronous; use threading.Thread"),
        ("(" * 5000 + ")" * 5000, "line 1: too many nested parentheses"),
        ("x = 1" + " " * 20_000, "the program has 20005 characters, more than 20000"),
        ("x = 1\0", "source code string cannot contain null bytes"),
        ("exec('x = 1')", "line 1: there is no exec"),
    ],
)
def test_what_there_is_not_is_refused_before_it_runs(code: str, text: str) -> None:
    assert problems(code) == [text]


@pytest.mark.parametrize(
    "code",
    [
        "total = 0\ndef f():\n    global total\n    total = 1\nf()",
        "class A:\n    def __init__(self):\n        self._x = [i for i in range(3)]\nA()",
        "if __name__ == '__main__':\n    print(math.pi, f'{task}')",
        "try:\n    x = 1\nexcept Exception as error:\n    print(error)",
        "import math as m, time\nfrom threading import Thread\nThread(target=lambda: m.pi).start()",
    ],
)
def test_plain_python_is_not_refused(code: str) -> None:
    assert problems(code) == []


@network
def test_an_unknown_name_is_no_success_and_nothing_flies(wording: Wording) -> None:
    found = judged_program(request("T6"), UP + WAIT + "come_home(name)\n", WORLD)

    assert (found.valid, found.passed, found.faults) == (False, False, ("check",))
    wording(found.said)


@network
@pytest.mark.parametrize(
    ("code", "status", "text"),
    [
        (UP + WAIT + 'action_client(kind, name, "Hover", True, task)', "FAILED exception",
         "line 5: ToldError: there is no action server /lwd/lwd_3/action/Hover"),
        (UP + WAIT + UP.replace("select_robot", "(lambda *_: (name, kind)) or select_robot") + WAIT, "FAILED exception",
         "line 5: TypeError: cannot unpack non-iterable function object"),
        (UP + WAIT + UP.split("\n")[1] + "\n" + WAIT, "FAILED aborted", "TakeOff of lwd_3 was rejected (already_airborne)"),
        ('for i in range(4):\n    select_robot(None, [], ["lwd"])', "FAILED no_agent", "no lwd is on STANDBY"),
        ('select_robot("lwd_9", [], ["lwd"])', "FAILED no_agent", "no lwd_9 is on STANDBY"),
        ("GpsToCartesian(500, 0, 0)", "FAILED exception", "line 1: ToldError: 500.0, 0.0 are no degrees"),
        ("GpsToCartesian(float('nan'), 0, 0)", "FAILED exception", "line 1: ToldError: not a finite number: nan"),
        ("threading.Event().wait()", "UNFINISHED deadlock", "every thread waits for something that never comes"),
        ("flag = []\nwhile not flag:\n    pass", "UNFINISHED too_long", "it was not over after 2 h"),
        ("while True:\n    time.sleep(60)", "UNFINISHED too_long", "it was not over after 2 h"),
        ("def f():\n    1 / 0\nt = threading.Thread(target=f)\nt.start()\nt.join()", "FAILED exception",
         "in a thread: line 2: ZeroDivisionError: division by zero"),
    ],
)  # fmt: skip
def test_how_programs_fail(code: str, status: str, text: str) -> None:
    flown = fly_program(code, WORLD, limits=Limits(wall_s=600.0))

    assert (f"{flown.status} {flown.code}", flown.reason) == (status, text)


@network
def test_time_is_virtual_and_the_same_every_time() -> None:
    code = (
        "def fly(wait):\n    name, kind = select_robot(None, [], ['lwd'])\n    time.sleep(wait)\n"
        "    client = action_client(kind, name, 'TakeOff', True, task)\n"
        "    while client.get_result() is None:\n        pass\n"
        "threads = [threading.Thread(target=fly, args=(i * 600,)) for i in range(3)]\n"
        "[one.start() for one in threads]\n"
    )

    first, second = fly_program(code, WORLD), fly_program(code, WORLD)

    assert first == second
    assert (first.status, first.end_s) == ("SUCCEEDED", 1204.04)
    assert [(one.agent, round(one.start_s)) for one in first.done] == [("lwd_3", 0), ("lwd_2", 600), ("lwd_1", 1200)]


@network
def test_a_new_action_preempts_and_a_function_that_nobody_calls_is_called() -> None:
    up = UP.replace("\n", "\n    ").rstrip()
    code = (
        f"def task1(RobotPreference):\n    {up}\n    while client.get_result() is None:\n        pass\n"
        "    for x in (100, 200):\n"
        "        goal = ConvertGpsToGoal(Cartesian_Coordinates(x, 40, 10))\n"
        "        client = action_client(kind, name, 'GoTo', goal, task)\n"
        "        time.sleep(5)\n"
    )

    flown = fly_program(code, WORLD)

    assert [(one.action, one.state) for one in flown.done] == [
        ("TakeOff", "succeeded"),
        ("GoTo", "canceled"),
        ("GoTo", "succeeded"),
    ]
    assert flown.machines["lwd_3"].end.flat == (200.0, 40.0)


@network
def test_a_watcher_who_never_answers_leaves_the_task_open() -> None:
    code = "client = generic_interaction_client()\n" + WAIT

    flown = fly_program(code, WORLD, Scene(silent=("watcher_1",)))

    assert (flown.status, flown.code) == ("UNFINISHED", "too_long")
    assert [(one.people, one.answer, one.answered_s) for one in flown.asked] == [(("watcher_1",), "", None)]


def test_the_prompt_has_the_parts_of_the_papers_prompt(wording: Wording) -> None:
    told = messages("T6", "Fly a circle.", WORLD)
    more = messages("T10+", "Deliver.", WORLD)

    heads = [line for line in told[0].text.split("\n") if line.startswith("# ")]
    wording(heads, told[0].text)
    assert (len(told), len(more)) == (12, 20)
    assert told[-1] == Message("user", "Fly a circle.")
    assert "CircleTask" not in "".join(one.text for one in told)
    assert "CircleTask" in "".join(one.text for one in more)
    assert "DeliverTask" not in "".join(one.text for one in more)


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        ("Here:\n```python\nx = 1\n```\nDone.", "x = 1"),
        ("```\nx\n```\nand\n```py\nx = 12345\n```", "x = 12345"),
        ("```python\nx = 1\n", "x = 1"),
        ("x = 1\n", "x = 1"),
    ],
)
def test_the_program_is_taken_out_of_the_answer(answer: str, code: str) -> None:
    assert program_in(answer) == code


class Model:
    """Answers with a text."""

    name, model = "scripted", "none"

    def __init__(self, text: str, finish: str = "stop") -> None:
        self.text, self.finish = text, finish

    def complete(self, messages: object, schema: object, **_: object) -> ModelReply:
        return ModelReply(text=self.text, finish=self.finish, usage=Usage(100, 0, 50), seconds=2.0)

    def close(self) -> None:
        """Nothing is open."""


@network
def test_the_runner_keeps_programs_as_runs(tmp_path: Path) -> None:
    out, asked = tmp_path / "results.jsonl", request("T6")
    whose = Whose(provider="scripted", model="none")
    author = PaperFormAuthor(Model(f"```python\n{reference(asked, WORLD)}```"), WORLD)

    experiment(author, whose, "paper-form", ["T6"], 1, out, make_run=run_of_program)

    (run,) = read(out)
    assert run.last is not None
    assert (run.column, run.kind, run.rounds, run.tokens, run.seconds) == ("paper-form", "task", 1, 50, 2.0)
    assert (run.last.valid, run.last.passed, run.last.success, run.ngram_tree) == (True, True, True, None)
    assert run.yaml.startswith(function("T6").split("\n")[0])


def test_an_answer_that_was_cut_off_is_no_program(wording: Wording) -> None:
    written = PaperFormAuthor(Model("```python\nx = 1", "length"), WORLD).write("T6", "words")

    assert (written.kind, written.yaml) == ("failed", "")
    wording(written.say)
    assert judged_program(request("T6"), written.yaml, WORLD).faults == ("no_task",)


def test_programs_run_only_when_the_command_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    out = str(tmp_path / "results.jsonl")
    assert "paper-form" in COLUMNS

    with pytest.raises(SystemExit):
        main(["--provider", "local", "--column", "paper-form", "--tasks", "T6", "--out", out])
    wording(capsys.readouterr().err)
    with pytest.raises(SystemExit):
        main(["--column", "paper-form", "--run-generated-python", "--tasks", "second", "--out", out])
    wording(capsys.readouterr().err)
