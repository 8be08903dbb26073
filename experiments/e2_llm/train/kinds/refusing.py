"""Requests that get no tree: what cannot be done, and what is not said. Tables only, as in `phrases`.

Of a row: the wordings, and the answers. `{p}` a place, `{a}` a machine, `{n}` a number, `{h}` a height, `{z}` a name that the
site does not have, `{k}` a doing that no verb does; `{w}` the places and `{v}` the machines that there are.
"""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

Row = tuple[Both, str, str]
"""Wordings; why (or the question); what is possible instead."""

SKILLS: Final[tuple[tuple[str, str, str], ...]] = (
    ("trim the hedge", "recortar el seto", "cut hedges"),
    ("water the plants", "regar las plantas", "water plants"),
    ("carry the tractor", "llevar el tractor", "carry a tractor"),
    ("knock on the door", "llamar a la puerta", "knock on doors"),
    ("dive into the water", "bucear", "dive"),
    ("count the sheep by touching them", "contar las ovejas tocándolas", "touch animals"),
    ("heat the building", "calentar el edificio", "heat anything"),
    ("dry the grass", "secar la hierba", "dry grass"),
    ("close the valve", "cerrar la válvula", "close valves"),
    ("take a soil sample", "tomar una muestra de suelo", "take samples"),
    ("charge my phone", "cargar mi móvil", "charge phones"),
    ("read out a poem", "recitar un poema", "speak"),
    ("melt the ice", "derretir el hielo", "melt ice"),
    ("pull the cart", "tirar del carro", "pull carts"),
    ("paint the fence", "pintar la valla", "paint anything"),
    ("pick the ripe apples", "recoger las manzanas maduras", "pick fruit"),
    ("milk the goats", "ordeñar las cabras", "milk animals"),
    ("sweep the leaves up", "barrer las hojas", "sweep leaves"),
    ("translate the sign", "traducir el cartel", "translate"),
    ("dig a hole", "cavar un hoyo", "dig"),
    ("sing for the children", "cantar para los niños", "sing"),
    ("measure the depth of the water", "medir la profundidad del agua", "measure depths"),
    ("lock the gate", "cerrar la puerta con llave", "lock gates"),
    ("spread seed", "esparcir semillas", "sow"),
    ("change the light bulb", "cambiar la bombilla", "change light bulbs"),
    ("push the car", "empujar el coche", "push cars"),
    ("weigh the calves", "pesar los terneros", "weigh animals"),
)
"""Doings that no verb does: as asked for in English and Spanish, and in the answer."""

