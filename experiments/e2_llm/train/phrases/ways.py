"""How people say the end of a flight, and answers that decide: tables only, as in `phrases`."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

ENDINGS: Final[Mapping[str, Both]] = {
    "home_own": (
        (
            "[finish|finishes] at its own port",
            "[land|lands] where it started",
            "[return|returns] to its own place",
            "[end|ends] at the port it came from",
            "[go|goes] back to its starting point",
            "[put|puts] down on its own port",
            "[fly|flies] back to where it took off",
        ),
        (
            "[termina|termine|terminar] en su propio puerto",
            "[vuelve|vuelva|volver] al punto de donde salió",
            "[regresa|regrese|regresar] a su sitio",
            "[aterriza|aterrice|aterrizar] donde despegó",
        ),
    ),
    "leave": (
        (
            "[land|lands] at {p} and [stay|stays] there",
            "[set|sets] down at {p} for good",
            "[park|parks] on the ground at {p}",
            "[end|ends] its flight on the ground at {p}",
            "[land|lands] at {p} and [remain|remains] on that spot",
            "[come|comes] down at {p} and [do|does] not fly on",
        ),
        (
            "[aterriza|aterrice|aterrizar] en {p} y [se queda|se quede|quedarse] allí",
            "[se posa|se pose|posarse] en {p} y ya no [se mueve|se mueva|moverse]",
            "[termina|termine|terminar] el vuelo en tierra, en {p}",
            "[toma|tome|tomar] tierra en {p} y no [sigue|siga|seguir]",
        ),
    ),
    "leave_aside": (
        (
            "[set|sets] down {g} {side} of {p} for good",
            "[land|lands] {g} {side} of {p} and [stay|stays] there",
            "[end|ends] on the ground {g} to the {side} of {p}",
        ),
        (
            "[aterriza|aterrice|aterrizar] {g} al {side} de {p} y [se queda|se quede|quedarse] allí",
            "[termina|termine|terminar] en tierra {g} al {side} de {p}",
        ),
    ),
}
"""Ends of a flight, one of which is home."""
ENDING_PLANS: Final[Mapping[str, str]] = {
    "home_own": "returns",
    "leave": "lands at {p} and stays there",
    "leave_aside": "lands {g} {side} of {p} and stays there",
}

NOT_HOME: Final[Both] = (
    ("It does not come home.", "No way back.", "It is left there.", "It need not return.", "That is where it stays."),
    ("No vuelve a casa.", "Se queda allí.", "No hace falta que vuelva."),
)
"""Said behind a landing for good, now and then."""

NOTHING: Final[Both] = (
    (
        "it stays at its port",
        "nobody flies",
        "nothing takes off",
        "it stays where it is",
        "nothing happens",
        "it does not take off at all",
        "everything stays on the ground",
    ),
    ("se queda en su puerto", "no vuela nadie", "no despega nada", "se queda donde está", "no pasa nada"),
)
ONLY_IF: Final[Mapping[str, Both]] = {
    "asked": (
        (
            "{U} is asked if {x}. Only with a yes {a}; otherwise {z}.",
            "Ask {u} whether {x}, and only if so {a}. If not, {z}.",
            "{A}, but only if {u} confirms that {x}. Otherwise {z}.",
            "Only if {u} says that {x}, {a}; else {z}.",
            "{A} on condition that {u} agrees that {x}; without that {z}.",
            "It is for {u} to say whether {x}. Yes: {a}. No: {z}.",
            "Unless {u} says that {x}, {z}; with a yes {a}.",
        ),
        (
            "Pregunta a {u} si {x}. Solo con un sí {a}; si no, {z}.",
            "{A}, pero solo si {u} confirma que {x}. Si no, {z}.",
            "Solo si {u} dice que {x}, {a}; de lo contrario {z}.",
            "Que decida {u} si {x}. Sí: {a}. No: {z}.",
        ),
    ),
    "charge": (
        (
            "Only with more than {b} of charge {a}; otherwise {z}.",
            "If its battery is above {b}, {a}. If not, {z}.",
            "{A} if more than {b} is left in its battery; else {z}.",
            "Check the charge of {m} first: over {b} {a}, below that {z}.",
        ),
        (
            "Solo con más del {b} de batería {a}; si no, {z}.",
            "Si le queda más del {b} de carga, {a}; de lo contrario {z}.",
            "{A} si tiene más del {b} de batería. Si no, {z}.",
        ),
    ),
}
"""A condition whose other case is that nothing happens: `{z}`."""

EITHER: Final[Mapping[str, Both]] = {
    "place": (
        (
            "Ask {u} if {x}: on a yes {a} flies to {p}, on a no to {q}.",
            "If {u} says that {x}, {a} goes to {p}, if not, to {q}.",
            "{A} flies to {p} if {u} confirms that {x}, otherwise to {q}.",
            "{U} decides where {a} goes: {p} if {x}, else {q}.",
            "{U} is asked whether {x}. Yes means {p}, no means {q}, and {a} goes there.",
            "Where {a} goes depends on {u}: if {x}, {p}; if not, {q}.",
        ),
        (
            "Pregunta a {u} si {x}: si dice que sí, {a} va a {p}; si dice que no, a {q}.",
            "Si {u} confirma que {x}, {a} vuela a {p}; si no, a {q}.",
            "{U} decide adónde va {a}: a {p} si {x}, si no a {q}.",
        ),
    ),
    "who": (
        (
            "Ask {u} if {x}. On a yes {a} flies to {p}, on a no {b} does.",
            "If {u} says that {x}, {a} goes to {p}; if not, {b} goes there.",
            "{A} flies to {p} if {u} confirms that {x}, otherwise {b} does.",
            "{U} says whether {x}: with a yes {p} is for {a}, with a no for {b}.",
        ),
        (
            "Pregunta a {u} si {x}. Con un sí va {a} a {p}, con un no va {b}.",
            "Si {u} dice que {x}, {a} vuela a {p}; si no, vuela {b}.",
        ),
    ),
    "home": (
        (
            " {H} up, and home in both cases.",
            " Always at {h}, and home afterwards.",
            " The height is {h} for either, and home at the end.",
            " Both at {h}; then home.",
        ),
        (" A {h}, y a casa en los dos casos.", " Siempre a {h}; después a casa."),
    ),
    "ring_home": (
        (
            " Circle there at {r}, {h} up, and home in either case.",
            " A lap of {r} radius at {h}, then home whichever it is.",
            " {H} up, once round it {r} out, home: the same for both.",
        ),
        (
            " Una vuelta de {r} de radio a {h}, y a casa en ambos casos.",
            " A {h}, un círculo de {r}, y a casa en cualquier caso.",
        ),
    ),
    "wait": (
        (
            " {H} up, {t} there, then it lands on the spot.",
            " In both cases {h} high for {t}, and down to the ground there.",
        ),
        (" A {h}, {t} allí, y aterriza en el sitio.", " En ambos casos a {h} durante {t}, y allí toma tierra."),
    ),
    "ground_home": (
        (
            " It lands there, stays {t} on the ground and comes home in either case.",
            " A landing of {t} there, and home whichever it is.",
            " Touch down, {t} on the ground, home: the same for both.",
        ),
        (" Toma tierra allí, {t} de parada, y a casa en ambos casos.",),
    ),
    "ground": (
        (
            " It lands there and stays, whichever it is.",
            " In both cases it sets down there and does not come back.",
            " It is left on the ground there.",
        ),
        (" Aterriza y se queda allí en ambos casos.", " En los dos casos toma tierra allí y no vuelve."),
    ),
}
"""An answer decides between two places or two machines; what is the same for both is said once, behind it."""
