"""How many kinds of people say missions of two and three machines: tables only, as in `phrases`.

`A` and `B` are a machine with what it does, in the third person. Where machines have names first and jobs then,
`{l}` and `{k}` are these names, `{c}` and `{d}` the jobs.
"""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_TWO: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "While {a}, {b}.",
        "{A}. While that goes on, {b}.",
        "{A}; in the same moment {b}.",
        "{A}. During it {b}.",
        "Simultaneous departure: {a}; {b}.",
        "{A}. {B}. Neither has to wait for the other.",
        "{A}. {B}. They start together.",
        "Two things happen at one time: {a}, and {b}.",
        "Make sure that {a} and that, concurrently, {b}.",
        "I would like two things done at the same time. {A}. {B}.",
        "Would it be possible that {a} and, all the while, {b}?",
        "Task 1: {a}. Task 2: {b}. Run both tasks concurrently.",
        "{A}. No coordination required, in parallel {b}.",
        "{A}. All this while {b}.",
        "With two machines in the air together: {a}; {b}.",
        "{A}. {B}. Same departure time for both.",
        "{A} and in the same time {b}.",
        "I'd be grateful if you saw to it that {a}. As it does so, {b}.",
        "Joint departure. {A}. {B}. No need that one waits for the other.",
        "Left hand: {a}. Right hand: {b}. Both hands work together.",
        "(1) {a}; (2) {b}. Start (1) and (2) together.",
        "{A}; alongside, {b}.",
        "We go with two. {A}. And don't wait for that: {b}.",
        "Please ensure that both activities run in parallel: {a} | {b}.",
        "So that we save time: {a} and, at once, {b}.",
        "{A}. Independently of this, and from the same minute on, {b}.",
        "Both lift off together. {A}, {b}.",
        "Each minds its own business at the same time: {a}, {b}.",
        "A double mission, side by side: {a}; {b}.",
        "{A}. In tandem with it {b}.",
        "{A}. The second crew is not idle: {b}, starting together with the first.",
        "Two machines, two jobs, one starting time. {A}. {B}.",
        "Listen, two of them at once! {A}! {B}!",
        "Be so kind as to arrange the following two flights for the same hour: {a}, and {b}.",
        "Would you mind if {a} and, simultaneously, {b}?",
        "{A}. Over the same time {b}.",
        "Thread one: {a}. Thread two: {b}. No synchronisation.",
        "One does this and the other does that, together: {a}; {b}.",
        "Split the team. {A}. {B}. In parallel.",
        "{A} at the very time when {b}.",
        "Today's plan has two lines, both from the first minute on. {A}. {B}.",
        "{A}. In one go with this, {b}.",
    ),
    "es": (
        "Mientras {a}, {b}.",
        "{A}. Mientras dura eso, {b}.",
        "{A}; en el mismo momento {b}.",
        "Salida simultánea: {a}; {b}.",
        "{A}. {B}. Ninguno tiene que esperar al otro.",
        "Tarea 1: {a}. Tarea 2: {b}. Las dos a la vez.",
        "Dos cosas al mismo tiempo: {a}, y {b}.",
        "{A}. Entretanto {b}.",
        "{A}. {B}. Los dos empiezan juntos.",
        "Despegan juntos: {a} y {b}.",
        "Sin esperar a nadie: {a}; en paralelo, {b}.",
        "{A} y, simultáneamente, {b}.",
        "Hilo 1: {a}. Hilo 2: {b}. Sin sincronizar, a la vez.",
        "Por favor, dos vuelos a la misma hora: {a}, y {b}.",
        "{A} justo al tiempo que {b}.",
        "Equipo dividido. {A}. {B}. En paralelo.",
    ),
}
MORE_THREE: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "Simultaneous departure of three machines: {a}; {b}; {d}.",
        "Three jobs, one start. No. 1: {a}. No. 2: {b}. No. 3: {d}.",
        "{A}. While that goes on {b}; and also at the same time {d}.",
        "{A}. {B}. {D}. None of the three waits for the others.",
        "(1) {a}; (2) {b}; (3) {d}. Start all three together.",
        "Please ensure that three things run in parallel: {a} | {b} | {d}.",
        "Three crews in the air together. {A}. {B}. {D}.",
        "While {a}, {b}, and {d}.",
        "Could we have three things going on at one time? {A}, {b}, {d}.",
        "{A}, {b} and in the same time {d}.",
        "Task A: {a}. Task B: {b}. Task C: {d}. All tasks run concurrently.",
        "In the same moment: {a}, {b}, {d}.",
        "All three lift off together. {A}. {B}. {D}.",
    ),
    "es": (
        "Salida simultánea de tres: {a}; {b}; {d}.",
        "{A}. {B}. {D}. Ninguno espera a los demás.",
        "Tres tareas al mismo tiempo. 1: {a}. 2: {b}. 3: {d}.",
        "Mientras {a}, {b}, y {d}.",
        "Despegan los tres juntos: {a}; {b}; {d}.",
        "{A}; en el mismo momento {b} y {d}.",
    ),
}
MORE_TURNS: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "{B}, but not before this is over: {a}.",
        "Only one is in the air at a time. {A}. Then {b}.",
        "{A}. That being done, {b}.",
        "In sequence, never together: {a}, and after it is down {b}.",
        "Leg one: {a}. Leg two, when leg one is over: {b}.",
        "Start with this: {a}. Next in line: {b}.",
        "{B}. Before that, however, {a}.",
        "{A}. The second does not start until the first is home: {b}.",
        "Like a relay race: {a}; with the baton handed on, {b}.",
        "Before {b}, {a}.",
        "{A}. {B}, and that strictly afterwards.",
        "No overlap please: {a}. Thereafter {b}.",
        "1) {a}. 2) {b}. Step 2 waits for step 1.",
        "After {a}, and not sooner, {b}.",
        "{A}; on its return {b}.",
        "{A}. When it has come back, it is the turn of the next: {b}.",
        "{B}, last. First of all {a}.",
    ),
    "es": (
        "{A}. Una vez de vuelta, {b}.",
        "De uno en uno, nunca juntos: {a}; después {b}.",
        "{B}, pero antes {a}.",
        "Paso 1: {a}. Paso 2, acabado el primero: {b}.",
        "Después de que {a}, y no antes, {b}.",
        "{A}. A continuación, cuando esté en casa, {b}.",
        "Como en un relevo: {a}; luego {b}.",
    ),
}