IMPOSSIBLE: Final[Mapping[str, Row]] = {
    "skill": (
        (
            (
                "Let {a} {k} at {p}.",
                "{A} should {k} near {p}.",
                "Can {a} {k} at {p}?",
                "Please have {a} {k} over by {p}, then home.",
            ),
            ("Que {a} vaya a {p} para {k}.", "¿Puede {a} {k} en {p}?", "{A} tiene que {k} en {p}."),
        ),
        "No verb here can {k}.",
        "{A} could look at {p} from the air.",
    ),
    "many": (
        (
            (
                "Launch {n} {ms} to {p}.",
                "I want {n} {ms} above {p} right now.",
                "{n} {ms} shall hover at {p}.",
                "{n} {ms}, {p}, {h}, now.",
                "{n} {ms} take turns at {p}, please.",
                "Put {n} {ms} in the air over {p}.",
            ),
            ("Manda {n} {ms} a {p}.", "Quiero {n} {ms} sobre {p}.", "Que {n} {ms} vuelen hasta {p}."),
        ),
        "The site has only {m} of them.",
        "All {m} of them could fly to {p}.",
    ),
    "high": (
        (
            (
                "{A} should climb to {h} over {p}.",
                "Take {a} up to {h} at {p}.",
                "I want a view of {p} from {h} with {a}.",
                "{A}: {p}, {h} up, {t}, home.",
                "Would {a} kindly watch {p} from an altitude of {h}?",
                "Park {a} {h} above {p}.",
            ),
            ("Que {a} suba a {h} sobre {p}.", "Sube {a} hasta {h} en {p}.", "{A} debe mirar {p} desde {h}."),
        ),
        "{h} is higher than any drone may fly here.",
        "{A} could look at {p} from {l}.",
    ),
    "far": (
        (
            (
                "{A} shall fly {d} north of {p} and come back.",
                "Send {a} {d} to the east of {p}.",
                "Have {a} look at a point {d} south of {p}.",
                "{A}: {d} out to the west, {h} up, home.",
                "I need {a} over the village {d} away from here.",
                "From {p}, {a} goes on {d} eastwards and lands.",
            ),
            (
                "Manda {a} a {d} al norte de {p}.",
                "Que {a} vaya a {d} al este de {p}.",
                "{A}: {d} hacia el oeste, a {h}, y a casa.",
            ),
        ),
        "A point {d} away is outside the fence.",
        "{A} could fly to {p}.",
    ),
    "nobody": (
        (
            (
                "{z} flies to {p} and home.",
                "Send {z} over {p}.",
                "{z}: {p}, {h}, home.",
                "{z} lands at {p} and stays there.",
                "Let {z} look at {p}, please.",
            ),
            ("Que {z} vuele a {p} y vuelva.", "Manda {z} a {p}.", "{z}: {p}, a {h}, y a casa."),
        ),
        "There is no {z} at this site.",
        "The site has {v}.",
    ),
    "stranger": (
        (
            (
                "{Z} should go to {p} and return.",
                "Let {z} land at {p}.",
                "{Z}: over {p}, {h}, {t}, back home.",
                "I would like {z} to circle {p}.",
            ),
            ("Que {z} vaya a {p} y vuelva.", "Que {z} aterrice en {p}.", "Quiero que {z} vigile {p}."),
        ),
        "The site has no such machine.",
        "The site has {v}.",
    ),
    "no_unit": (
        (
            ("{z} must fly to {p} at {h}.", "{z}, {p}, home.", "Have {z} wait {t} at {p}, please."),
            ("{z} debe volar a {p} a {h}.", "{z}, {p}, a casa.", "Haz que {z} espere {t} en {p}."),
        ),
        "There is no {z} at this site.",
        "The site has {v}.",
    ),
}
STRANGERS: Final[tuple[tuple[str, str], ...]] = (
    ("the helicopter", "el helicóptero"),
    ("the robot dog", "el perro robot"),
    ("the rover", "el robot de ruedas"),
    ("our aeroplane", "nuestra avioneta"),
    ("the submarine", "el submarino"),
    ("the airship", "el dirigible"),
    ("the motor boat", "la lancha"),
    ("the hot-air balloon", "el globo"),
    ("the ambulance", "la ambulancia"),
    ("the glider", "el planeador"),
    ("the satellite", "el satélite"),
    ("our tractor", "nuestro tractor"),
    ("the rescue boat", "el bote de rescate"),
)
"""Machines that no site has."""
UNITS: Final = (
    "falcon_3",
    "kestrel_1",
    "rover_2",
    "robot_9",
    "bird_4",
    "unit_12",
    "fox_7",
    "delta_5",
    "osprey_2",
    "wasp_11",
    "heli_1",
    "gull_6",
)
"""Ids that no site has."""
NOWHERE: Final[tuple[tuple[str, str], ...]] = (
    ("the lighthouse", "el faro"),
    ("the castle", "el castillo"),
    ("the airport", "el aeropuerto"),
    ("the stadium", "el estadio"),
    ("the wind turbine", "el aerogenerador"),
    ("the tunnel", "el túnel"),
    ("the school", "la escuela"),
    ("the hangar", "el hangar"),
    ("the monument", "el monumento"),
    ("the swimming pool", "la piscina"),
    ("Gate 99", "la entrada 99"),
    ("the third tower", "la tercera torre"),
    ("the ski lift", "el telesilla"),
    ("the railway station", "la estación de tren"),
    ("the bakery", "la panadería"),
    ("the volcano", "el volcán"),
    ("the football pitch", "el campo de fútbol"),
    ("the power plant", "la central eléctrica"),
)
"""Places that no site has."""
UNCLEAR: Final[Mapping[str, Row]] = {
    "where": (
        (
            (
                "{A} should have a look.",
                "Fly {a} over there for {t}.",
                "Let {a} land.",
                "Can {a} inspect the usual spot?",
                "Watch from {h} for {t} with {a}, then home.",
                "{A} lands and stays.",
                "{A} takes off, waits {t} and comes home.",
                "{A}, {h} up, right now.",
            ),
            (
                "Que {a} eche un vistazo.",
                "Manda {a} allí {t}.",
                "Que {a} aterrice.",
                "Que {a} vigile desde {h} durante {t} y vuelva.",
                "{A}, a {h}, ya.",
            ),
        ),
        "Where shall {a} go? The site has {w}.",
        "",
    ),
    "centre": (
        (
            (
                "{A} flies a circle of {r}, {h} up, and comes home.",
                "Make {a} do a lap with a radius of {r}.",
                "Two turns at {h} with {a}, {r} out, please.",
            ),
            ("Que {a} vuele un círculo de {r} a {h} y vuelva.", "Una vuelta con {a}, radio {r}."),
        ),
        "Round which place shall {a} fly? The site has {w}.",
        "",
    ),
    "ends": (
        (
            (
                "{A} flies a zigzag of {n} legs at {h}.",
                "Have {a} follow the line in {n} steps, then home.",
                "{A} goes there and back {n} times.",
            ),
            ("Que {a} haga un zigzag de {n} tramos a {h}.", "Que {a} vaya y venga {n} veces."),
        ),
        "Between which places? The site has {w}.",
        "",
    ),
    "stops": (
        (
            (
                "{A} visits all of them at {h}, {t} each.",
                "The usual round with {a}, {h} up.",
                "{A}: the stops as last week, {t} at each, home.",
            ),
            ("Que {a} los visite todos, {t} en cada uno.", "La ronda de siempre con {a}, a {h}."),
        ),
        "Which places, and in which order? The site has {w}.",
        "",
    ),
    "what": (
        (
            (
                "Do something about {p}.",
                "{P}!",
                "{P}, as always.",
                "{P}, same as yesterday, with {a}.",
                "I have a bad feeling about {p}.",
                "The thing at {p}, please.",
                "Take care of {p} for me.",
            ),
            ("Haz algo con {p}.", "¡{P}!", "Lo de {p}, por favor.", "{P}, como ayer.", "Encárgate de {p}."),
        ),
        "What shall be done at {p}?",
        "",
    ),
    "which": (
        (
            (
                "{A} goes to one of the places and lands.",
                "Let {a} hover at the other one.",
                "If {a} cannot go there, it goes to the next one.",
                "{A} should check either this or that place.",
            ),
            ("Que {a} vaya a uno de los sitios y aterrice.", "Que {a} vuele al otro."),
        ),
        "Which place is meant? The site has {w}.",
        "",
    ),
    "who": (
        (
            (
                "Send that one to {p} again.",
                "{P}, {h}, home. You know which one flies.",
                "The same one as last time goes to {p} and lands there.",
                "Mine should fly to {p}.",
            ),
            ("Manda ese a {p} otra vez.", "El mismo de la última vez va a {p} y aterriza.", "El mío que vuele a {p}."),
        ),
        "Which machine is meant? The site has {v}.",
        "",
    ),
    "whom": (
        (
            (
                "{A} flies to {p} once he has agreed.",
                "Before {a} goes to {p}, ask her.",
                "When they say yes, {a} lands at {p}.",
            ),
            ("Que {a} vuele a {p} cuando él esté de acuerdo.", "Antes de que {a} vaya a {p}, pregúntale."),
        ),
        "Who is to be asked? There are {o}.",
        "",
    ),
    "unknown": (
        (
            (
                "{A} should fly to {z} and back.",
                "Have {a} land at {z}.",
                "Look at {z} with {a} for {t}.",
                "{A}: {z}, {h}, home.",
                "{A} circles {z} at {h} and returns.",
                "Would you have {a} watch {z} from {h}?",
                "{A} first flies to {p}, then to {z}, and home.",
            ),
            (
                "Que {a} vuele a {z} y vuelva.",
                "Que {a} aterrice en {z}.",
                "{A}: {z}, a {h}, y a casa.",
                "Que {a} vaya a {p}, luego a {z}, y a casa.",
            ),
        ),
        "The site has no place called {z}. Which of these is meant: {w}?",
        "",
    ),
}
