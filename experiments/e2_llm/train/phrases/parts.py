"""How people say the parts of one machine's mission, requests as a whole, and what stands between: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

CLAUSES: Final[Mapping[str, Both]] = {
    "over": (
        (
            "[fly|flies] to {p} at {h}",
            "[go|goes] to {p}, {h} up",
            "[check|checks] {p} from {h}",
            "[pass|passes] over {p} {h} high",
            "[take|takes] a look at {p} from a height of {h}",
            "[inspect|inspects] {p} at an altitude of {h}",
            "[proceed|proceeds] to {p} ({h} above ground)",
            "[scout|scouts] {p} out from {h}",
        ),
        (
            "[vuela|vuele|volar] a {p} a {h} de altura",
            "[va|vaya|ir] hasta {p} a {h}",
            "[mira|mire|mirar] {p} desde {h}",
            "[pasa|pase|pasar] por encima de {p} a {h}",
            "[revisa|revise|revisar] {p} a una altura de {h}",
        ),
    ),
    "over_plain": (
        (
            "[fly|flies] to {p}",
            "[go|goes] over {p}",
            "[visit|visits] {p}",
            "[check|checks] {p}",
            "[have|has] a look at {p}",
            "[inspect|inspects] {p} from the air",
            "[head|heads] for {p}",
        ),
        (
            "[vuela|vuele|volar] hasta {p}",
            "[visita|visite|visitar] {p}",
            "[echa|eche|echar] un vistazo a {p}",
            "[se acerca|se acerque|acercarse] a {p} por el aire",
        ),
    ),
    "watch": (
        (
            "[hover|hovers] over {p} at {h} for {t}",
            "[stay|stays] {t} above {p} at {h}",
            "[watch|watches] {p} from {h} for {t}",
            "[keep|keeps] an eye on {p} for {t}, {h} up",
            "[observe|observes] {p} during {t} from a height of {h}",
            "[hold|holds] for {t} over {p} ({h})",
            "[fly|flies] to {p} at {h} and [wait|waits] there for {t}",
            "[linger|lingers] {t} over {p}, {h} above the ground",
        ),
        (
            "[se queda|se quede|quedarse] {t} sobre {p} a {h}",
            "[vigila|vigile|vigilar] {p} durante {t} desde {h}",
            "[vuela|vuele|volar] a {p} a {h} y [espera|espere|esperar] {t}",
            "[permanece|permanezca|permanecer] {t} encima de {p}, a {h} de altura",
        ),
    ),
    "land": (
        (
            "[land|lands] at {p}",
            "[set|sets] down at {p}",
            "[touch|touches] down at {p}",
            "[go|goes] to {p} and [land|lands] there",
            "[fly|flies] over to {p} and [put|puts] down",
        ),
        (
            "[aterriza|aterrice|aterrizar] en {p}",
            "[va|vaya|ir] a {p} y [aterriza|aterrice|aterrizar] allí",
            "[se posa|se pose|posarse] en {p}",
            "[toma|tome|tomar] tierra en {p}",
        ),
    ),
    "stop": (
        (
            "[land|lands] at {p} for {t}",
            "[set|sets] down at {p} and [stay|stays] on the ground for {t}",
            "[make|makes] a stop of {t} on the ground at {p}",
            "[rest|rests] {t} on the ground at {p}",
        ),
        (
            "[aterriza|aterrice|aterrizar] en {p} durante {t}",
            "[para|pare|parar] {t} en tierra en {p}",
            "[hace|haga|hacer] una parada de {t} en el suelo en {p}",
            "[descansa|descanse|descansar] {t} posado en {p}",
        ),
    ),
    "ring": (
        (
            "[circle|circles] {p} at {r}, {h} high",
            "[make|makes] a lap round {p}, {r} out, at {h}",
            "[orbit|orbits] {p} with a radius of {r} at an altitude of {h}",
            "[go|goes] round {p} keeping {r} off, {h} up",
            "[trace|traces] a ring of {r} radius about {p} at {h}",
            "[run|runs] a loop of {r} about {p} ({h} high)",
        ),
        (
            "[da|dé|dar] una vuelta a {p} a {r} de distancia y {h} de altura",
            "[rodea|rodee|rodear] {p} con un radio de {r}, a {h}",
            "[orbita|orbite|orbitar] alrededor de {p} a {r}, altura {h}",
            "[traza|trace|trazar] un anillo de {r} en torno a {p} a {h}",
        ),
    ),
    "rings": (
        (
            "[circle|circles] {p} {n} at {r}, {h} high",
            "[go|goes] {n} round {p} with a radius of {r} at {h}",
            "[orbit|orbits] {p} {n}, {r} out and {h} up",
            "[fly|flies] the ring of {r} about {p} {n} at {h}",
        ),
        (
            "[rodea|rodee|rodear] {p} {n} con un radio de {r} a {h}",
            "[orbita|orbite|orbitar] {n} alrededor de {p}, a {r} y {h} de altura",
            "[repite|repita|repetir] {n} el círculo de {r} en torno a {p} a {h}",
        ),
    ),
    "zigzag": (
        (
            "[sweep|sweeps] from {p} to {q} in a zigzag of {w} and {n} legs at {h}",
            "[search|searches] the strip between {p} and {q} in {n} zigzag legs, {w} wide, {h} up",
            "[fly|flies] a zigzag ({n} legs, {w}) from {p} over to {q} at an altitude of {h}",
            "[weave|weaves] its way {w} wide from {p} to {q}, {n} legs, {h} high",
        ),
        (
            "[hace|haga|hacer] un zigzag de {w} y {n} tramos de {p} a {q} a {h}",
            "[barre|barra|barrer] en zigzag la franja entre {p} y {q}: {n} tramos, {w}, altura {h}",
            "[vuela|vuele|volar] en zigzag desde {p} hasta {q}, {n} tramos de {w}, a {h}",
        ),
    ),
    "line": (
        (
            "[fly|flies] the line from {p} to {q} in {n} steps at {h}",
            "[follow|follows] the straight line between {p} and {q}, {n} points, {h} high",
            "[inspect|inspects] the way from {p} to {q} at {n} evenly spaced points from {h}",
            "[trace|traces] the leg {p} - {q} through {n} points at {h}",
        ),
        (
            "[recorre|recorra|recorrer] la línea de {p} a {q} en {n} puntos a {h}",
            "[sigue|siga|seguir] la recta entre {p} y {q}, {n} puntos, a {h} de altura",
            "[revisa|revise|revisar] el camino de {p} a {q} en {n} puntos desde {h}",
        ),
    ),
    "corners": (
        (
            "[visit|visits] the corners of a right-angled triangle, legs {r}, at {p}, {h} high",
            "[trace|traces] a right triangle from {p} (legs {r}) at {h}",
            "[fly|flies] past the three corners of a triangle at {p} whose legs measure {r}, at an altitude of {h}",
        ),
        (
            "[pasa|pase|pasar] por las esquinas de un triángulo rectángulo en {p} con catetos de {r} a {h}",
            "[traza|trace|trazar] un triángulo rectángulo desde {p}, catetos de {r}, a {h}",
        ),
    ),
    "explore": (
        (
            "[explore|explores] {k} from {h}",
            "[scan|scans] {k} completely at {h}",
            "[search|searches] {k} lane by lane, {h} up",
            "[cover|covers] every corner of {k} at an altitude of {h}",
            "[map|maps] the area of {k} from {h}",
            "[comb|combs] through {k} at {h}",
        ),
        (
            "[explora|explore|explorar] {k} desde {h}",
            "[peina|peine|peinar] {k} por completo a {h}",
            "[busca|busque|buscar] por {k} a {h} de altura",
            "[cubre|cubra|cubrir] toda la zona de {k} a {h}",
        ),
    ),
    "tour": (
        (
            "[visit|visits] {ps} at {h}, {t} at each",
            "[tour|tours] {ps}: {t} per stop, {h} up",
            "[check|checks] {ps} in that order from {h}, staying {t} at each",
            "[fly|flies] from {ps} at {h} with a pause of {t} at every place",
            "[patrol|patrols] {ps} at {h} and [stay|stays] {t} at each of them",
            "[do|does] the rounds of {ps}, {t} each, {h} high",
        ),
        (
            "[visita|visite|visitar] {ps} a {h}, {t} en cada sitio",
            "[recorre|recorra|recorrer] {ps} por este orden a {h} y [para|pare|parar] {t} en cada uno",
            "[patrulla|patrulle|patrullar] {ps} desde {h}, {t} por lugar",
            "[hace|haga|hacer] la ronda de {ps} a {h} con {t} en cada punto",
        ),
    ),
    "pass": (
        (
            "[fly|flies] past {ps} at {h} without stopping",
            "[go|goes] along {ps} at {h}",
            "[overfly|overflies] {ps} one after the other, {h} high",
            "[run|runs] the route {ps} at {h}",
        ),
        (
            "[sobrevuela|sobrevuele|sobrevolar] {ps} a {h} sin parar",
            "[sigue|siga|seguir] la ruta {ps} a {h}",
            "[pasa|pase|pasar] por {ps} a {h}",
        ),
    ),
    "shuttle": (
        (
            "[go|goes] back and forth {n} between {p} and {q} at {h}",
            "[shuttle|shuttles] {n} from {p} to {q}, {h} up",
            "[alternate|alternates] {n} between {p} and {q} at {h}",
        ),
        (
            "[va|vaya|ir] y [viene|venga|venir] {n} de {p} a {q} a {h}",
            "[alterna|alterne|alternar] {n} entre {p} y {q} a {h}",
        ),
    ),
    "guard": (
        (
            "[keep|keeps] patrolling {ps} at {h} for {t}",
            "for {t} [do|does] rounds of {ps} at {h}",
            "[go|goes] on visiting {ps} at {h} until {t} are over",
            "[guard|guards] {ps} during {t} from {h}",
        ),
        ("[patrulla|patrulle|patrullar] {ps} a {h} durante {t}", "durante {t} [hace|haga|hacer] rondas por {ps} a {h}"),
    ),
    "wait": (
        ("[wait|waits] {t}", "[hold|holds] its position for {t}", "[pause|pauses] for {t}", "[stay|stays] put for {t}"),
        ("[espera|espere|esperar] {t}", "[hace|haga|hacer] una pausa de {t}", "[se detiene|se detenga|detenerse] {t}"),
    ),
    "tell": (
        (
            '[report|reports] "{x}"',
            '[tell|tells] everybody "{x}"',
            '[send|sends] the message "{x}"',
            '[announce|announces]: "{x}"',
        ),
        (
            '[avisa|avise|avisar] a todos: "{x}"',
            '[manda|mande|mandar] el mensaje "{x}"',
            '[comunica|comunique|comunicar] "{x}"',
        ),
    ),
    "ask": (
        (
            "[wait|waits] until {u} confirms that {x}",
            "[ask|asks] {u} whether {x}",
            "[get|gets] a yes from {u} that {x}",
            "[let|lets] {u} say that {x} before anything else",
            "[check|checks] with {u} that {x}",
        ),
        (
            "[espera|espere|esperar] hasta que {u} confirme que {x}",
            "[pregunta|pregunte|preguntar] a {u} si {x}",
            "[pide|pida|pedir] a {u} que confirme que {x}",
            "[consulta|consulte|consultar] con {u} si {x}",
        ),
    ),
    "home": (
        (
            "[come|comes] home",
            "[fly|flies] back to its port",
            "[return|returns] home",
            "[go|goes] home",
            "[come|comes] back and [land|lands] at its port",
            "[head|heads] back home",
        ),
        (
            "[vuelve|vuelva|volver] a casa",
            "[regresa|regrese|regresar] a su puerto",
            "[vuelve|vuelva|volver] a la base y [aterriza|aterrice|aterrizar]",
            "[retorna|retorne|retornar] a su puerto",
        ),
    ),
    "stay": (
        (
            "[land|lands] there",
            "[set|sets] down on the spot",
            "[come|comes] down right there",
            "[finish|finishes] by landing there",
        ),
        (
            "[aterriza|aterrice|aterrizar] allí",
            "[se posa|se pose|posarse] allí mismo",
            "[toma|tome|tomar] tierra en ese punto",
        ),
    ),
}

PLANS: Final[Mapping[str, str]] = {
    "over": "flies over {p} at {h}",
    "over_plain": "flies over {p}",
    "watch": "hovers over {p} at {h} for {t}",
    "land": "lands at {p}",
    "stop": "lands at {p} for {t}",
    "ring": "flies a circle of {r} round {p}",
    "rings": "flies a circle of {r} round {p} {n}",
    "zigzag": "flies a zigzag from {p} to {q}",
    "line": "flies a line from {p} to {q}",
    "corners": "flies a triangle at {p}",
    "explore": "explores {k} from {h}",
    "tour": "visits {ps} and waits {t} at each",
    "pass": "flies along {ps}",
    "shuttle": "flies between {p} and {q} {n}",
    "guard": "patrols {ps} for {t}",
    "wait": "waits {t}",
    "tell": "people are told",
    "ask": "{u} must confirm",
    "home": "returns",
    "stay": "lands there",
}
"""What stands in `plan`."""

SINGLE: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "en": (
        ("{A} {c}.", 1),
        ("Have {a} {c}.", 0),
        ("Please let {a} {c}.", 0),
        ("I need {a} to {c}.", 0),
        ("{A} should {c}.", 0),
        ("Could {a} {c}?", 0),
        ("Get {a} to {c}.", 0),
        ("Task for {a}: {c}.", 0),
        ("{A}: {c}.", 0),
        ("We want {a} to {c}, please.", 0),
        ("Mission: {a} {c}.", 1),
        ("{A} must {c}.", 0),
        ("What I want is that {a} {c}.", 1),
        ("Today {a} shall {c}.", 0),
        ("Hi, can you make {a} {c}? Thanks.", 0),
        ("Order {a} to {c}.", 0),
        ("{A} is to {c}.", 0),
        ("It would be good if {a} could {c}.", 0),
    ),
    "es": (
        ("{A} {c}.", 0),
        ("Que {a} {c}.", 1),
        ("Quiero que {a} {c}.", 1),
        ("Por favor, que {a} {c}.", 1),
        ("{A} tiene que {c}.", 2),
        ("Necesito que {a} {c}.", 1),
        ("{A} debe {c}.", 2),
        ("Misión: {a} {c}.", 0),
        ("¿Puede {a} {c}?", 2),
        ("Haz que {a} {c}.", 1),
    ),
}
"""A request for one machine, and which form of the verbs it takes."""

JOINS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "en": (
        (", ", " and "),
        (", ", " and then "),
        (", then ", ", then "),
        ("; ", "; finally "),
        (", after that ", " and at the end "),
        (", ", ", and "),
        (" and ", " and "),
        (" - ", " - "),
    ),
    "es": (
        (", ", " y "),
        (", ", " y luego "),
        (", luego ", ", después "),
        ("; ", " y al final "),
        (", ", " y por último "),
    ),
}
"""Between parts, before the last one."""

TWO: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "{A}. At the same time {b}.",
        "{A}, while {b}.",
        "{A}; {b}. Both at once.",
        "In parallel: {a}; {b}.",
        "{A}. Meanwhile {b}.",
        "Two jobs side by side. {A}. {B}.",
        "Simultaneously, {a} and {b}.",
    ),
    "es": (
        "{A}. Al mismo tiempo {b}.",
        "{A}, mientras {b}.",
        "En paralelo: {a}; {b}.",
        "A la vez, {a} y {b}.",
    ),
}
THREE: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "All at once: {a}; {b}; {d}.",
        "{A}. In the meantime {b}, and {d}.",
        "Three jobs in parallel. {A}. {B}. {D}.",
        "Together: {a}, {b}, {d}.",
    ),
    "es": ("Todo a la vez: {a}; {b}; {d}.", "{A}. Mientras tanto {b}, y {d}.", "En paralelo: {a}; {b}; {d}."),
}
TURNS: Final[Mapping[str, tuple[str, ...]]] = {
    "en": (
        "First {a}. Once that is done, {b}.",
        "{A}. Only afterwards {b}.",
        "One by one: {a}; then {b}.",
        "{A}. When it has finished, {b}.",
    ),
    "es": ("Primero {a}. Cuando termine, {b}.", "{A}. Solo después {b}.", "Uno tras otro: {a}; luego {b}."),
}
