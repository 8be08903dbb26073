"""How people say parts without a height, and parts that speak of what was said before: tables only, as in `phrases`."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

PLAIN: Final[Mapping[str, Both]] = {
    "watch_plain": (
        (
            "[hover|hovers] for {t} over {p}",
            "[watch|watches] {p} for {t}",
            "[go|goes] to {p} and [wait|waits] above it for {t}",
            "[keep|keeps] {p} in view for {t}",
            "[stay|stays] over {p} during {t}",
        ),
        (
            "[se queda|se quede|quedarse] {t} sobre {p}",
            "[vigila|vigile|vigilar] {p} durante {t}",
            "[va|vaya|ir] a {p} y [espera|espere|esperar] {t} en el aire",
        ),
    ),
    "ring_plain": (
        (
            "[fly|flies] a circle of {r} about {p}",
            "[circle|circles] round {p} at a distance of {r}",
            "[do|does] one lap of {p} with a radius of {r}",
            "[orbit|orbits] {p} once, {r} away from it",
            "[fly|flies] a circular path with radius {r} centred on {p}",
            "[make|makes] a complete turn about {p}, always {r} from it",
            "[patrol|patrols] on a ring of {r} round {p}",
            "[trace|traces] a {r} circle around {p}",
        ),
        (
            "[da|dé|dar] una vuelta a {p} con un radio de {r}",
            "[vuela|vuele|volar] en círculo a {r} de {p}",
            "[rodea|rodee|rodear] {p} a {r} de distancia",
            "[describe|describa|describir] un círculo de {r} de radio con centro en {p}",
        ),
    ),
    "zigzag_plain": (
        (
            "[fly|flies] in a zigzag from {p} to {q}, {n} legs, {w} to each side",
            "[zigzag|zigzags] between {p} and {q}: {n} legs, {w} off the line",
            "[go|goes] from {p} to {q} in {n} zigzag legs with a swing of {w}",
            "[weave|weaves] from {p} towards {q} in {n} legs of a zigzag, each turn {w} out",
            "[cover|covers] the way from {p} to {q} by a zigzag of amplitude {w} and {n} legs",
        ),
        (
            "[vuela|vuele|volar] en zigzag de {p} a {q}: {n} tramos, {w} a cada lado",
            "[va|vaya|ir] de {p} a {q} en {n} tramos de zigzag con una amplitud de {w}",
            "[zigzaguea|zigzaguee|zigzaguear] desde {p} hasta {q}, {n} tramos, {w} de desvío",
        ),
    ),
    "line_plain": (
        (
            "[fly|flies] straight from {p} to {q} in {n} steps",
            "[follow|follows] the line between {p} and {q} over {n} points",
            "[check|checks] {n} points along the way from {p} to {q}",
        ),
        (
            "[vuela|vuele|volar] en línea recta de {p} a {q} en {n} puntos",
            "[revisa|revise|revisar] {n} puntos entre {p} y {q}",
        ),
    ),
    "corners_plain": (
        (
            "[fly|flies] over the corners of a right-angled triangle, legs {r}, at {p}",
            "[trace|traces] a right-angled triangle at {p}, legs {r} long",
        ),
        ("[pasa|pase|pasar] por las esquinas de un triángulo rectángulo de catetos de {r} en {p}",),
    ),
    "explore_plain": (
        (
            "[explore|explores] {k}",
            "[search|searches] all of {k}",
            "[scan|scans] {k}",
            "[survey|surveys] the area {k}",
            "[comb|combs] {k} for anything unusual",
        ),
        (
            "[explora|explore|explorar] {k}",
            "[peina|peine|peinar] {k}",
            "[rastrea|rastree|rastrear] toda la zona de {k}",
        ),
    ),
    "tour_plain": (
        (
            "[visit|visits] {ps}, {t} at each of them",
            "[check|checks] {ps} in this order and [stay|stays] {t} at each",
            "[do|does] a round of {ps} with {t} per place",
        ),
        ("[visita|visite|visitar] {ps}, {t} en cada uno", "[hace|haga|hacer] una ronda por {ps}, {t} en cada sitio"),
    ),
    "pass_plain": (
        (
            "[fly|flies] past {ps}",
            "[go|goes] over {ps} without a stop",
            "[take|takes] the route over {ps}",
            "[pass|passes] over {ps} in turn",
        ),
        ("[sobrevuela|sobrevuele|sobrevolar] {ps}", "[sigue|siga|seguir] la ruta por {ps}"),
    ),
    "recentre": (
        (
            "[go|goes] back over the middle of the circle",
            "[go|goes] back to the middle",
            "[come|comes] back to the centre point",
            "[move|moves] in to the centre",
            "[cross|crosses] the centre of the ring",
            "[return|returns] to the centre of it",
            "[pass|passes] over {p} once more",
            "[finish|finishes] over the middle",
            "[fly|flies] to the centre point again",
            "[end|ends] up above {p}",
        ),
        (
            "[vuelve|vuelva|volver] sobre el centro del círculo",
            "[pasa|pase|pasar] otra vez sobre {p}",
            "[termina|termine|terminar] encima del centro",
        ),
    ),
    "land_end": (
        (
            "[land|lands] there",
            "[land|lands] where that ends",
            "[set|sets] down at the far end",
            "[land|lands] on arrival",
            "[touch|touches] down at its destination",
            "[finish|finishes] on the ground at {p}",
        ),
        (
            "[aterriza|aterrice|aterrizar] al llegar",
            "[aterriza|aterrice|aterrizar] donde termina",
            "[se posa|se pose|posarse] al final, en {p}",
        ),
    ),
    "aside_land": (
        (
            "[land|lands] {g} {side} of {p}",
            "[set|sets] down {g} {side} of {p}",
            "[come|comes] down on the ground {g} to the {side} of {p}",
        ),
        ("[aterriza|aterrice|aterrizar] {g} al {side} de {p}", "[se posa|se pose|posarse] {g} al {side} de {p}"),
    ),
}
PLAIN_PLANS: Final[Mapping[str, str]] = {
    "watch_plain": "hovers over {p} for {t}",
    "ring_plain": "flies a circle of {r} round {p}",
    "zigzag_plain": "flies a zigzag from {p} to {q}",
    "line_plain": "flies a line from {p} to {q}",
    "corners_plain": "flies a triangle at {p}",
    "explore_plain": "explores {k}",
    "tour_plain": "visits {ps} and waits {t} at each",
    "pass_plain": "flies along {ps}",
    "recentre": "flies back over {p}",
    "land_end": "lands at {p}, where that ends",
    "aside_land": "lands {g} {side} of {p}",
}
"""What stands in `plan`."""

FORMATION: Final[Mapping[str, Both]] = {
    "line": (
        (
            "{N} {ms} line up from {p} to {q} at {h}{c}",
            "spread {n} {ms} evenly between {p} and {q}, {h} up{c}",
            "{n} {ms} hover in a row that reaches from {p} to {q} ({h}){c}",
            "position {n} {ms} along the line from {p} to {q} at {h}{c}",
        ),
        (
            "{n} {ms} se colocan en línea de {p} a {q} a {h}{c}",
            "reparte {n} {ms} entre {p} y {q}, a {h}{c}",
        ),
    ),
    "row": (
        (
            "{N} {ms} hover side by side at {p}, {g} from one to the next, {h} high{c}",
            "put {n} {ms} in a row at {p} with gaps of {g}, at {h}{c}",
            "{n} {ms} stand in the air at {p}, each {g} from its neighbour, {h} up{c}",
        ),
        (
            "{n} {ms} flotan en fila en {p}, a {g} uno de otro, a {h}{c}",
            "pon {n} {ms} en fila en {p} con {g} entre ellos, a {h}{c}",
        ),
    ),
    "each": (
        (
            "send {n} {ms}, one each to {ps}, at {h}{c}",
            "{N} {ms} go to {ps}, one to every place, {h} high{c}",
            "one of {n} {ms} hovers over each of {ps} at {h}{c}",
        ),
        ("{n} {ms} van a {ps}, uno a cada sitio, a {h}{c}", "envía {n} {ms}, uno a cada lugar: {ps}, a {h}{c}"),
    ),
    "ring": (
        (
            "{N} {ms} take up positions round {p}, {r} from it, {h} up{c}",
            "surround {p} with {n} {ms} at a distance of {r}, {h} high{c}",
            "{n} {ms} form a ring of radius {r} about {p} at {h}{c}",
        ),
        ("{n} {ms} rodean {p} a {r} de distancia y {h} de altura{c}",),
    ),
    "triangle": (
        (
            "{N} {ms} hold the corners of a right-angled triangle at {p}, legs {r}, {h} up{c}",
            "form a triangle in the air with {n} {ms}: right angle over {p}, {r} along both legs, {h} high{c}",
            "{n} {ms} hover as a right triangle of {r} by {p} at {h}{c}",
        ),
        ("{n} {ms} forman un triángulo rectángulo en {p} con catetos de {r}, a {h}{c}",),
    ),
}
"""Several machines that do the same; `{c}` is what they do then."""
FORMATION_THEN: Final[Mapping[str, Both]] = {
    "wait_home": (
        (", wait {t} and go home.", "; after {t} all return.", ". They hold that for {t}, then all of them fly home."),
        (", esperan {t} y vuelven a casa.", "; pasados {t} regresan todos."),
    ),
    "home": ((" and come home.", ", then they all return.", ". Then home with them."), (" y vuelven a casa.",)),
    "ask_home": (
        (". When {u} says that {x}, they come home.", "; once {u} has confirmed that {x} all of them return."),
        (". Cuando {u} confirme que {x}, vuelven a casa.",),
    ),
    "wait_land": (
        (
            ", hold for {t}, and land where they are.",
            "; after {t} each comes down on its spot.",
            ". {T} later they all land there.",
        ),
        (", esperan {t} y aterrizan allí mismo.",),
    ),
    "ask_land": (
        (". As soon as {u} says that {x}, all land on the spot.", "; with the word of {u} that {x} they land there."),
        (". Cuando {u} diga que {x}, aterrizan donde están.",),
    ),
    "tell_land": (
        ('; then they report "{y}" and set down where they hover.', '. Everybody is told "{y}", and they land below.'),
        ('; avisan "{y}" y aterrizan donde están.',),
    ),
}
PARTING: Final[Mapping[str, Both]] = {
    "parting": (
        (
            "{A} {d1} and {b} {d2}. When {u} has confirmed that {x}, {e1}; {e2}.",
            "{A} {d1}, {b} {d2}. Then ask {u} whether {x}; with a yes {e1}, and {e2}.",
            "At the same time {a} {d1} and {b} {d2}. Both wait until {u} says that {x}. After that {e1} while {e2}.",
            "{A} {d1}; {b} {d2}. They stay until {u} confirms that {x}; afterwards {e1} and {e2}.",
        ),
        (
            "{A} {d1} y {b} {d2}. Cuando {u} confirme que {x}, {e1} y {e2}.",
            "{A} {d1}; {b} {d2}. Pregunta a {u} si {x}; si dice que sí, {e1} y {e2}.",
        ),
    ),
    "parting_timed": (
        (
            "{A} {d1} and {b} {d2}. {T} later {e1}, and {e2}.",
            "{A} {d1}, {b} {d2}; both wait there for {t}, then {e1} and {e2}.",
            "{A} {d1} and {b} {d2}. They stay for {t}. Then {e1} while {e2}.",
        ),
        ("{A} {d1} y {b} {d2}. Pasados {t}, {e1} y {e2}.", "{A} {d1}; {b} {d2}; esperan {t} y luego {e1} y {e2}."),
    ),
    "one": (
        ("the first one {c}", "the first of them {c}", "one of them {c}", "the former {c}"),
        ("el primero {c}", "uno de ellos {c}"),
    ),
    "other": (
        ("the second one {c}", "the other {c}", "the other one {c}", "the latter {c}"),
        ("el segundo {c}", "el otro {c}"),
    ),
    "apart": (
        (
            "{A} and {b} {land} at {p}, {g} apart.",
            "{A} and {b} {land} at {p} with {g} between them.",
            "{A} and {b} fly to {p} and {land} {g} from each other.",
        ),
        ("{A} y {b} {land} en {p}, a {g} uno de otro.",),
    ),
    "apart_two": (
        (
            "{N} {ms} {land} at {p}, {g} apart.",
            "Send {n} {ms} to {p}; they {land} there {g} from each other.",
            "A pair of {ms} goes to {p}: both {land}, {g} between them.",
            "{N} {ms} are to {land} side by side at {p} with a gap of {g}.",
        ),
        ("{N} {ms} {land} en {p}, a {g} uno de otro.", "Envía {n} {ms} a {p}: {land} a {g} uno de otro."),
    ),
    "pair": (
        ("{N} {ms}: one {d1}, the other {d2}.", "{N} {ms} start together; one {d1} and the other one {d2}."),
        ("{N} {ms}: uno {d1}, el otro {d2}.",),
    ),
    "after_ask": (
        (
            " Once {u} says that {x}, {e1}; {e2}.",
            " {U} is asked if {x}. On a yes {e1} and {e2}.",
            " As soon as {u} has confirmed that {x}, {e1}, {e2}.",
        ),
        (" Cuando {u} confirme que {x}, {e1} y {e2}.",),
    ),
    "after_time": ((" {T} later {e1}; {e2}.", " After {t} {e1} and {e2}."), (" Pasados {t}, {e1} y {e2}.",)),
}
"""Two machines that come together, wait for something, and part."""
