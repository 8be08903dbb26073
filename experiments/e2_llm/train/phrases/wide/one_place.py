"""How people say two machines that work at one place: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

PLAIN_INTRO: Final[Mapping[str, tuple[str, ...]]] = {
    "en": ("Two {ms}", "A pair of {ms}", "Two of the {ms}"),
    "es": ("Dos {ms}", "Una pareja de {ms}"),
}
"""Of machines in turn: nothing in it says that they fly together."""

SAME_PLACE: Final[tuple[tuple[str, ...], tuple[str, ...]]] = (
    (
        "the same place",
        "this place",
        "that spot",
        "the same point",
        "that very place",
        "the same spot",
        "that place",
        "this point",
        "the place just named",
        "this very spot",
        "the said place",
    ),
    ("el mismo sitio", "ese lugar", "ese punto", "el mismo punto", "ese mismo sitio", "dicho lugar"),
)
"""A place that was named before."""

ONE_PLACE: Final[Mapping[str, Both]] = {
    "named": (
        (
            "{A} {c}, and at the same time {b} {d}.",
            "{A} {c}. Meanwhile {b} {d}.",
            "{A} {c}; {b} {d}. Both at once.",
        ),
        ("{A} {c} y al mismo tiempo {b} {d}.", "{A} {c}. Mientras tanto {b} {d}."),
        (
            "{A} {c}. While that goes on, {b} {d}.",
            "{A} {c} as {b} {d}.",
            "While {a} {c}, {b} {d}.",
            "{A} {c}. {B}, which needn't wait for it, {d}.",
            "Simultaneous departure of two: {a} {c}; {b} {d}.",
            "{A} {c}. An escort starts together with it: {b} {d}.",
            "{A} {c}, with {b} as a guard, which in the meantime {d}.",
            "{A} {c}. As its lookout, starting in the same moment, {b} {d}.",
            "Principal: {a}. It {c}. Escort: {b}. It {d}. No waiting for each other.",
            "Would you have two machines working at one place? {A} {c}, {b} {d}, both at one time.",
            "{A} {c}. During it {b} {d}.",
            "{A} {c}; independently of this and in parallel {b} {d}.",
            "Please ensure that {a} {c} and that, concurrently, {b} {d}.",
            "Two roles, one time. The worker, {a}, {c}. The guard, {b}, {d}.",
            "{A} {c}. All this while, {b} {d}.",
        ),
        (
            "{A} {c}. Mientras dura eso, {b} {d}.",
            "Mientras {a} {c}, {b} {d}.",
            "Salida simultánea: {a} {c}; {b} {d}.",
            "{A} {c}. {B}, de escolta y sin esperar, {d}.",
            "{A} {c} y, en paralelo, {b} {d}.",
            "{A} {c}. Como guardia, a la vez, {b} {d}.",
        ),
    ),
    "place_first": (
        (
            "The place is {p}. {A} {c}, while {b} {d}.",
            "Both have work at {p}, at the same time. {A} {c}. {B} {d}.",
        ),
        ("El lugar es {p}. {A} {c}, mientras {b} {d}.", "Los dos trabajan en {p}, a la vez. {A} {c}. {B} {d}."),
        (
            "Location: {p}. Two at once. {A} {c}. {B} {d}.",
            "It is all about {p}: {a} {c}, and in the same moment {b} {d}.",
            "Target for both machines, {p}. {A} {c}; {b} {d}; simultaneously.",
            "I have lost something near {p}, so let us work there with two at a time: {a} {c} and {b} {d}.",
            "Do you know {p}? While {a} {c}, {b} {d}.",
            "Place of action {p}, two machines in parallel. {A} {c}. {B} {d}.",
            "Regarding {p}: {a} {c}. Meanwhile, and without waiting, {b} {d}.",
            "One point for two, {p}. {A} {c}, {b} {d}, with a common start.",
            "Two drones are needed for {p} at the same time. {A} {c}; {b} {d}.",
        ),
        (
            "Lugar: {p}. Dos a la vez. {A} {c}. {B} {d}.",
            "Se trata de {p}: {a} {c} y, al mismo tiempo, {b} {d}.",
            "Objetivo de los dos, {p}. Mientras {a} {c}, {b} {d}.",
            "Sobre {p}: {a} {c}. Entretanto, {b} {d}.",
        ),
    ),
}
"""Two machines at one place; the place is named before or in the first job."""
