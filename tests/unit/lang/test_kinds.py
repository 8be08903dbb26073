"""The one table of kinds and options, and the synonyms that point into it."""

from types import MappingProxyType

import pytest

from formiga_bt.lang.kinds import KINDS, LIBRARY, MODIFIERS, PARAM, RETRY, ROLE, SUBTREE, TASK
from formiga_bt.lang.steps.step import _CLASSES, _READERS
from formiga_bt.lang.text.synonyms import KEY_SYNONYMS, KIND_SYNONYMS, action_for, key_for, kind_for, nearest


def test_the_table_has_every_kind_of_the_language() -> None:
    words = (
        "do ask call request wait wait_until wait_for check set notify fail release sequence fallback parallel race if switch "
        "while repeat for break_if guard with_agents with_resource"
    )

    assert list(KINDS) == words.split()


def test_every_kind_can_be_read() -> None:
    assert set(KINDS) == set(_READERS) == set(_CLASSES)


@pytest.mark.parametrize("options", [MODIFIERS, RETRY, PARAM, ROLE, SUBTREE, TASK, LIBRARY])
def test_keys_are_unique_and_explained(options: tuple) -> None:
    assert len({option.name for option in options}) == len(options)
    assert all(option.doc.endswith((".", ").")) for option in options)


def test_options_do_not_hide_modifiers() -> None:
    modifiers = {option.name for option in MODIFIERS}

    assert not [k.name for k in KINDS.values() if modifiers & {option.name for option in k.options}]


def test_synonyms_name_kinds_and_options_that_exist() -> None:
    options = {o.name for k in KINDS.values() for o in k.options} | {o.name for o in (*MODIFIERS, *TASK)}

    assert set(KIND_SYNONYMS.values()) <= set(KINDS)
    assert not set(KIND_SYNONYMS) & set(KINDS)
    assert set(KEY_SYNONYMS.values()) <= options


DRONE = MappingProxyType({"TakeOff": "airborne", "GoTo": "moves", "LandIn": "grounded", "Explore": ""})


class TestActionSlips:
    @pytest.mark.parametrize(
        ("slip", "meant"),
        [
            ("Takeoff", "TakeOff"),
            ("take_off", "TakeOff"),
            ("Land", "LandIn"),
            ("MoveTo", "GoTo"),
            ("FlyTo", "GoTo"),
            ("goto", "GoTo"),
            ("Explor", "Explore"),
            ("Dance", ""),
        ],
    )
    def test_a_slip_is_mended(self, slip: str, meant: str) -> None:
        assert action_for(slip, DRONE) == meant

    def test_two_candidates_are_not_guessed_between(self) -> None:
        assert action_for("Land", {**DRONE, "Perch": "grounded"}) == ""


def test_keys_and_kinds_are_guessed() -> None:
    assert key_for("args", ["with", "save_as"]) == "with"
    assert key_for("args", ["steps"]) == ""
    assert kind_for("Fallback", KINDS) == "fallback"
    assert nearest("wathcers", ["watchers", "pickers"]) == "watchers"