LABELS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": (
        ("number one", "number two"),
        ("No. 1", "No. 2"),
        ("the first", "the second"),
        ("the one", "its partner"),
        ("the lead", "the wing"),
        ("lead", "wingman"),
        ("drone A", "drone B"),
        ("drone 1", "drone 2"),
        ("Alpha", "Bravo"),
        ("unit 1", "unit 2"),
        ("one of them", "the other"),
        ("the former", "the latter"),
        ("the first machine", "the second machine"),
        ("the one", "the other one"),
        ("the first of the pair", "its companion"),
        ("one", "two"),
        ("machine X", "machine Y"),
        ("the leader", "the follower"),
        ("#1", "#2"),
        ("one drone", "the other drone"),
    ),
    "es": (
        ("el número uno", "el número dos"),
        ("el primero", "el segundo"),
        ("uno", "el otro"),
        ("el dron A", "el dron B"),
        ("uno de ellos", "su compañero"),
        ("el dron 1", "el dron 2"),
        ("la unidad 1", "la unidad 2"),
        ("el líder", "el punto"),
        ("uno de los dos", "el otro"),
    ),
}
"""Names of two machines."""
ORDERED: Final = frozenset(
    (
        "number one",
        "No. 1",
        "the first",
        "the lead",
        "drone A",
        "drone 1",
        "Alpha",
        "unit 1",
        "the first machine",
        "machine X",
        "#1",
        "el número uno",
        "el primero",
        "el dron A",
        "el dron 1",
        "la unidad 1",
    )
)
"""Names that say which is which even if the second one's job is told first."""

