"""How very different people say that an answer decides, and what does not happen then: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_NOT_HOME: Final[Both] = (
    (
        "One way only.",
        "A return flight is not wanted.",
        "Do not bring it back.",
        "I will fetch it myself later.",
        "There it ends.",
        "It sleeps there.",
        "It is not to return to its port.",
        "No RTB.",
    ),
    (
        "Solo ida.",
        "No hay vuelo de regreso.",
        "No lo traigas de vuelta.",
        "Ya iré yo a buscarlo.",
        "Allí termina.",
    ),
)

MORE_NOTHING: Final[Both] = (
    (
        "all stay where they are",
        "we leave it at that",
        "the flight is dropped",
        "the propellers remain still",
        "it rests in its port",
        "we stand down",
        "no flight takes place",
        "it is not flown",
        "that is the end of the matter",
        "it does not even start",
        "forget it",
        "everything is called off",
    ),
    (
        "lo dejamos",
        "no se vuela",
        "el vuelo se cancela",
        "no se mueve nada",
        "sigue en tierra",
        "ni siquiera despega",
        "ahí acaba la cosa",
    ),
)

MORE_ONLY_IF: Final[Mapping[str, Both]] = {
    "asked": (
        (
            'Ask {u}: "{question}" Should the answer be yes, {a}. In any other case {z}.',
            "{A}, provided {u} is asked beforehand and says that {x}; failing which {z}.",
            "{U} holds the key: asked if {x}, a yes means {a}, and a no means {z}.",
            "Clearance from {u} needed ({x}, yes or no). Cleared: {a}. Not cleared: {z}.",
            "If it turns out that {x}, which {u} will tell you, {a}. If it turns out otherwise, {z}.",
            "Do you hear, {a} only when {u} answers that {x}. When the answer is another, {z}.",
            "No yes from {u} to the question whether {x}, no flight: {z}. But with the yes, {a}.",
            "I would be grateful if you asked {u} whether {x}. If so, {a}; if not so, {z}.",
            "First must {u} say if {x}. Is it yes, {a}. Is it no, {z}.",
            "Subject to confirmation by {u} that {x}, {a}. In the absence of such confirmation {z}.",
            "{A}. That holds only if {u} has been asked and has said that {x}; otherwise {z}.",
            "Let {u} judge if {x}, since {u} is on the spot. Good: {a}. Not good: {z}.",
            "Assuming a yes from {u} when asked if {x}, {a}; assuming a no, {z}.",
            "Can {u} tell us that {x}? Fine, {a}. Cannot? Then {z}.",
            "Nothing starts unasked: {u} is to say whether {x}. On a yes, {a}. On a no, {z}.",
        ),
        (
            "{A}, siempre que {u}, al preguntarle antes, diga que {x}; en caso contrario {z}.",
            "La llave la tiene {u}: si responde que {x}, {a}; si responde que no, {z}.",
            "Hace falta el visto bueno de {u} ({x}, sí o no). Con él, {a}. Sin él, {z}.",
            "¿{X}? Que lo diga {u}. Si es así, {a}. Si no es así, {z}.",
            "Le agradecería que preguntara a {u} si {x}. De ser así, {a}; de no serlo, {z}.",
            "Sin un sí de {u} a la pregunta de si {x}, {z}. Con el sí, {a}.",
            "Primero {u} dice si {x}. Que sí: {a}. Que no: {z}.",
        ),
    ),
    "charge": (
        (
            "Look at the battery gauge of {m}: reads it more than {b}, {a}; reads it less, {z}.",
            "{A}, on the understanding that the charge is higher than {b}. Lower, and {z}.",
            "Is there more than {b} left in the battery? Yes: {a}. No: {z}.",
            "Battery over {b}, go: {a}. Otherwise no-go: {z}.",
            "I would not risk it with a weak battery. So, above {b} {a}, otherwise {z}.",
            "Provided the battery holds over {b}, {a}; provided it does not, {z}.",
            "Unless the battery of {m} has more than {b}, {z}. If it has, {a}.",
            "When {m} has more as {b} of battery, {a}. When not, {z}.",
            "Please ensure a charge above {b} before anything else. Given that, {a}. Without that, {z}.",
            "The rule is simple. Charge greater than {b}: {a}. Any other charge: {z}.",
        ),
        (
            "¿Queda más del {b} de batería? Sí: {a}. No: {z}.",
            "No quiero arriesgar: por encima del {b} de carga, {a}; en otro caso, {z}.",
            "{A}, siempre que la batería de {m} pase del {b}; de no ser así, {z}.",
            "A menos que {m} tenga más del {b} de carga, {z}. Si lo tiene, {a}.",
            "Batería superior al {b}: {a}. Cualquier otra cosa: {z}.",
        ),
    ),
}

MORE_EITHER: Final[Mapping[str, Both]] = {
    "place": (
        (
            'Ask {u}: "{question}" Yes sends {a} to {p}, no sends it to {q}.',
            "There are two possible targets for {a}: {p}, in case {u} replies that {x}, and {q}, in case of a no.",
            "{A} has a fork in the road. If {u} is asked and says that {x}, take {p}; if {u} says no, take {q}.",
            "Destination of {a}: {p} given a yes from {u} as to whether {x}, {q} given a no.",
            "Like a railway switch: {u} says that {x}, and {a} goes to {p}; {u} says no, and {a} goes to {q}.",
            "Is it so that {x}? {U} knows. If yes, {p}, if no, {q}: there {a} has to go.",
            "I want {a} at {p} after a yes of {u} to the question if {x}, but at {q} after a no.",
            "{A} goes not to {p} but to {q} should {u} deny that {x}; should {u} confirm it, then to {p}.",
            "Query {u}: {x}? Affirm, {a} proceed {p}. Negative, {a} proceed {q}.",
            "{P} or {q}? {A} goes to the former if {u} says that {x} and to the latter if {u} says no.",
            "To {u} is asked if {x}. With yes {a} flies in direction of {p} until there, with no of {q}.",
            "Please consult {u} on whether {x}; {p} is where {a} goes after a yes, {q} after a no.",
        ),
        (
            "¿{P} o {q}? {A} va al primer sitio si {u} dice que {x}, y al segundo si dice que no.",
            "Como un cambio de agujas: si {u} dice que {x}, {a} va a {p}; si dice que no, va a {q}.",
            "Destino de {a}: {p} con un sí de {u} a la pregunta de si {x}, {q} con un no.",
            "¿{X}? {U} lo sabe. Que sí: {a} vuela a {p}. Que no: {a} vuela a {q}.",
            "Quiero {a} en {p} si {u} contesta que {x}, pero en {q} si contesta que no.",
        ),
    ),
    "who": (
        (
            'Ask {u}: "{question}" Yes, and {p} is flown to by {a}; no, and it is flown to by {b}.',
            "Somebody goes to {p}: {a} if {u} says that {x}, {b} if {u} says no.",
            "Which one goes to {p}? {A}, if {u} agrees that {x}. {B}, if {u} does not.",
            "Pick the machine for {p} by asking {u} if {x}: yes picks {a}, no picks {b}.",
            "The trip to {p} falls to {a} when {u} replies that {x}, and to {b} when {u} replies no.",
            "{P} needs one machine. Query {u}: {x}? Affirm: {a} goes. Negative: {b} goes.",
            "With a yes of {u} to the question if {x} it is {a} that makes the flight to {p}, with a no it is {b}.",
            "On {u} depends who flies to {p}: if {x}, {a}; if not, {b}. So ask.",
        ),
        (
            "Alguien va a {p}: {a} si {u} dice que {x}, {b} si dice que no.",
            "¿Quién va a {p}? {A}, si {u} confirma que {x}. {B}, si lo niega.",
            "El viaje a {p} le toca a {a} si {u} contesta que {x}; si contesta que no, le toca a {b}.",
        ),
    ),
    "home": (
        (
            " Whichever flies, {h} is its height, and home is where it goes next.",
            " Altitude {h} in both cases; RTB.",
            " No difference in the rest: {h} up, then back home.",
        ),
        (" Vuele el que vuele, a {h}, y luego a casa.", " Lo demás no cambia: altura {h} y regreso a casa."),
    ),
    "ring_home": (
        (
            " Once arrived, yes or no, one three-sixty around it, radius {r}, {h} high; RTB.",
            " The rest does not change: a single circle round that place, {r} from it, {h} up, and the way home.",
            " There, in both cases, one orbit is flown ({r} radius, {h} altitude) before it goes home.",
            " What happens there is the same: one turn around in the distance of {r}, height {h}, and to home.",
        ),
        (
            " Una vez allí, en ambos casos, un giro completo de radio {r} a {h}, y regreso a casa.",
            " Lo demás no cambia: una vuelta alrededor, a {r} de distancia y {h} de altura, y a casa.",
        ),
    ),
    "wait": (
        (
            " Either way, it hangs there {h} up for {t} and then settles on the ground right there.",
            " There, yes or no: {t} of hovering at {h}, full-stop landing on the same spot.",
            " The rest does not change: height {h}, {t} of waiting above the place, landing at that place.",
        ),
        (" Lo demás no cambia: {t} en el aire a {h} y aterrizaje en ese mismo punto.",),
    ),
    "ground_home": (
        (
            " Once there, yes or no, it lands, stands for {t}, and flies home.",
            " The rest does not change: down on the ground, {t} of loading, back home.",
            " There it is put on the ground during {t} in both cases, and afterwards it goes to home.",
        ),
        (
            " Una vez allí, aterriza, espera {t} en tierra y vuelve a casa, sea cual sea la respuesta.",
            " Lo demás no cambia: aterrizar, {t} en el suelo, y a casa.",
        ),
    ),
    "ground": (
        (
            " There, yes or no, it lands for good.",
            " Having landed there it stays on the ground, no matter what the answer was.",
            " Wherever that is, the flight ends with a landing there and no return.",
        ),
        (
            " Una vez allí aterriza para siempre, sea cual sea la respuesta.",
            " Sea donde sea, allí aterriza y no vuelve.",
        ),
    ),
}
