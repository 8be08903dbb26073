"""Expressions, conditions and values: types, units, places of mistakes, and what they evaluate to."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.lang.expr.scope import MaybeUnset
from formiga_bt.lang.expressions import (
    Scope,
    compile_cond,
    compile_expr,
    compile_value,
    fits,
    narrows,
    narrows_when_false,
)
from formiga_bt.lang.model import AgentType, Dependency, EvalError, Port, Site, SiteAgent, Unset
from formiga_bt.lang.text.document import Scalar, parse
from formiga_bt.lang.types import (
    AGENT,
    ANGLE,
    ANY,
    BOOL,
    DISTANCE,
    DURATION,
    INT,
    NUMBER,
    PERCENT,
    PLACE,
    POSITION,
    REGION,
    SPEED,
    TEXT,
    TIME,
    AgentRef,
    Type,
    enum_of,
    list_of,
    record_of,
)
from tests.golden import Wording

MINUTE = 60_000_000
HWD, LWD = Type("agent", of=("hwd",)), Type("agent", of=("lwd",))
NAMES = {
    "target": PLACE,
    "height": DISTANCE,
    "period": DURATION,
    "drone": HWD,
    "drones": list_of(LWD),
    "reply": record_of(answer=enum_of("yes", "no", "not_yet"), by=TEXT),
    "robot": HWD,
    "n": INT,
    "ratio": NUMBER,
    "t0": TIME,
    "alarm": enum_of("sos", "geofence"),
    "word": TEXT,
    "spots": list_of(PLACE),
    "field": REGION,
    "ok": BOOL,
    "thing": ANY,
}
SITE = Site(
    name="orchard",
    lat=60.45,
    lng=22.27,
    ports={"north": Port("north", Place(0.0, 20.0))},
    places={"camp": Place(30.0, -5.0)},
    regions={"lake": Region((Place(0.0, 0.0), Place(9.0, 0.0), Place(0.0, 9.0)))},
    agents={"hwd1": SiteAgent("hwd1", "hwd"), "p1": SiteAgent("p1", "picker")},
)
SCOPE = Scope(NAMES, roles=frozenset({"drone", "drones"}))


class FakeEnv:
    def __init__(self, **names):
        self.names = {"base": Place(0.0, 0.0), "now": 0, **names}
        self.fields = {"battery": 50.0, "airborne": False, "position": Position(1.0, 2.0, 30.0), "status": "STANDBY"}

    def name(self, name):
        if name not in self.names:
            raise Unset(name)
        return self.names[name]

    def is_set(self, name):
        return name in self.names

    def agent_field(self, agent, name):
        return self.fields[name]

    def lat_lng(self, point):
        return 60.0 + point.north_m / 1e5, 22.0 + point.east_m / 1e5

    def place(self, lat, lng):
        return Place(lng, lat)

    def ground_up_m(self, place):
        return 3.0


def scalar(text):
    return Scalar(text, Mark("t.yaml", 1, 1, 1, len(text) + 1))


def compiled(text, expected=None, scope=SCOPE):
    return compile_expr(text, scalar(text), 0, scope, expected)


def good(text, expected=None, scope=SCOPE):
    expr, found = compiled(text, expected, scope)
    assert found == []
    return expr


def problem(text, expected=None, scope=SCOPE):
    """Return code, columns, message of the only problem, and check that it is poison."""
    expr, found = compiled(text, expected, scope)
    assert len(found) == 1, found
    assert expr.type == ANY
    mark = found[0].mark
    return found[0].code, text[mark.col - 1 : mark.end_col - 1], found[0].message


def node(text):
    root, found = parse(f"k: {text}\n", "t.yaml")
    assert found == []
    return root.get("k").value


def value(text, expected, scope=SCOPE, **more):
    expr, found = compile_value(node(text), scope, expected, **more)
    assert found == []
    return expr


def value_problem(text, expected, scope=SCOPE, **more):
    expr, found = compile_value(node(text), scope, expected, **more)
    assert len(found) == 1, found
    assert expr.type == ANY
    return found[0].code, found[0].message


@pytest.mark.parametrize(
    ("text", "type_", "result"),
    [
        ("1 + 2 * 3", INT, 7),
        ("7 // 2", INT, 3),
        ("7 / 2", NUMBER, 3.5),
        ("60 m + 0.5 km", DISTANCE, 560.0),
        ("-(60 m)", DISTANCE, -60.0),
        ("2 * 30 s", DURATION, 60.0),
        ("10 m / 5 s", SPEED, 2.0),
        ("4 m/s * 10 s", DISTANCE, 40.0),
        ("100 m / 4 m/s", DURATION, 25.0),
        ("1 h / 15 min", NUMBER, 4.0),
        ("45min", DURATION, 2700.0),
        ("1 < 2 < 3", BOOL, True),
        ("2 in [1, 2] and not false", BOOL, True),
        ("'a' if 1 > 2 else 'b'", TEXT, "b"),
        ("[1 m, 2 m][1]", DISTANCE, 2.0),
        ("30 %", PERCENT, 30.0),
        ("mod(10, 3)", INT, 1),
        ("true or 1 / 3 > 2", BOOL, True),
    ],
)
def test_constants_are_typed_and_folded(text, type_, result):
    expr = good(text)
    assert (expr.type, expr.const) == (type_, result)
    assert expr.run(FakeEnv()) == result


@pytest.mark.parametrize(
    ("text", "type_", "result"),
    [
        ("drone.battery > 30 %", BOOL, True),
        ("drone.id", TEXT, "d1"),
        ("above(target, 60 m)", POSITION, Position(5.0, 6.0, 63.0)),
        ("at_height(ground(drone.position), height)", POSITION, Position(1.0, 2.0, 40.0)),
        ("drone.position.height", DISTANCE, 30.0),
        ("now - t0 > 5 min", BOOL, True),
        ("t0 + 90 s", TIME, 90_000_000),
        ("now - t0", DURATION, 600.0),
        ("len(drones)", INT, 2),
        ("drones[0].battery", PERCENT, 50.0),
        ("reply.answer == 'yes'", BOOL, True),
        ("n * height", DISTANCE, 160.0),
        ("drone == first(drones)", BOOL, True),
        ("offset(target, north=2 m)", PLACE, Place(5.0, 8.0)),
        ("distance(target, base) < 8 m", BOOL, True),
        ("thing.x + 1", ANY, 3),
    ],
)
def test_names_and_fields_are_read_from_the_environment(text, type_, result):
    env = FakeEnv(
        target=Place(5.0, 6.0),
        height=40.0,
        drone=AgentRef("d1"),
        drones=(AgentRef("d1"), AgentRef("d2")),
        reply={"answer": "yes", "by": "w"},
        n=4,
        t0=0,
        now=10 * MINUTE,
        thing={"x": 2},
    )
    expr = good(text)
    assert expr.type == type_
    assert expr.run(env) == result


@pytest.mark.parametrize(
    ("text", "problem_"),
    [
        ("n && ok", ("E009", "&&", "'&&' is written 'and'")),
        ("ok || ok", ("E009", "||", "'||' is written 'or'")),
        ("not ok and !ok", ("E009", "!", "'!' is written 'not'")),
        ("n > 1 ? 3 : 4", ("E009", "n > 1 ? 3 : 4", "'a ? b : c' is not part of the language")),
        ("n = 3", ("E009", "=", "'=' does not compare")),
        ("n ** 2", ("E009", "**", "there is no power '**'")),
        ("10 % 3", ("E009", "%", "'%' is percent here, not the remainder")),
        ("n % 3", ("E009", "%", "'%' is percent here, not the remainder")),
        ("(n + 1", ("E009", "(", "'(' is never closed")),
        ("n + 1)", ("E009", ")", "')' closes nothing")),
        ("n +", ("E009", "+", "the expression ends too soon after '+'")),
        ("n n", ("E009", "n n", "an operator is missing between 'n' and 'n'")),
        ("n if ok", ("E009", "if", "'if' needs an 'else' here")),
        ("lambda: 3", ("E009", "lambda", "'lambda' is not part of the language")),
        ("reply is None", ("E009", "is", "'is' is written '=='")),
        ("f'{n}'", ("E009", "f'{n}'", "a text has no prefix 'f'")),
        ("(1, 2)", ("E009", "(1, 2)", "a list stands in square brackets")),
        ("spots[0:1]", ("E009", ":", "':' is not part of an expression")),
        ("'abc", ("E009", "'abc", "this quote is never closed")),
        ("", ("E009", "", "an expression is missing here")),
        ("targt", ("E010", "targt", "unknown name 'targt'; did you mean 'target'?")),
        ("circle", ("E010", "circle", "'circle' is a helper: call it")),
        ("drone.batery", ("E011", "batery", "hwd agent has no field 'batery'; did you mean 'battery'?")),
        ("n.__class__", ("E011", "__class__", "an int has no field '__class__'")),
        ("length(spots)", ("E012", "length", "unknown helper 'length'; did you mean 'len'?")),
        ("__import__('os')", ("E012", "__import__", "unknown helper '__import__'")),
        ("drone.fly()", ("E012", "drone.fly()", "only helpers are called; values have fields, no methods")),
        ("above(target)", ("E012", "above(target)", "above misses 'height'")),
        ("ground(target, n)", ("E012", "ground(target, n)", "ground takes 1 argument, not 2")),
        ("first(spot=n)", ("E012", "first(spot=n)", "first has no argument 'spot'")),
        ("is_set(n + 1)", ("E012", "is_set(n + 1)", "is_set takes one name")),
        ("height + 5 s", ("E013", "height + 5 s", "cannot add a distance and a duration")),
        ("target == height", ("E013", "target == height", "cannot compare a place and a distance")),
        ("ok < ok", ("E013", "ok < ok", "cannot order true or false and true or false")),
        ("word + 'x'", ("E013", "word + 'x'", "cannot add a text and a text")),
        ("'ab' * 3", ("E013", "'ab' * 3", "cannot multiply a text by an int")),
        ("drone == 'd1'", ("E013", "drone == 'd1'", "cannot compare a hwd agent and a text")),
        ("ok and n", ("E013", "n", "'and' joins conditions, this is an int")),
        ("1 / 0", ("E013", "1 / 0", "this never has a value: division by zero")),
        ("range(2000)", ("E013", "range(2000)", "this never has a value: range takes 0 to 1000, not 2000")),
        ("[1, 'a']", ("E013", "[1, 'a']", "the items of a list are of one type, these are an int and a text")),
        ("reply.answer == 'yess'", ("E014", "'yess'", "'yess' is never possible here; did you mean 'yes'?")),
        ("alarm in ['sos', 'lst']", ("E014", "'lst'", "'lst' is never possible here")),
        ("above('target', 3 m)", ("E016", "'target'", "expected a place, got the text 'target'; did you mean target?")),
        ("drone.battery > 30", ("E017", "30", "'drone.battery' is a percent: 30 %?")),
        ("above(target, 60)", ("E017", "60", "height needs a unit: 60 m?")),
        ("height + 5", ("E017", "5", "'5' needs a unit: 5 m?")),
        ("period > 5 m", ("E017", "5 m", "'period' is a duration, '5 m' is a distance")),
        ("5 sec", ("E017", "5 sec", "'sec' is not a unit")),
        ("[1 m, 2]", ("E017", "2", "'2' needs a unit: 2 m?")),
        ("drones.battery", ("E024", "drones.battery", "'drones' is a list of agents; use for:")),
        ("offset(target, up=3 m)", ("E066", "target", "'target' is on the ground; say above(target, 60 m)")),
        (
            "above(drone.position, 3 m)",
            ("E066", "drone.position", "'drone.position' is in the air; say ground(drone.position)"),
        ),
    ],
)  # fmt: skip
def test_one_mistake_is_one_diagnostic_at_its_columns(text, problem_):
    assert problem(text) == problem_


@pytest.mark.parametrize(
    ("text", "expected", "problem_"),
    [
        ("target", POSITION, ("E066", "target", "'target' is on the ground; say above(target, 60 m)")),
        ("height", DURATION, ("E013", "height", "expected a duration, this is a distance")),
        ("60", DISTANCE, ("E017", "60", "'60' needs a unit: 60 m?")),
        (
            "'soss'",
            enum_of("sos", "geofence"),
            ("E014", "'soss'", "'soss' is never possible here; did you mean 'sos'?"),
        ),
        ("drones", AGENT, ("E024", "drones", "'drones' is a list of agents; use for:")),
        ("drone", LWD, ("E013", "drone", "expected a lwd agent, this is a hwd agent")),
        ("n", BOOL, ("E015", "n", "a condition must be true or false, this is an int")),
    ],
)
def test_the_whole_must_fit_what_is_due(text, expected, problem_):
    assert problem(text, expected) == problem_


def test_two_mistakes_are_two_diagnostics_and_poison_adds_none():
    _, found = compiled("targt == base and drone.batery + 3 s > 5 and foo(1)")
    assert [d.code for d in found] == ["E010", "E011", "E012"]


def test_marks_count_from_the_place_in_the_file():
    root, _ = parse("a: 1\nto: '${above(target, 60)}'\n", "t.yaml")
    _, found = compile_value(root.get("to").value, SCOPE, POSITION)
    assert str(found[0].mark) == "t.yaml:2:22"
    assert (found[0].mark.end_col, found[0].fix.text) == (24, "60 m")


def test_texts_outside_ascii_do_not_move_columns(wording: Wording):
    got = problem("word == 'mökki ü' and targt")
    assert got[:2] == ("E010", "targt")
    wording(got[2])


def test_reads_name_every_name_and_agent_field_once():
    expr = good("drone.battery > 30 % and above(target, height) == drone.position and drone.battery < 90 %")
    read = [(read.name, read.field) for read in expr.reads]
    assert sorted(read) == [("drone", ""), ("drone", "battery"), ("drone", "position"), ("height", ""), ("target", "")]
    assert Dependency("drones", "battery") in good("drones[0].battery").reads
    assert good("is_set(robot)").reads == (Dependency("robot"),)


MAYBE = SCOPE.with_names({}, maybe_unset={"robot": MaybeUnset("E067"), "reply": MaybeUnset("E019", "line 14")})


@pytest.mark.parametrize(
    "text",
    [
        "is_set(reply) and reply.answer == 'yes'",
        "not is_set(reply) or reply.answer == 'no'",
        "reply.answer if is_set(reply) else 'yes'",
        "'yes' if not is_set(reply) else reply.answer",
        "is_set(robot) and is_set(reply) and robot.id == reply.by",
        "not (not is_set(robot) or n > 3) and robot.airborne",
    ],
)
def test_is_set_narrows(text):
    assert good(text, scope=MAYBE).reads


def test_names_that_may_be_unset_must_be_tested(wording: Wording):
    got = problem("robot.id", scope=MAYBE)
    assert got[:2] == ("E067", "robot")
    wording(got[2])
    got = problem("is_set(robot) or reply.by == ''", scope=MAYBE)
    assert got[:2] == ("E019", "reply")
    wording(got[2])
    good("robot.id", scope=MAYBE.narrowed(frozenset({"robot"})))
    assert problem("robot", scope=Scope(NAMES, maybe_unset=frozenset({"robot"})))[0] == "E019"


def test_an_optional_value_may_be_a_whole_optional_key():
    expr = value("${robot}", HWD, MAYBE, optional=True)
    assert expr.reads == (Dependency("robot"),)
    with pytest.raises(Unset):
        expr.run(FakeEnv())
    assert value_problem("${robot}", HWD, MAYBE)[0] == "E067"


@pytest.mark.parametrize(
    ("text", "when_true", "when_false"),
    [
        ("is_set(robot)", {"robot"}, set()),
        ("not is_set(robot)", set(), {"robot"}),
        ("is_set(robot) and is_set(reply) and n > 1", {"robot", "reply"}, set()),
        ("is_set(robot) or is_set(reply)", set(), set()),
        ("not is_set(robot) or not is_set(reply)", set(), {"robot", "reply"}),
        ("n > 3", set(), set()),
    ],
)
def test_narrows_tells_what_a_condition_proves(text, when_true, when_false):
    expr, _ = compile_cond(scalar(text), MAYBE)
    assert (narrows(expr), narrows_when_false(expr)) == (when_true, when_false)


def test_conditions_are_bare_or_wholly_in_braces(wording: Wording):
    for text in ("n > 3", "${n > 3}", "${ n > 3 }"):
        expr, found = compile_cond(scalar(text), SCOPE)
        assert (found, expr.type) == ([], BOOL)
        assert expr.run(FakeEnv(n=4)) is True
    _, (partly,) = compile_cond(scalar("${n} > 3"), SCOPE)
    assert (partly.code, partly.mark.col) == ("E015", 1)
    wording(partly.help)
    _, (percent,) = compile_cond(scalar("drone.battery"), SCOPE)
    assert percent.code == "E015"
    wording(percent.message)


@pytest.mark.parametrize(
    ("text", "help_"),
    [
        ("now > 06:30", "a time of today is written today('06:30')"),
        ("now > 2026-08-20T06:30", "give a date as a parameter of type time, or write today('06:30')"),
        ("spots[10:12]", "a list is read one item at a time: write list[0]"),
        ("n : 3", ""),
    ],
)
def test_what_was_meant_by_a_colon_is_told(text, help_):
    _, (found,) = compile_cond(scalar(text), SCOPE)
    assert (found.code, found.help) == ("E009", help_)


@pytest.mark.parametrize(
    ("text", "names", "reason"),
    [
        ("1 / n", {"n": 0}, "division by zero"),
        ("spots[n]", {"n": 7, "spots": ()}, "the list has 0 items, there is no [7]"),
        ("n * n", {"n": 2**52}, "the number is too large"),
        ("first(spots)", {"spots": ()}, "first of an empty list"),
        ("thing + 1", {"thing": "x"}, "a value has the wrong type here (TypeError)"),
    ],
)
def test_what_has_no_value_raises_eval_error(text, names, reason):
    with pytest.raises(EvalError) as raised:
        good(text).run(FakeEnv(**names))
    assert raised.value.reason == reason


@pytest.mark.parametrize(
    ("text", "expected", "type_", "const"),
    [
        ("no", TEXT, TEXT, "no"),
        ("12:30", TEXT, TEXT, "12:30"),
        ("true", BOOL, BOOL, True),
        ("3", INT, INT, 3),
        ("2.5", NUMBER, NUMBER, 2.5),
        ("15 s", DURATION, DURATION, 15.0),
        ("40 %", PERCENT, PERCENT, 40.0),
        ("90 deg", ANGLE, ANGLE, 90.0),
        ("sos", enum_of("sos", "lost"), enum_of("sos", "lost"), "sos"),
        ("hwd1", HWD, HWD, AgentRef("hwd1")),
        ("1970-01-01T00:01+00:00", TIME, TIME, MINUTE),
        ("{east: 10 m, north: -4 m}", PLACE, PLACE, Place(10.0, -4.0)),
        ("{east: 1 m, north: 2 m, height: 3 m}", POSITION, POSITION, Position(1.0, 2.0, 3.0)),
        ("[1 m, 2 m]", list_of(DISTANCE), list_of(DISTANCE), (1.0, 2.0)),
        ("[]", list_of(DISTANCE), list_of(DISTANCE), ()),
        ("30 m", ANY, DISTANCE, 30.0),
        ("3", ANY, INT, 3),
        ("'3'", ANY, TEXT, "3"),
        ("hello", ANY, TEXT, "hello"),
        ("[1 m, 2 m]", ANY, list_of(DISTANCE), (1.0, 2.0)),
        ("${30 m + 1 m}", DISTANCE, DISTANCE, 31.0),
        ("${'sos'}", enum_of("sos", "lost"), enum_of("sos", "lost"), "sos"),
    ],
)
def test_literals_are_read_by_the_type_that_is_due(text, expected, type_, const):
    expr = value(f'"{text}"' if text.startswith("${") else text, expected)
    assert (expr.type, expr.const) == (type_, const)


def test_a_region_is_a_list_of_places(wording: Wording):
    expr = value("[{east: 0 m, north: 0 m}, {east: 9 m, north: 0 m}, {east: 0 m, north: 9 m}]", REGION)
    assert expr.const == SITE.regions["lake"]
    code, text = value_problem("[{east: 0 m, north: 0 m}]", REGION)
    assert code == "E013"
    wording(text)


@pytest.mark.parametrize(
    ("text", "expected", "what", "problem_"),
    [
        ("15", DURATION, "timeout", ("E017", "timeout needs a unit: 15 s or 15 min?")),
        ("15 m", DURATION, "timeout", ("E017", "timeout is due a duration, '15 m' is a distance")),
        ("15 sec", DURATION, "", ("E017", "'sec' is not a unit of duration")),
        ("3 m", INT, "count", ("E017", "count is a bare number here, without a unit")),
        ("2.5", INT, "count", ("E013", "count is due an int, 2.5 is not whole")),
        ("yes", BOOL, "", ("E016", "expected true or false, got the text 'yes'; did you mean true?")),
        ("target", POSITION, "to", ("E016", "to is due a position, got the text 'target'; did you mean ${target}?")),
        ("height", DISTANCE, "", ("E016", "expected a distance, got the text 'height'; did you mean ${height}?")),
        ("ss", enum_of("sos", "lost"), "", ("E014", "'ss' is never possible here; did you mean 'sos'?")),
        ("about ${height}", DISTANCE, "", ("E013", "expected a distance; text with ${...} in it is a text")),
        ("'${height'", DISTANCE, "", ("E009", "'${' is never closed")),
        ("{east: 1 m, north: 2 m}", POSITION, "", ("E066", "this is on the ground, a position has a height")),
        ("{east: 1 m, north: 2 m, height: 9 m}", PLACE, "", ("E066", "a place is on the ground; this has a height")),
        ("{east: 1, north: 2 m}", PLACE, "", ("E017", "east needs a unit: 1 m?")),
        ("{lat: 60.1}", PLACE, "", ("E008", "'lng' is missing")),
        ("{lat: 95, lng: 22}", PLACE, "", ("E062", "lat lies between -90 and 90")),
        ("{lat: 60, lon: 22}", PLACE, "", ("E004", "a place has no 'lon'; did you mean 'lng'?")),
        ("[1, 2]", DISTANCE, "", ("E013", "expected a distance, this is a list")),
        ("25:30", TIME, "", ("E016", "expected a time, got the text '25:30'")),
        ("2026-08-20", TIME, "", ("E013", "'2026-08-20' is a day, not a time")),
    ],
)
def test_values_that_do_not_fit_are_explained(text, expected, what, problem_):
    assert value_problem(text, expected, what=what) == problem_


def test_places_of_the_site_go_by_name(wording: Wording):
    scope = Scope(NAMES, site=SITE)
    assert value("camp", PLACE, scope).const == Place(30.0, -5.0)
    assert value("north", PLACE, scope).const == Place(0.0, 20.0)
    assert value("lake", REGION, scope).const == SITE.regions["lake"]
    assert good("site.ports.north", scope=scope).const == Place(0.0, 20.0)
    code, text = value_problem("cmp", PLACE, scope)
    assert code == "E010"
    wording(text)
    assert value_problem("camp", POSITION, scope)[0] == "E066"
    got = problem("site.places.cmp", scope=scope)
    assert got[:2] == ("E011", "cmp")
    wording(got[2])
    code, text = value_problem("p1", HWD, scope)
    assert code == "E013"
    wording(text)


def test_without_a_site_file_names_of_places_are_looked_up_at_run_time():
    env = FakeEnv(site={"places": {"camp": Place(1.0, 2.0)}, "ports": {}, "regions": {}})
    assert value("camp", PLACE).run(env) == Place(1.0, 2.0)
    assert good("site.places.camp").run(env) == Place(1.0, 2.0)
    with pytest.raises(EvalError):
        value("other", PLACE).run(env)


def test_degrees_become_metres_from_the_base():
    expr = value("{lat: 60.45, lng: 22.27}", PLACE, Scope(NAMES, site=SITE))
    assert expr.const == Place(0.0, 0.0)
    assert value("{lat: 1, lng: 2}", PLACE).run(FakeEnv()) == Place(2.0, 1.0)


def test_interpolation_shows_values_as_people_read_them(wording: Wording):
    env = FakeEnv(target=Place(100.0, 200.0), height=60.0, alarm="sos", drone=AgentRef("d1"), ok=True, n=3)
    expr = value('"Alarm ${alarm} at ${target}: ${height}, ${drone}, ${ok}, ${n}, ${30 %}"', TEXT)
    assert expr.type == TEXT
    wording(expr.run(env))
    assert expr.reads == tuple(Dependency(name) for name in ("alarm", "target", "height", "drone", "ok", "n"))


def test_agents_fit_the_types_that_their_own_extends():
    types = {"hwd": AgentType("hwd", Mark("a", 1, 1), extends=("machine",))}
    machine = Type("agent", of=("machine",))
    assert not fits(HWD, machine)
    good("drone", machine, Scope(NAMES, agent_types=types))
    assert problem("drone.type == 'hdw'", scope=Scope(NAMES, agent_types=types))[0] == "E014"


@pytest.mark.parametrize(
    ("have", "want", "result"),
    [
        (INT, NUMBER, True),
        (NUMBER, INT, False),
        (PLACE, POSITION, False),
        (enum_of("a"), TEXT, True),
        (TEXT, enum_of("a"), False),
        (enum_of("a"), enum_of("a", "b"), True),
        (enum_of("a", "c"), enum_of("a", "b"), False),
        (HWD, AGENT, True),
        (AGENT, HWD, False),
        (list_of(INT), list_of(NUMBER), True),
        (ANY, POSITION, True),
        (POSITION, ANY, True),
        (record_of(a=INT, b=TEXT), record_of(a=NUMBER), True),
        (record_of(a=INT), record_of(b=INT), False),
    ],
)
def test_fits(have, want, result):
    assert fits(have, want) is result


def test_limits_of_size(wording: Wording):
    wording(problem("1+" * 300 + "1")[2], problem("[" + "1," * 220 + "1]")[2])
    wording(problem("9007199254740993")[2])
    assert problem("-" * 499 + "1")[0] == "E009"


TOKENS = """60~m 5~s 30~% 3 2.5 'yes' true and or not in if else is_set above circle first sum min ( ) [ ] , . + - * / // < ==
    = battery ! ? : && % ** lambda range split lawnmower round 1e9 mod"""
words = st.sampled_from([*NAMES, *(token.replace("~", " ") for token in TOKENS.split())])


@settings(max_examples=600, deadline=2000)
@given(st.one_of(st.text(max_size=80), st.lists(words, max_size=14).map(" ".join)))
def test_compile_expr_never_raises_and_ends_in_a_value_or_a_controlled_error(text):
    expr, found = compiled(text)
    assert bool(found) == (expr.run.__name__ == "never")
    for one in found:
        assert one.mark.line == 1
        assert one.mark.col >= 1
    if not found and expr.is_const:
        expr.run(None)


@settings(max_examples=300, deadline=2000)
@given(st.one_of(st.text(max_size=60), st.lists(words, max_size=8).map(lambda ws: "${" + " ".join(ws) + "}")))
def test_compile_value_never_raises(text):
    for expected in (TEXT, DISTANCE, PLACE, POSITION, TIME, REGION, BOOL, INT, enum_of("a"), list_of(TEXT), HWD, ANY):
        compile_value(scalar(text), SCOPE, expected)
    compile_cond(scalar(text), SCOPE)