ROLES: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": (
        ("the worker", "the escort"),
        ("the main machine", "its guard"),
        ("the principal", "the lookout"),
        ("lead", "cover"),
        ("the inner drone", "the outer drone"),
    ),
    "es": (("el principal", "la escolta"), ("el dron interior", "el dron exterior"), ("el obrero", "el guardia")),
}
"""Names of two machines of which one works at a place and the other round or beside it."""

INTRO_TWINS: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "Two {ms}",
        "A pair of {ms}",
        "Two {ms} at one time",
        "I need two {ms} at once",
        "Crew: two {ms}",
        "2 {ms}",
        "Two of the {ms} go out together",
        "Take two {ms}",
        "Give me a pair of {ms}",
        "Send out two {ms} together",
        "A team of two {ms}",
        "Two {ms}, simultaneous departure",
        "Two {ms} work in parallel",
        "Could we have two {ms} in the air together, please",
        "This is a job for two {ms} at the same time",
    ),
    "es": (
        "Dos {ms}",
        "Una pareja de {ms}",
        "Dos {ms} a la vez",
        "Necesito dos {ms} al mismo tiempo",
        "Salen juntos dos {ms}",
        "Equipo: dos {ms}",
        "Dos {ms}, salida simultánea",
    ),
}
INTRO_PAIR: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "{L} is {a}, {k} is {b}",
        "{L}: {a}. {K}: {b}",
        "{A} ({l}) and {b} ({k})",
        "Two machines, {l} = {a}, {k} = {b}",
        "Crew: {a} as {l}, {b} as {k}",
        "Call {a} {l} and {b} {k}",
    ),
    "es": (
        "{L} es {a}, {k} es {b}",
        "{A} ({l}) y {b} ({k})",
        "Dos aparatos: {l} = {a}, {k} = {b}",
        "Equipo: {a} como {l}, {b} como {k}",
    ),
}
"""Two machines of different types."""
NAMED: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": (
        ("number one", "number two"),
        ("No. 1", "No. 2"),
        ("drone A", "drone B"),
        ("drone 1", "drone 2"),
        ("Alpha", "Bravo"),
        ("unit 1", "unit 2"),
        ("machine X", "machine Y"),
        ("lead", "wing"),
        ("Red", "Blue"),
    ),
    "es": (
        ("el número uno", "el número dos"),
        ("el dron A", "el dron B"),
        ("la unidad 1", "la unidad 2"),
        ("el dron 1", "el dron 2"),
    ),
}
BODIES: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "en": (
        ("{i}. {L}: {c}. {K}: {d}.{t}", 1),
        ("{i}. {L}: {c}. {K}: {d}.{t}", 0),
        ("{i}: {l} {c}, {k} {d}.{t}", 1),
        ("{i}. {L} {c}. {S} {k} {d}.", 1),
        ("{i}. {L} {c}; {s} {k} {d}.", 1),
        ("{i}. While {l} {c}, {k} {d}.", 1),
        ("{i}. {L} is to {c}; {k} is to {d}.{t}", 0),
        ("{i}. Job of {l}: {c}. Job of {k}: {d}.{t}", 0),
        ("{i}. {L} shall {c}, and {s} {k} shall {d}.", 0),
        ("{i}. I want {l} to {c} and {k} to {d}.{t}", 0),
        ("{i}. {L} {c}, whereas {k} {d}.{t}", 1),
        ("{i}. {L} has to {c}. {K} has to {d}.{t}", 0),
    ),
    "es": (
        ("{i}. {L}: {c}. {K}: {d}.{t}", 0),
        ("{i}. {L}: {c}. {K}: {d}.{t}", 2),
        ("{i}: {l} {c}, {k} {d}.{t}", 0),
        ("{i}. {L} {c}. {S} {k} {d}.", 0),
        ("{i}. Mientras {l} {c}, {k} {d}.", 0),
        ("{i}. {L} debe {c}; {k} debe {d}.{t}", 2),
        ("{i}. Quiero que {l} {c} y que {k} {d}.{t}", 1),
    ),
}
"""`{i}`: which machines; `{s}`: at the same time; `{t}`: the same, as a sentence of its own. With the form of the verbs."""
BACKWARDS: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "en": (
        ("{i}. {K} {d}, while {l} {c}.", 1),
        ("{i}. {K}: {d}. {L}: {c}.{t}", 0),
        ("{i}. It falls to {k} to {d}; {s} it falls to {l} to {c}.", 0),
        ("{i}. As {k} {d}, {l} {c}.{t}", 1),
        ("{i}. {K} {d}. {L}, {s}, {c}.", 1),
    ),
    "es": (
        ("{i}. {K} {d}, mientras {l} {c}.", 0),
        ("{i}. {K}: {d}. {L}: {c}.{t}", 0),
        ("{i}. A {k} le toca {d}; {s} le toca {c} a {l}.", 2),
    ),
}
"""The second one's job is told first."""
AT_ONCE: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "meanwhile",
        "at the same time",
        "simultaneously",
        "in the same moment",
        "while that goes on",
        "during it",
        "concurrently",
        "in parallel",
        "all this while",
        "in the meantime",
        "in the same time",
        "from the same moment on",
    ),
    "es": ("mientras tanto", "al mismo tiempo", "entretanto", "en paralelo", "a la vez", "en el mismo momento"),
}
TOGETHER: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "",
        "",
        " Both at once.",
        " Simultaneous departure.",
        " Neither waits for the other.",
        " They needn't wait for one another.",
        " No coordination required.",
        " Same start time for both.",
        " The two run in parallel.",
        " Both take off together.",
        " All that at one time.",
        " No waiting for each other.",
        " Concurrent, not in sequence.",
    ),
    "es": (
        "",
        " Los dos a la vez.",
        " Salida simultánea.",
        " Ninguno espera al otro.",
        " Sin coordinación entre ellos, en paralelo.",
        " Todo al mismo tiempo.",
    ),
}
THREE_LABELS: Final[Mapping[str, tuple[tuple[str, str, str], ...]]] = {
    "en": (
        ("number one", "number two", "number three"),
        ("No. 1", "No. 2", "No. 3"),
        ("drone A", "drone B", "drone C"),
        ("Alpha", "Bravo", "Charlie"),
        ("unit 1", "unit 2", "unit 3"),
        ("lead", "left wing", "right wing"),
        ("the first", "the second", "the third"),
    ),
    "es": (
        ("el número uno", "el número dos", "el número tres"),
        ("el dron A", "el dron B", "el dron C"),
        ("el primero", "el segundo", "el tercero"),
    ),
}
THREE_NAMED: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "en": (
        ("Three machines. {L}, {a}: {x}. {K}, {b}: {y}. {M}, {d}: {z}.{t}", 0),
        ("Crew: {l} is {a}, {k} is {b}, {m} is {d}. {L} {x}. {K} {y}. {M} {z}.{t}", 1),
        ("{L} ({a}) {x}. {K} ({b}) {y}. {M} ({d}) {z}.{t}", 1),
        ("I need three at one time: {l}, {a}, to {x}; {k}, {b}, to {y}; {m}, {d}, to {z}.", 0),
        ("Take {a} as {l}, {b} as {k}, {d} as {m}. {L} has to {x}. {K} has to {y}. {M} has to {z}.{t}", 0),
        ("{A} is {l}, {b} is {k}, {d} is {m}. Three starts in one moment. {L}: {x}. {K}: {y}. {M}: {z}.", 1),
    ),
    "es": (
        ("Tres aparatos. {L}, {a}: {x}. {K}, {b}: {y}. {M}, {d}: {z}.{t}", 0),
        ("{L} ({a}) {x}. {K} ({b}) {y}. {M} ({d}) {z}.{t}", 0),
        ("{L} es {a}, {k} es {b}, {m} es {d}. {L} debe {x}. {K} debe {y}. {M} debe {z}.{t}", 2),
    ),
}
THREE_TOGETHER: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        " All three at once.",
        " Simultaneous departure.",
        " None waits for the others.",
        " All that at one time.",
        " They take off together, in parallel.",
    ),
    "es": (" Los tres a la vez.", " Salida simultánea.", " Ninguno espera a los demás."),
}
ENDS_FIRST: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "At the end of it {a} {c} and {b} {d}. Before that the former {e}, and at the same time the latter {f}.",
        "How it ends: {a} {c}, {b} {d}. What comes before, in parallel: the first one {e}; the second one {f}.",
        "Last of all {a} {c}, and {b} {d}. But first, both at once: the one {e}, the other {f}.",
        "Before {a} {c}, it {e}. Meanwhile, before {b} {d}, that one {f}.",
        "{A} {c} in the end; before this it {e}. At the same time {b} {f}, and it {d} after that.",
        "The outcome I want: {a} {c}, {b} {d}. To get there the first {e} while the second {f}.",
    ),
    "es": (
        "Al final {a} {c} y {b} {d}. Antes, a la vez, el primero {e} y el segundo {f}.",
        "Antes de eso, en paralelo, {a} {e} y {b} {f}; al final el primero {c} y el segundo {d}.",
        "{A} {c} al final; antes {e}. Al mismo tiempo {b} {f}, y después {d}.",
    ),
}
"""The ends `{c}` and `{d}` told before what comes before them, `{e}` and `{f}`."""
LANDED_FIRST: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        (
            "In the end {a} shall stand on the ground at {p}, {b} at {q}; before that the former {e}, "
            "and at the same time the latter {f}."
        ),
        (
            "Parking places: {p} for {a}, {q} for {b}. Before they land there, in parallel, the first "
            "{e} and the second {f}."
        ),
        (
            "When all is over I want to find {a} landed at {p} and {b} landed at {q}. Until then, both "
            "at once: the one {e}, the other {f}."
        ),
        "Final positions on the ground: {a} at {p}, {b} at {q}. On the way the former {e} while the latter {f}.",
        "{A} lands at {p}, but before it {e}. Meanwhile {b} {f}, and lands at {q}.",
        "{B} has its last landing at {q} and {a} at {p}. Prior to this {b} {f}, simultaneously {a} {e}.",
    ),
    "es": (
        "Al final {a} debe estar en tierra en {p} y {b} en {q}; antes, a la vez, el primero {e} y el segundo {f}.",
        (
            "Aterrizajes finales: {p} para {a}, {q} para {b}. Antes de posarse allí, en paralelo, el "
            "primero {e} y el segundo {f}."
        ),
        "{A} aterriza en {p}, pero antes {e}. Mientras tanto {b} {f} y aterriza en {q}.",
    ),
}
"""Both end on the ground, at `{p}` and `{q}`, and that is told first."""
STRAIGHT: Final[Mapping[str, str]] = {"en": "flies straight there", "es": "vuela directo allí"}
"""Of a machine that has nothing to do before it lands."""
IN_LINE: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "en": (
        ("{i}. They go one after the other. {L} {c}. {K} {d}, not before {l} is home.", 1),
        ("{i}. Never in the air together. First {l}: {c}. When that is done, {k}: {d}.", 0),
        ("{i}. In sequence: {l} {c}. {K} waits on the ground until then; after that it {d}.", 1),
        ("{i}. {K} starts only when {l} is back. {L} {c}; {k} {d}.", 1),
        ("{i}. {K} is second in line and has to {d}; before it {l} has to {c}, and be home.", 0),
        ("{i}. One flight at a time, please. {L}: {c}. After its return, {k}: {d}.", 0),
        ("{i}. {L} {c}; only its landing at home releases {k}, which {d}.", 1),
    ),
    "es": (
        ("{i}. De uno en uno. {L} {c}. {K} {d} cuando {l} está en casa.", 0),
        ("{i}. Nunca juntos en el aire. Primero {l}: {c}. Cuando acabe, {k}: {d}.", 0),
        ("{i}. {K} sale solo cuando {l} ha vuelto. {L} {c}; {k} {d}.", 0),
    ),
}
"""Two machines in turn."""
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
