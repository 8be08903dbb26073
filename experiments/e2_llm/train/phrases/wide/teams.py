"""How many kinds of people say missions of two and three machines: tables only.

`A` and `B` are a machine with what it does, in the third person. Where machines have names first and jobs then,
`{l}` and `{k}` are these names, `{c}` and `{d}` the jobs.
"""

from collections.abc import Mapping
from typing import Final

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
