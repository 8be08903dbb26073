"""Whole ways of talking about one machine: frames, joins, backwards order, radio, lists, purposes; tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_SINGLE: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "en": (
        ("{A}, {c}.", 0),
        ("Calling {a}: {c}.", 0),
        ("I want to see {a} {c}.", 0),
        ("Please ensure that {a} {c}.", 1),
        ("Please make sure {a} {c}.", 1),
        ("Kindly have {a} {c}.", 0),
        ("Would it be possible for {a} to {c}?", 0),
        ("Would you be so good as to have {a} {c}?", 0),
        ("My wish is that {a} {c}.", 1),
        ("Dear colleagues, {a} should please {c}.", 0),
        ("Job for {a} is to {c}.", 0),
        ("It is the turn of {a} to {c}.", 0),
        ("We task {a} to {c}.", 0),
        ("Requirement: {a} shall {c}.", 0),
        ("The plan is simple: {a} {c}.", 1),
        ("Watch, kids: {a} will {c}.", 0),
        ("{A} has to do following: {c}.", 0),
        ("I am wanting that {a} {c}.", 1),
        ("Need {a}. {C}.", 0),
        ("Send {a} out to {c}.", 0),
        ("{C} - that is the job of {a}.", 0),
        ("{C}: this is what {a} is there for.", 0),
        ("By means of {a}: {c}.", 0),
        ("Might I ask that {a} {c}?", 0),
        ("Action item: {a} to {c}.", 0),
        ("As discussed, {a} will {c}.", 0),
        ("Scenario: {a} {c}.", 1),
        ("For the demonstration {a} {c}.", 1),
        ("Hey {a}! {C}!", 0),
        ("It would oblige me if {a} were to {c}.", 0),
        ("{A} please to {c}.", 0),
        ("{A} gets this job: to {c}.", 0),
        ("What about {a}? It can {c}.", 0),
        ("Show me how {a} {c}.", 1),
        ("Tasking, {a}: {c}. Acknowledge.", 0),
        ("Somebody start {a}, it must {c}.", 0),
        ("There shall be {a} that {c}.", 1),
        ("Once more for everybody: {a} {c}.", 1),
        ("I have {a} for you, make it {c}.", 0),
        ("Your order, {a}: {c}.", 0),
        ("Please that {a} {c}.", 1),
        ("A flight for {a}, in which it has to {c}.", 0),
        ("Launch {a}, {c}.", 0),
        ("use {a} and {c}", 0),
    ),
    "es": (
        ("{A}: {c}.", 2),
        ("Quisiera ver cómo {a} {c}.", 0),
        ("Asegúrate de que {a} {c}.", 1),
        ("Le ruego que {a} {c}.", 1),
        ("¿Sería posible que {a} {c}?", 1),
        ("Tarea para {a}: {c}.", 2),
        ("El plan es sencillo: {a} {c}.", 0),
        ("Mirad, niños: {a} va a {c}.", 2),
        ("Hace falta que {a} {c}.", 1),
        ("Conviene que {a} {c}.", 1),
        ("Manda a {a} a {c}.", 2),
        ("A {a} le toca {c}.", 2),
        ("Según lo hablado, {a} ha de {c}.", 2),
        ("Me vendría bien que {a} {c}.", 1),
        ("{C}: eso es lo que tiene que hacer {a}.", 2),
        ("Con {a}: {c}.", 2),
        ("Para la demostración, {a} {c}.", 0),
        ("Oye, pon a {a} a {c}.", 2),
        ("Se solicita que {a} {c}.", 1),
        ("{A} por favor {c}.", 2),
    ),
}
"""For `parts.SINGLE`."""

MORE_JOINS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": (
        ("; then ", "; then "),
        (", next ", ", and last "),
        (", afterwards ", ", and as a last thing "),
        (" > ", " > "),
        (" / ", " / "),
        ("; next ", "; lastly "),
        (", and then ", ", and then "),
        (", when done ", ", when done "),
        (", thereafter ", " and thereupon "),
        (" + ", " + "),
        (" -> ", " -> "),
        (", so then ", ", so at last "),
        (", with that done ", ", and with all done "),
    ),
    "es": (
        ("; después ", "; después "),
        (", a continuación ", " y para terminar "),
        (" > ", " > "),
        (" / ", " / "),
        (", acto seguido ", " y ya después "),
        (", y luego ", ", y luego "),
        (" + ", " + "),
        (", hecho esto ", ", y hecho todo eso "),
    ),
}
"""For `parts.JOINS`."""

FRONT_JOINS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": ((", ", " and then "), (", then ", ", then "), ("; next ", "; next ")),
    "es": ((", ", " y luego "), (", luego ", ", luego "), ("; después ", "; después ")),
}
"""Between parts of which the last is not the end."""

BACKWARDS: Final[Mapping[str, tuple[tuple[str, int, int], ...]]] = {
    "en": (
        ("At the end {a} {e}; before that it {c}.", 1, 1),
        ("Before {a} {e}, it {c}.", 1, 1),
        ("At the end {a} shall {e}; before that it shall {c}.", 0, 0),
        ("Finally {a} is to {e}. First, however, it is to {c}.", 0, 0),
        ("The last thing for {a} is to {e}; what comes first is to {c}.", 0, 0),
        ("To {e} is what {a} does last; first it has to {c}.", 0, 0),
        ("The flight of {a} is over once it {e}; up to then it {c}.", 1, 1),
        ("In the end, {a} must {e}. But to begin with it must {c}.", 0, 0),
        ("{A} may {e} only when the rest is done. The rest is: {c}.", 0, 0),
        ("Have {a} {c} before it {e}.", 1, 0),
    ),
    "es": (
        ("Al final {a} {e}; antes {c}.", 0, 0),
        ("Antes de {e}, {a} {c}.", 2, 0),
        ("{A} tiene que {e} al final; primero tiene que {c}.", 2, 2),
        ("Lo último es que {a} {e}; antes quiero que {c}.", 1, 1),
        ("Por último, que {a} {e}. Pero primero que {c}.", 1, 1),
        ("{A} solo puede {e} cuando lo demás esté hecho, es decir: {c}.", 2, 2),
    ),
}
"""The end `{e}` said first; which form of the verbs it takes, and which form the parts before it, `{c}`, take."""

SENTENCES: Final[Mapping[str, tuple[tuple[str, str, str, int], ...]]] = {
    "en": (
        ("{A} {c}.", " Then it {c}.", " Finally it {c}.", 1),
        ("{A} {c}.", " After that it {c}.", " Last of all it {c}.", 1),
        ("{A} will {c}.", " It will then {c}.", " To finish, it will {c}.", 0),
        ("First {a} is to {c}.", " Next I want it to {c}.", " And now it can {c}.", 0),
        ("Step one for {a}: {c}.", " Next step: {c}.", " Last step: {c}.", 0),
        (
            "It begins with {a}. It must {c}.",
            " When that is done, it must {c}.",
            " With that behind it, it must {c}.",
            0,
        ),
        ("To start, have {a} {c}.", " That finished, have it {c}.", " At the very end have it {c}.", 0),
        ("{A} {c}.", " It {c}.", " It {c}.", 1),
    ),
    "es": (
        ("{A} {c}.", " Después {c}.", " Al final {c}.", 0),
        ("Primero, {a} tiene que {c}.", " Después tiene que {c}.", " Y por último tiene que {c}.", 2),
        ("Quiero que {a} {c}.", " Luego, que {c}.", " Y al terminar, que {c}.", 1),
        ("Paso inicial de {a}: {c}.", " Paso siguiente: {c}.", " Paso final: {c}.", 2),
    ),
}
"""A sentence for each part: the first, one in the middle, the last, and which form of the verbs."""

LISTS: Final[Both] = (
    ("{A}:", "Checklist for {a}:", "Job card, {a}:", "Programme of {a}:", "{A}, in this order:", "Flight plan, {a}:"),
    ("{A}:", "Lista para {a}:", "Programa de {a}:", "{A}, por este orden:", "Plan de vuelo, {a}:"),
)
"""Before parts that have numbers."""

CALLS: Final[Both] = (
    ("{A}.", "{A}, {a}.", "Calling {a}.", "{A}, new tasking.", "Tasking, {a}.", "{A}, copy the following."),
    ("{A}.", "Atención, {a}.", "Llamando a {a}.", "{A}, nueva tarea.", "{A}, anote."),
)
ENDS_CALL: Final[Both] = (
    (" Over.", " Out.", " How copy? Over.", " Acknowledge. Over.", "", " Over and out."),
    (" Cambio.", " Corto.", " Cambio y corto.", " Confirme recibido. Cambio.", ""),
)
"""How a message by radio begins and ends."""

RADIO: Final[Mapping[str, Both]] = {
    "over": (
        ("waypoint {p}, {h}", "overfly {p}, altitude {h}", "direct {p}, level {h}", "one pass {p}, {h}"),
        ("punto {p}, {h}", "sobrevuelo de {p}, altitud {h}", "directo a {p}, nivel {h}"),
    ),
    "over_plain": (
        ("waypoint {p}", "overfly {p}", "direct {p}", "one pass, {p}"),
        ("punto {p}", "sobrevuelo de {p}", "directo a {p}"),
    ),
    "watch": (
        (
            "station {p}, {h}, hold {t}",
            "holding {p}, altitude {h}, duration {t}",
            "hover {p}, {h}, {t}",
            "eyes on {p}, {t}, from {h}",
        ),
        (
            "espera sobre {p}, {h}, {t}",
            "estacionario en {p}, altitud {h}, duración {t}",
            "vista de {p}, {t}, desde {h}",
        ),
    ),
    "watch_plain": (
        ("station {p}, hold {t}", "holding {p}, duration {t}", "hover {p}, {t}", "eyes on {p}, {t}"),
        ("espera sobre {p}, {t}", "estacionario en {p}, duración {t}"),
    ),
    "land": (
        ("landing {p}", "touchdown {p}", "full stop {p}", "set down, {p}"),
        ("aterrizaje en {p}", "toma en {p}", "a tierra en {p}"),
    ),
    "stop": (
        (
            "landing {p}, {t} on ground",
            "touchdown {p}, ground time {t}",
            "ground stop {p}, {t}",
            "full stop {p}, wait {t} on deck",
        ),
        ("aterrizaje en {p}, {t} en tierra", "toma en {p}, tiempo en suelo {t}", "parada en tierra en {p}, {t}"),
    ),
    "ring": (
        (
            "one orbit {p}, radius {r}, altitude {h}",
            "three-sixty about {p}, range {r}, at {h}",
            "full circle, centre {p}, radius {r}, level {h}",
            "orbit {p}, {r} out, {h} up, one turn",
        ),
        (
            "una órbita a {p}, radio {r}, altitud {h}",
            "círculo completo, centro {p}, radio {r}, nivel {h}",
            "trescientos sesenta sobre {p}, a {r}, altura {h}",
        ),
    ),
    "ring_plain": (
        (
            "one orbit {p}, radius {r}",
            "three-sixty about {p}, range {r}",
            "full circle, centre {p}, radius {r}",
            "orbit {p}, {r} out, one turn",
            "circle {p}, distance {r}",
        ),
        ("una órbita a {p}, radio {r}", "círculo completo, centro {p}, radio {r}", "vuelta a {p}, a {r}"),
    ),
    "rings": (
        (
            "orbit {p} {n}, radius {r}, altitude {h}",
            "circle {n}, centre {p}, {r} out, {h} up",
            "{n} round {p}, {r}, at {h}",
        ),
        ("órbita a {p} {n}, radio {r}, altitud {h}", "círculo {n}, centro {p}, radio {r}, nivel {h}"),
    ),
    "zigzag": (
        (
            "zigzag {p} to {q}, {n} legs, {w} either side of track, altitude {h}",
            "from {p}: zigzag search to {q}, legs {n}, offset {w} each side, level {h}",
            "start {p}, finish {q}, {n} zigzag legs, {w} left and right of direct track, at {h}",
        ),
        (
            "zigzag de {p} a {q}, {n} tramos, {w} a cada lado, altitud {h}",
            "inicio {p}, final {q}, {n} tramos en zigzag, {w} a cada lado de la recta, altura {h}",
        ),
    ),
    "zigzag_plain": (
        (
            "zigzag {p} to {q}, {n} legs, {w} either side of track",
            "from {p}: zigzag search to {q}, legs {n}, offset {w} each side",
            "start {p}, finish {q}, {n} zigzag legs, {w} left and right of direct track",
        ),
        (
            "zigzag de {p} a {q}, {n} tramos, {w} a cada lado",
            "inicio {p}, final {q}, {n} tramos en zigzag, {w} a cada lado de la recta",
        ),
    ),
    "line": (
        ("straight track {p} to {q}, {n} points, altitude {h}", "line {p} - {q}, {n} waypoints, at {h}"),
        ("línea recta de {p} a {q}, {n} puntos, altitud {h}",),
    ),
    "line_plain": (
        ("straight track {p} to {q}, {n} points", "line {p} - {q}, {n} waypoints"),
        ("línea recta de {p} a {q}, {n} puntos",),
    ),
    "corners": (
        (
            "right triangle, right angle {p}, legs {r}, altitude {h}",
            "triangle pattern, right angle at {p}, sides {r}, at {h}",
        ),
        ("triángulo rectángulo, ángulo recto en {p}, catetos {r}, altitud {h}",),
    ),
    "corners_plain": (
        ("right triangle, right angle {p}, legs {r}", "triangle pattern, right angle at {p}, catheti {r}"),
        ("triángulo rectángulo, ángulo recto en {p}, catetos {r}",),
    ),
    "explore": (
        ("area search {k}, altitude {h}", "search {k}, all of it, {h}"),
        ("búsqueda en toda la zona de {k}, altitud {h}",),
    ),
    "explore_plain": (("area search {k}", "search {k}, all of it"), ("búsqueda en toda la zona de {k}",)),
    "tour": (
        ("waypoints {ps}, {h}, hold {t} at each", "stations {ps}, {t} each, altitude {h}"),
        ("puntos {ps}, {h}, espera de {t} en cada uno", "paradas en el aire en {ps}, {t} en cada una, altitud {h}"),
    ),
    "tour_plain": (
        ("waypoints {ps}, hold {t} at each", "stations {ps}, {t} each"),
        ("puntos {ps}, espera de {t} en cada uno",),
    ),
    "pass": (("route {ps}, level {h}, no stops",), ("ruta {ps}, nivel {h}, sin paradas",)),
    "pass_plain": (("route {ps}, no stops", "via {ps}, no holding"), ("ruta {ps}, sin paradas",)),
    "home": (
        ("RTB", "home", "return to own port", "recover home port", "back home"),
        ("regreso a casa", "vuelta a su puerto", "a casa"),
    ),
    "home_own": (
        ("recover own port", "return to port of departure", "back to own port"),
        ("regreso a su propio puerto", "vuelta al puerto de salida"),
    ),
    "recentre": (
        ("inbound to centre of circle", "back overhead {p}", "one more pass {p}", "centre point again"),
        ("regreso al centro del círculo", "otra pasada sobre {p}", "de nuevo sobre {p}"),
    ),
    "land_end": (
        ("landing on arrival", "touchdown at end of track", "full stop {p}", "land at last point, {p}"),
        ("aterrizaje al llegar", "toma en {p}, final del recorrido", "a tierra en {p}"),
    ),
    "aside_land": (
        ("landing {g} {side} of {p}", "touchdown offset {g} {side} of {p}"),
        ("aterrizaje {g} al {side} de {p}", "toma {g} al {side} de {p}"),
    ),
    "stay": (("landing on the spot", "touchdown right there"), ("aterrizaje en el sitio", "toma allí mismo")),
    "wait": (("hold {t}", "wait {t}"), ("espera de {t}", "pausa de {t}")),
}
"""Parts as people say them by radio."""

PURPOSES: Final[Both] = (
    (
        "We have lost a dog.",
        "It is for a course in geometry.",
        "My uncle wants pictures.",
        "The wind is fine today.",
        "This is a rehearsal.",
        "The mayor is visiting us, so no mistakes please.",
        "Somebody has heard a strange noise.",
        "There was a storm last night.",
        "I can't find my keys.",
        "The children love it.",
        "It is for the insurance.",
        "The sheep have run away again.",
        "We are making a film about our life here.",
        "Thank you kindly.",
        "That is all.",
        "Sorry for my English.",
        "We are in a hurry.",
        "Take your time.",
        "Good morning!",
        "A neighbour has complained about wild boars.",
        "I promised it to my daughter.",
        "The students must write a report on it.",
        "The client is waiting for this.",
        "We look for a missing person.",
        "The irrigation is leaking somewhere.",
        "It smells of smoke here.",
        "Nothing dangerous, only a check.",
        "The weather holds.",
        "We did the same last week and it was fine.",
        "It is important to me.",
        "As always on Mondays.",
        "I have forgotten my phone out there.",
        "The guests will take photos.",
        "Some fool has cut the wire.",
        "I hope this is clear.",
        "Please don't ask me why.",
    ),
    (
        "Hemos perdido un perro.",
        "Es para una clase de geometría.",
        "Mi tío quiere fotos.",
        "Hoy el viento es bueno.",
        "Es un ensayo.",
        "Anoche hubo tormenta.",
        "Alguien ha oído un ruido raro.",
        "Se han escapado otra vez las ovejas.",
        "Es para el seguro.",
        "A los niños les encanta.",
        "No encuentro mis llaves.",
        "Huele a humo.",
        "Buenos días.",
        "Muchas gracias.",
        "Tenemos prisa.",
        "Se lo prometí a mi hija.",
        "Estamos rodando una película.",
        "Eso es todo.",
    ),
)
"""Sentences beside a request that name nothing of the site, no person and no figure: they change nothing."""
