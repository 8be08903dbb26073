"""How many kinds of people say machines that wait for each other or fly by turns: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_CASES: Final[Mapping[str, Both]] = {
    "meet": (
        (
            (
                "I want to see {a} standing over {p} and {b} over {q}, both at {h}. When the last of them "
                "has arrived, {c}."
            ),
            "{A} to {p}, {b} to {q}, {h} each. Rendezvous: whoever is first holds for the other. Then {c}.",
            "{A} takes station over {p}, {b} over {q}, altitude {h}. Once both report on station, {c}.",
            "Stations: {a} over {p}, {b} over {q}. Height {h} for both. Both on station: {c}.",
            "At {h}, {p} is for {a} and {q} is for {b}. Only with the two in position {c}.",
            "{P} gets {a}, {q} gets {b}, in a height of {h}. They wait the one for the other, and then {c}.",
            "Please ensure that {a} is over {p} and {b} over {q}, {h} up, at the same time. Thereafter {c}.",
            "Could you bring {a} above {p} and {b} above {q} ({h})? Nobody goes on alone: when both have come, {c}.",
            (
                "{A} hovers {h} above {p}; simultaneously {b} hovers {h} above {q}. The slower one sets the "
                "pace; then {c}."
            ),
            "Before {c}, both must be in place: {a} over {p}, {b} over {q}, {h} up.",
            "{A} flies out to {p} and {b} out to {q}, {h} high. On completion by both, {c}.",
            "Two posts are to be manned at {h}: {p} by {a}, {q} by {b}. As soon as no post is empty, {c}.",
            "Synchronise: {a} over {p} at {h}, {b} over {q} at {h}. After the arrival of both {c}.",
            "Like two chessmen: {a} on {p}, {b} on {q}, {h} in the air. Both stand? Then {c}.",
            "{A}: {p}. {B}: {q}. Each {h} up, simultaneous departure; when the second of the two has got there {c}.",
        ),
        (
            "Quiero ver {a} sobre {p} y {b} sobre {q}, a {h}. Cuando haya llegado el último, {c}.",
            "{A} toma posición sobre {p} y {b} sobre {q}, altura {h}. Con los dos en su sitio, {c}.",
            "Puestos a {h}: {p} para {a}, {q} para {b}. Se espera al más lento; luego {c}.",
            "{A}: {p}. {B}: {q}. Altura {h}. Nadie sigue solo: con los dos allí, {c}.",
            "A {h}, {a} va sobre {p} y {b} sobre {q}, a la vez. Una vez que estén ambos, {c}.",
            "Antes de seguir, {a} debe estar sobre {p} y {b} sobre {q}, a {h}. Entonces {c}.",
        ),
    ),
    "then_home": (
        (
            "both RTB",
            "the two of them go back to where they came from",
            "each returns to its own port",
            "home with the two of them",
            "they both make for home",
            "the pair flies back",
            "each one goes back to its starting place",
        ),
        ("los dos retornan a su base", "cada uno vuelve a su puerto", "la pareja regresa a casa"),
    ),
    "then_land": (
        (
            "both come straight down",
            "each sets down right below itself",
            "the two touch down underneath their positions",
            "both make a full stop landing on the spot",
            "each one goes to ground exactly there",
            "both land below where they hover",
            "they descend to the ground, each at its place",
        ),
        (
            "cada uno baja en vertical y aterriza",
            "los dos se posan justo debajo",
            "ambos bajan al suelo, cada cual en su punto",
        ),
    ),
    "swap": (
        (
            "they change places with each other at the same height and then return home",
            "each flies over to the post of the other, and after that home",
            "they trade positions and then RTB",
            "the two exchange their places, then each goes back to its port",
            "each one takes over the place of its partner and goes home from there",
            "they cross over, the one to where the other was, and then fly home",
        ),
        (
            "cada uno va al puesto del otro y después a casa",
            "intercambian las posiciones y regresan a su puerto",
            "se cruzan, cada uno al lugar del otro, y luego vuelven a casa",
        ),
    ),
}

MORE_RELAY: Final[Mapping[str, Both]] = {
    "same": (
        (
            "{A} {c}. After its full stop at home, {b} flies an identical sortie.",
            "Two sorties, the same, in sequence. {A} {c}. Then, with the first one down, so does {b}.",
            "{A} {c}. Its relief, {b}, leaves when it is home and copies everything.",
            "What is wanted twice: {c}. Once by {a}, and when this one is back at its port, once by {b}.",
            "{B} is to do what {a} did before it, but only with the latter back home. {A} {c}.",
            "{A} {c}. On its return {b} takes off and follows the very same programme.",
            "I'd like {a} to go first and {b} to go second, never together. Each of the two {c}.",
            "{A} {c}. Home? Then the same once more with {b}.",
            "Relay: {a}, then {b}. Program for each: it {c}. Changeover at home.",
            "{A} {c}. Please ensure that {b} performs the identical task as soon as the first is on its port again.",
            "{A} {c}. When it has arrived to home, also {b} makes the same.",
            "Like children at a slide, one at a time: first {a}, then {b}. Each {c}.",
            "Ditto for {b} after {a} has come home. {A} {c}.",
        ),
        (
            "{A} {c}. De vuelta el primero, {b} repite la misma salida.",
            "Dos salidas iguales, una tras otra. {A} {c}. Cuando está en casa, {b} hace igual.",
            "Por relevos: primero {a}, luego {b}, nunca juntos. Cada uno {c}.",
            "{B} hará lo mismo que {a}, pero solo cuando este haya regresado. {A} {c}.",
            "{A} {c}. ¿Ya en casa? Entonces lo mismo con {b}.",
            "{A} {c}. A su regreso despega {b} con idéntico programa.",
        ),
    ),
    "turns": (
        (
            "Shift work for {a} and {b}: the one {c}, and when it is home the other does the same. {N} this way, each.",
            "{A} and {b} alternate, {n} each, with only one in the air. Whoever's turn it is {c}.",
            "{N}: {a} {c}; then, after it is home, {b} does the same.",
            "Repeat {n} the following cycle. {A} {c}. Back home, it is relieved by {b}, which does likewise.",
            (
                "A relay of {a} and {b}, {n} over: the one {c}; the next leaves only when that one is home, "
                "for the same task."
            ),
            "Like a seesaw: {a} {c}, then {b} the same when the first is down, {n} for each of them.",
            "Two machines in rotation, {a} then {b}. A turn means: the machine {c}. {N} per machine, no overlap.",
            "{A} {c}. Then {b}, likewise. Then again from the start, so that each has gone {n}.",
            (
                "Please ensure that {a} and {b} take turns, each flying {n}. Every time the active one {c}, "
                "the other waits at home."
            ),
        ),
        (
            "Turnos de {a} y {b}, {n} cada uno, solo uno en el aire: el que vuela {c}.",
            "{N}: {a} {c} y, una vez en casa, {b} hace lo mismo.",
            "Repite {n} este ciclo: {a} {c}; después {b} hace igual.",
            "Por relevos {a} y {b}: cada vez uno {c} y el otro aguarda en casa; {n} cada uno.",
        ),
    ),
    "after_yes": (
        (
            "{A} {c}. Back home with it, query to {u}: can it be said that {x}? Affirmative: {b} {d}.",
            (
                "Part one: {a} {c}. Then a checkpoint: {u} has to sign off that {x}. Part two, only with the "
                "signature: {b} {d}."
            ),
            "{A} {c}. Get a thumbs up from {u} that {x}; given that, {b} {d}.",
            "{B} {d}, though only if {u}, asked after the first flight, agrees that {x}. The first flight: {a} {c}.",
            "{A} {c}. After it has returned, clearance from {u} is required ({x}). With the clearance {b} {d}.",
            "{A} {c}; next, would {u} kindly say whether {x}? If so, {b} {d}.",
            (
                "{A} {c}. Green light for the second flight comes from {u}, who must confirm that {x}. In "
                "the second flight {b} {d}."
            ),
            "{A} {c}. Then we ask to {u} if {x}, and in case of yes {b} {d}.",
            'Flight 1: {a} {c}. Gate: {u} says yes to "{x}". Flight 2: {b} {d}.',
            "{A} {c}. A nod of {u} that {x}, and {b} {d}.",
            "First flight, {a}: it {c}. It is followed, subject to the agreement of {u} that {x}, by {b}, which {d}.",
        ),
        (
            "{A} {c}. De vuelta en casa, consulta a {u}: ¿es cierto que {x}? Afirmativo: {b} {d}.",
            "Vuelo 1: {a} {c}. Después hace falta el visto bueno de {u}: {x}. Con él, vuelo 2: {b} {d}.",
            "{A} {c}. Si después {u} da luz verde ({x}), {b} {d}.",
            "{B} {d} solo si {u}, tras el primer vuelo, dice que {x}. Primer vuelo: {a} {c}.",
            "{A} {c}. Luego se pide a {u} que confirme que {x}; de ser así, {b} {d}.",
        ),
    ),
    "on_no": (
        (
            " Negative: the second one is not sent.",
            " On a refusal the mission is over.",
            " Without it, no second flight.",
            " Should the answer be no, we leave it at that.",
            " No yes, no second take-off.",
        ),
        (" Negativo: no hay segundo vuelo.", " En caso de negativa, se acabó.", " Sin ese sí, el segundo no despega."),
    ),
}
