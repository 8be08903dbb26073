"""How many kinds of people say two machines that come together and part: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_PARTING: Final[Mapping[str, Both]] = {
    "parting": (
        (
            "{A} {d1}, and simultaneously {b} {d2}. Query to {u}: is it so that {x}? Affirmative: {e1}; {e2}.",
            (
                "Simultaneous departure: {a} {d1}; {b} {d2}. Hold for the clearance of {u} ({x}). With the "
                "clearance {e1} and, in parallel, {e2}."
            ),
            "{A} {d1} while {b} {d2}. If {u} then agrees that {x}, {e1} as {e2}.",
            "{A} {d1}; in the same moment {b} {d2}. Given a nod from {u} that {x}, {e1}, {e2}.",
            (
                "{A} {d1} and {b} {d2}, together. What comes next needs a sign-off from {u}, namely that "
                "{x}: {e1}, and {e2}."
            ),
            "After {a} {d1} and {b} {d2}, would you ask {u} whether {x}? If so, {e1}; {e2}.",
            (
                "{A} {d1}. {B} {d2}. Both go at one time. Green light comes from {u} who must say that {x}. "
                "Then {e1}, {e2}."
            ),
            "{A} {d1}; {b} {d2}; with both there, {u} is kindly asked to confirm that {x}. On the yes {e1} while {e2}.",
            (
                "{E1} and {e2}, but only with the thumbs up of {u} that {x}, and only after this: {a} {d1} "
                "and, at the same time, {b} {d2}."
            ),
            'Phase 1: {a} {d1}, {b} {d2}. Gate: "{x}", says {u}. Phase 2: {e1}, {e2}.',
            (
                "{A} {d1}, meanwhile {b} {d2}. The two then wait on permission from {u}, which is given by "
                "saying that {x}. Afterwards {e1} and {e2}."
            ),
        ),
        (
            "{A} {d1} y, a la vez, {b} {d2}. Consulta a {u}: ¿es cierto que {x}? Afirmativo: {e1}; {e2}.",
            "Salida simultánea: {a} {d1}; {b} {d2}. Con el permiso de {u} ({x}), {e1} y {e2}.",
            "Mientras {a} {d1}, {b} {d2}. Si luego {u} da el visto bueno ({x}), {e1}; {e2}.",
            "{A} {d1} y {b} {d2}. Luz verde de {u}, que dirá que {x}; entonces {e1} y {e2}.",
            "Fase 1: {a} {d1}, {b} {d2}. Fase 2, cuando {u} esté de acuerdo en que {x}: {e1}, {e2}.",
        ),
    ),
    "parting_timed": (
        (
            "{A} {d1}, and simultaneously {b} {d2}. Hold {t}. Then {e1}; {e2}.",
            (
                "Simultaneous departure: {a} {d1}; {b} {d2}. When the last has arrived, let {t} go by. After "
                "it {e1} as {e2}."
            ),
            "{T} after {a} {d1} and {b} {d2}, {e1} and {e2}.",
            "{A} {d1} while {b} {d2}. With both there, count {t}; then they part: {e1}, {e2}.",
            "Phase 1: {a} {d1}, {b} {d2}. Pause: {t}. Phase 2: {e1}, {e2}.",
            "{A} {d1}; in the same moment {b} {d2}; a common break of {t} follows. Next {e1} and, in parallel, {e2}.",
            "Once {a} {d1} and {b} {d2}, nothing happens for {t}. Thereafter {e1}, {e2}.",
        ),
        (
            "{A} {d1} y, a la vez, {b} {d2}. Pausa de {t}. Luego {e1}; {e2}.",
            "Mientras {a} {d1}, {b} {d2}. Con los dos allí, {t} de espera; entonces {e1} y {e2}.",
            "Fase 1: {a} {d1}, {b} {d2}. Pausa: {t}. Fase 2: {e1}, {e2}.",
        ),
    ),
    "apart": (
        (
            "{P}, two at once: {a} and {b} {land} with a gap of {g}.",
            "{A} and {b} go to {p} together, {land}, and leave {g} of room between them.",
            "At {p} {a} and {b} {land}; distance from one to the other {g}.",
            "{A} goes to {p} together with {b}; there they {land}, separated by {g}.",
            "Spacing {g}, place {p}: {a} and {b} {land} side by side.",
            "{A} and {b} fly in pair until {p} and {land} in {g} one from the other.",
            "Would you have {a} and {b} {land} at {p}, keeping {g} clear between the two.",
            "Neighbours at {p}, {g} away from each other: there {a} and {b} {land}.",
        ),
        (
            "{A} y {b} van juntos a {p} y {land} dejando {g} entre los dos.",
            "En {p}, {a} y {b} {land}, separados {g}.",
            "Separación {g}, lugar {p}: {a} y {b} {land} uno junto al otro.",
            "{A} y {b} {land} a la vez en {p}; del uno al otro hay {g}.",
        ),
    ),
    "apart_two": (
        (
            "{N} {ms}, {p}: they {land} with a gap of {g}.",
            "A pair of {ms} goes to {p}. There they {land}, leaving {g} of room between them.",
            "{N} {ms} out to {p} together, to {land} {g} from one to the other.",
            "Spacing {g}, place {p}: {n} {ms} {land} side by side.",
            "{N} {ms} are wanted at {p}, where they {land} like neighbours with {g} in between.",
            "At {p} I want {n} {ms} that {land} at one time, separated by {g}.",
            "Formation of two, both {ms}: {land} at {p}, lateral separation {g}.",
            "{N} {ms} {land} at {p}; measured from the one to the other it is {g}.",
            "Please ensure that {n} {ms} {land} simultaneously at {p} and that {g} remain free between them.",
            "{N} {ms} {land} beside each other at {p}, interval {g}.",
            "Could {n} {ms} {land} at {p} in a distance of {g} the one of the other?",
            "Twins at {p}: {n} {ms} {land}, and they keep {g} off each other.",
            "{P} has room for two: {n} {ms} {land} there, {g} between number one and number two.",
            "{N} {ms} {land} next to each other at {p}. The gap is {g}.",
            "{N} {ms}, simultaneous departure, destination {p}. They {land} {g} from each other.",
            "{N} {ms} share {p}: they {land} there, {g} of clear room from one to the other.",
            "Let {n} {ms} {land} at {p}. From the first to the second, {g}.",
            "{N} {ms} {land} at {p} not on the same spot but {g} from each other.",
            "We need a double at {p}: {n} {ms} {land}, an offset of {g} between the two.",
            "Two spots at {p}, {g} from each other, one for either of {n} {ms}, where they {land}.",
        ),
        (
            "{N} {ms}, {p}: {land} con {g} de separación.",
            "Una pareja de {ms} va a {p}; allí {land} y dejan {g} entre ambos.",
            "Separación {g}, lugar {p}: {n} {ms} {land} uno al lado del otro.",
            "Quiero {n} {ms} juntos en {p}: {land}, y del uno al otro hay {g}.",
            "En {p} {land} {n} {ms} a la vez, separados {g}.",
            "{N} {ms} salen juntos hacia {p} y {land} como vecinos, con {g} en medio.",
        ),
    ),
    "pair": (
        (
            "A pair of {ms}, both off at one time: {l} {d1}, {k} {d2}.",
            "{N} {ms}. {L} {d1}. In the same moment {k} {d2}.",
            "{N} {ms} split up. {L} {d1}, {k} {d2}.",
            "Simultaneous departure of {n} {ms}: while {l} {d1}, {k} {d2}.",
            "I need {n} {ms}. {L} {d1}; {k} {d2}.",
            "{N} {ms} in parallel. {L} {d1}. {K} {d2}.",
            "Out of {n} {ms}, {l} {d1}, and at the same time {k} {d2}.",
            "{N} {ms} go out together and wait for each other there. {L}: {d1}. {K}: {d2}.",
            "Crew of {n}, both {ms}; {l} {d1}, whereas {k} {d2}.",
        ),
        (
            "Una pareja de {ms} sale a la vez: {l} {d1}, {k} {d2}.",
            "{N} {ms}. {L} {d1}. En el mismo momento {k} {d2}.",
            "{N} {ms} en paralelo. {L} {d1}; {k} {d2}.",
            "Salen juntos {n} {ms}: {l} {d1}, {k} {d2}.",
        ),
    ),
    "after_ask": (
        (
            " Query to {u}: is it the case that {x}? Affirmative: {e1}; {e2}.",
            " Then it is up to {u}. Given that {u} agrees that {x}, {e1} and at the same time {e2}.",
            " Clearance from {u} is needed ({x}). With the clearance {e1} and {e2}.",
            " With a nod from {u} that {x}, {e1} while {e2}.",
            " Nothing more until {u} gives the thumbs up that {x}. After that {e1}, {e2}.",
            " {U} must sign off that {x}; that signed, {e1} as {e2}.",
            " Would {u} be so kind as to say whether {x}? If so, {e1}, {e2}.",
            " Then both wait for a green light: {u} saying that {x}. Green: {e1}; {e2}.",
            (
                " They hold for the permission of {u}, who has to state that {x}. Permission granted, {e1}, "
                "meanwhile {e2}."
            ),
            " Should {u}, being asked, answer that {x}, {e1} and {e2}.",
            " We ask to {u} if {x}, and in case of yes {e1} and {e2}.",
            " {E1}, and {e2}, but not before a confirmation by {u} that {x}.",
            " Next step on the word of {u} only: {x}, yes? Then {e1} and {e2}.",
            " Check with {u} that {x}. Confirmed: {e1}, {e2}.",
            " {U} has the last word on whether {x}. A yes means that {e1} and {e2}.",
            " Both remain until {u} has reported that {x}. Upon this {e1}, while {e2}.",
            " Subject to the agreement of {u} that {x}, {e1}, and {e2}.",
            " Provided that {u} says yes to the question if {x}, {e1} whereas {e2}.",
            " Roger from {u} that {x}? {E1}, {e2}.",
            " As they stand there, {u} is consulted on whether {x}. With an okay, {e1}, and in parallel {e2}.",
        ),
        (
            " Consulta a {u}: ¿es cierto que {x}? Afirmativo: {e1}; {e2}.",
            " Luego decide {u}: si está de acuerdo en que {x}, {e1} y a la vez {e2}.",
            " Con el visto bueno de {u} ({x}), {e1} mientras {e2}.",
            " Hace falta el permiso de {u}, que ha de decir que {x}. Con él, {e1}, {e2}.",
            " Luz verde de {u}: {x}. Entonces {e1} y {e2}.",
            " {E1} y {e2}, pero no antes de que {u} confirme que {x}.",
        ),
    ),
    "after_time": (
        (
            " They hold for {t}. Then {e1} while {e2}.",
            " A break of {t} for both. After it {e1}, and in parallel {e2}.",
            " Count {t} from the arrival of the last; then {e1} as {e2}.",
            " Both first spend {t} there; only then {e1} and {e2}.",
            " Time on station {t}. Thereafter {e1}; meanwhile {e2}.",
            " Nothing for {t}. Next {e1}, {e2}.",
            " When {t} are over, they part: {e1}, {e2}.",
        ),
        (
            " Se quedan así {t}. Luego {e1} mientras {e2}.",
            " Pausa de {t} para los dos; después {e1} y, en paralelo, {e2}.",
            " Los dos pasan antes {t} allí; solo después {e1} y {e2}.",
            " Cuando hayan pasado {t} se separan: {e1}, {e2}.",
        ),
    ),
}
WHO_PARTS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": (
        ("number one", "number two"),
        ("No. 1", "No. 2"),
        ("the first", "the second"),
        ("the lead", "the wing"),
        ("lead", "its wingman"),
        ("drone A", "drone B"),
        ("drone 1", "drone 2"),
        ("Alpha", "Bravo"),
        ("unit 1", "unit 2"),
        ("the former", "the latter"),
        ("the one", "its partner"),
        ("one of the two", "the remaining one"),
        ("one drone", "the other drone"),
        ("the first machine", "its neighbour"),
        ("the one", "the other"),
    ),
    "es": (
        ("el número uno", "el número dos"),
        ("el primero", "el segundo"),
        ("el dron A", "el dron B"),
        ("el dron 1", "el dron 2"),
        ("uno", "su compañero"),
        ("uno de los dos", "el otro"),
        ("la unidad 1", "la unidad 2"),
    ),
}
"""Names of two machines that part."""
STAYS: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "does not move",
        "keeps its place",
        "stays behind",
        "remains on that spot",
        "holds",
        "stays put",
        "has nothing more to do and remains there",
    ),
    "es": ("no se mueve", "se queda allí", "permanece en su sitio", "sigue donde está"),
}
COMES_DOWN: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "sets down at {p}",
        "touches down at {p}",
        "goes to {p} and lands",
        "makes a full stop landing at {p}",
        "takes to the ground at {p}",
        "settles on the ground at {p}",
    ),
    "es": ("se posa en {p}", "toma tierra en {p}", "va a {p} y aterriza"),
}
TAKES_STATION: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "takes station over {p} at {h}",
        "hovers over {p}, {h} up",
        "stands in the air above {p}, {h} high",
        "goes up to {h} over {p}",
        "holds position at {p}, altitude {h}",
        "places itself {h} above {p}",
    ),
    "es": ("toma posición sobre {p} a {h}", "flota sobre {p}, altura {h}", "se coloca a {h} por encima de {p}"),
}
LAND_BOTH: Final[Mapping[str, tuple[str, ...]]] = {
    "en": ("land", "set down", "touch down", "come down on the ground", "settle on the ground", "go to ground"),
    "es": ("aterrizan", "se posan", "toman tierra"),
}
HOVER_BOTH: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "hover ({h} high)",
        "hover {h} up",
        "hold position in the air ({h})",
        "take station {h} above ground",
        "stand still in the air at {h}",
    ),
    "es": ("flotan a {h}", "se mantienen en el aire a {h}", "toman posición a {h} de altura"),
}
