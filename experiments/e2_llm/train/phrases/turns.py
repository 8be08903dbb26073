"""How people say machines in turn, machines that park side by side, and terse rounds: tables only, as in `phrases`."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

RELAY: Final[Mapping[str, Both]] = {
    "same": (
        (
            "{A} {c}. Once it is home, {b} does the same.",
            "{A} {c}; when it has landed, {b} does likewise.",
            "First {a}, then {b}, only one flying at a time: each of them {c}.",
            "{A} {c}. {B} repeats all that as soon as the first is back at its port.",
            "One after the other {a} and {b} have the same job, the second only when the first is down: each {c}.",
            "{A} {c}. Not before it is on the ground at home, {b} flies just the same.",
        ),
        (
            "{A} {c}. Cuando esté en casa, {b} hace lo mismo.",
            "{A} {c}; en cuanto aterrice, {b} hace exactamente lo mismo.",
            "Primero {a} y después {b}, de uno en uno: cada cual {c}.",
            "{A} {c}. {B} lo repite cuando el primero haya vuelto.",
        ),
    ),
    "turns": (
        (
            "{A} and {b} by turns, {n} each: one {c} while the other stays at its port.",
            "{A} and {b} relieve each other: each {c} before the other one starts. All that {n}.",
            "Turn by turn, {a} and {b}: each {c}; only one flies at a time; {n} each.",
            "{A} {c}, then {b} takes over and does the same; that cycle {n}.",
        ),
        (
            "{A} y {b} por turnos, {n} cada uno: uno {c} y el otro espera en su puerto.",
            "Por turnos, {a} y {b}: cada uno {c}; uno sale cuando el otro está en casa. Todo eso {n}.",
        ),
    ),
    "after_yes": (
        (
            "{A} {c}. When it is home, ask {u} whether {x}; only after a yes {b} {d}.",
            "{A} {c}. Then {u} must confirm that {x}, and only then {b} {d}.",
            "First {a} {c}. Afterwards {b} waits for the word of {u} that {x}; then it {d}.",
            "{A} {c}. With a yes of {u} to the question if {x}, {b} starts and {d}.",
        ),
        (
            "{A} {c}. Cuando esté en casa, pregunta a {u} si {x}; solo con un sí, {b} {d}.",
            "{A} {c}. Después {u} debe confirmar que {x}, y solo entonces {b} {d}.",
        ),
    ),
    "on_no": (
        (" On a no it stays at its port.", " Otherwise the second one does not fly.", " If not, that is all."),
        (" Con un no se queda en su puerto.", " Si no, el segundo no vuela.", " Si no, eso es todo."),
    ),
}
"""One machine after the other."""

PARKED: Final[Mapping[str, Both]] = {
    "two": (
        (
            "{A} and {b} land at {p}, {g} apart, and stay there{e}.",
            "{A} and {b} set down side by side at {p} with {g} between them{e}.",
            "Park {a} and {b} on the ground at {p}, {g} from each other{e}.",
            "Bring {a} and {b} down at {p}, {g} apart{e}.",
        ),
        (
            "{A} y {b} se quedan en tierra en {p}, a {g} uno de otro{e}.",
            "Deja {a} y {b} en tierra en {p}, a {g} uno de otro{e}.",
        ),
    ),
    "more": (
        (
            "{N} {ms} land side by side at {p}, {g} apart, and stay there{e}.",
            "Park {n} {ms} in a row on the ground at {p}, {g} apart{e}.",
            "{N} {ms} end their flight on the ground at {p}, {g} from each other{e}.",
            "Put {n} {ms} down at {p} with {g} between them{e}.",
        ),
        (
            "{N} {ms} aterrizan en fila en {p} con {g} entre ellos{e}.",
            "Deja {n} {ms} en tierra en {p}, a {g} uno de otro{e}.",
        ),
    ),
    "good": (
        ("", "", ", for good", "; they are not to come home", "; there they remain"),
        ("", "", "; no vuelven a casa", "; allí se quedan"),
    ),
    "home": (
        (" for {t}; then they come home", ", {t} long, and home after that", " for {t} and fly home"),
        (" durante {t} y luego vuelven a casa", ", {t}, y después a casa"),
    ),
    "ask_home": (
        (" until {u} confirms that {x}; then they come home", " till {u} says that {x}, then home"),
        (" hasta que {u} confirme que {x}, y entonces vuelven a casa",),
    ),
}
"""Machines that land some metres from each other, for good or not: `{e}`."""

ROUNDS: Final[Mapping[str, Both]] = {
    "stops_pass": (
        (
            "{A}: {ps}, in that order, {h} up, no stops, home.",
            "Route of {a}: {ps}. {H} up all the way, then home.",
            "{Ps} without a pause, {a}, {h} high; home.",
        ),
        ("{A}: {ps}, en ese orden, a {h}, sin paradas, y a casa.", "Ruta de {a}: {ps}. Siempre a {h}; luego a casa."),
    ),
    "stops_ground": (
        (
            "{A} touches down at each of these, in this order, {t} on the ground: {ps}. Then home.",
            "Landings of {a}: {ps}; {t} on the ground at each, then home.",
            "{Ps}: {a} lands at each for {t}, one after the other; home.",
        ),
        (
            "Aterrizajes de {a}: {ps}; {t} en tierra en cada uno, y a casa.",
            "{A} aterriza {t} en cada uno, en este orden: {ps}. Luego a casa.",
        ),
    ),
    "stops_ring": (
        (
            "{A} circles each of these in that order, {r} out, {h} up: {ps}. Then home.",
            "{Ps}: one lap of {r} round each with {a}, {h} high; home.",
            "Laps for {a}: {ps}. Radius {r}, height {h} everywhere, home.",
        ),
        (
            "Vueltas de {a}: {ps}. Radio {r}, altura {h} en todas, y a casa.",
            "{A} da una vuelta de {r} de radio a cada uno, a {h}: {ps}. Luego a casa.",
        ),
    ),
    "stops_two": (
        (
            "Both at once, {h} up, {t} per stop, home at the end. {A}: {ps}. {B}: {qs}.",
            "{A}: {ps}; {b}: {qs}; at the same time, in the order given, {h}, {t} each, home.",
            "Two rounds in parallel, {h} high, {t} at each stop, then home: {a} {ps}; {b} {qs}.",
        ),
        (
            "{A}: {ps}; {b}: {qs}; a la vez, por ese orden, a {h}, {t} en cada uno, y a casa.",
            "Dos rondas en paralelo, a {h}, {t} por parada, y a casa. {A}: {ps}. {B}: {qs}.",
        ),
    ),
    "there_back": (
        (
            "{A}: from {p} to {q} and back, {n}, at {h}, then home.",
            "{N} from {p} to {q} and back with {a}, {h} up; home afterwards.",
            "Starting at {p}, {a} flies to {q} and back {n}, {h} high, and then home.",
            "{A}, {h}: {p}, then {n} over to {q} and back again; home.",
        ),
        (
            "{A}: de {p} a {q} y vuelta, {n}, a {h}, y luego a casa.",
            "{N} de {p} a {q} y vuelta con {a}, a {h}; después a casa.",
        ),
    ),
    "there_back_ground": (
        (
            "{A}: from {p} to {q} and back, {n}, with a landing of {t} at every end, then home.",
            "{A} lands at {p}, then {n} goes to {q} and back, on the ground for {t} each time; home at the end.",
        ),
        ("{A} aterriza en {p} y va {n} a {q} y vuelta, {t} en tierra cada vez; luego a casa.",),
    ),
    "periodic": (
        (
            "{P} every {e}, {n} in all: {a}, {h} up, {t} there, home in between.",
            "Every {e} {a} flies to {p} at {h}, waits {t} and goes home; {n} in total.",
            "{N}, at intervals of {e}, {a} checks {p} from {h} for {t} and returns home.",
            "{A}: {p}, {h}, {t}, home; the same every {e}, {n} altogether.",
            "{A} does this {n}, once every {e}: out to {p}, {h} high, {t} of hovering, home.",
        ),
        (
            "{P} cada {e}, {n} en total: {a}, a {h}, {t} allí y a casa.",
            "Cada {e} {a} vuela a {p} a {h}, espera {t} y vuelve a casa; {n} en total.",
            "{A} hace esto {n}, cada {e}: {p}, a {h}, {t}, a casa.",
        ),
    ),
}
"""Terse rounds: places in an order, there and back, every so often."""
