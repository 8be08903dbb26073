"""How people say what depends on people, charge and time, and their messages and questions: tables only, as in `phrases`."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

CASES: Final[Mapping[str, Both]] = {
    "yes_no": (
        (
            "Ask {u} if {x}. If so, {a}. Otherwise {b}.",
            "{U} decides whether {x}: on yes {a}, on no {b}.",
            "If {u} says that {x}, {a}; if not, {b}.",
            "Question to {u}: is it so that {x}? Yes: {a}. No: {b}.",
        ),
        (
            "Pregunta a {u} si {x}. Si es así, {a}. Si no, {b}.",
            "Si {u} dice que {x}, {a}; en caso contrario, {b}.",
            "Consulta a {u} si {x}: si responde que sí, {a}; si no, {b}.",
        ),
    ),
    "if_yes": (
        (
            "Ask {u} if {x}. Only then {a}; on a no nothing happens.",
            "If {u} agrees that {x}, {a}. Else do nothing.",
            "{U} is asked if {x}; only after a yes {a}.",
        ),
        ("Pregunta a {u} si {x}. Solo si dice que sí, {a}.", "Si {u} confirma que {x}, {a}. Si no, nada."),
    ),
    "battery": (
        (
            'If its battery is above {b}, {a}; else people are told "{x}".',
            '{A}, provided that more than {b} of its charge is left. If not, report "{x}".',
            'Only with over {b} charge {a}; with less, send the message "{x}".',
        ),
        (
            'Si le queda más del {b} de batería, {a}; si no, avisa: "{x}".',
            'Solo con más del {b} de carga {a}; con menos, manda el mensaje "{x}".',
        ),
    ),
    "charged": (
        (
            "Wait until the battery of {m} is at least {b}, then {a}.",
            "As soon as {m} is charged to {b}, {a}.",
            "Once the charge of {m} has reached {b}, {a}.",
        ),
        (
            "Espera a que la batería de {m} esté al {b} como mínimo; luego {a}.",
            "En cuanto {m} tenga el {b} de carga, {a}.",
        ),
    ),
    "again": (
        (
            "{N}, one every {t}: {a}.",
            "Every {t}, {n} in all, {a}.",
            "{A}. Repeat that so that it is done {n}, at intervals of {t}.",
        ),
        ("{N}, cada {t}: {a}.", "Cada {t}, {n} en total, {a}."),
    ),
    "escalate": (
        (
            "Ask {u} if {x}. If the answer is not yes, ask {v} too. When one of them has agreed, {a}.",
            "{U} should say that {x}; failing that, {v}. With a yes from either, {a}.",
        ),
        ("Pregunta a {u} si {x}. Si no dice que sí, pregunta a {v}. Con un sí de cualquiera, {a}.",),
    ),
    "refused": (
        (
            '{A} and asks {u} whether {x}. On a no it reports "{y}". In any case it comes home afterwards.',
            '{A}, then asks {u} if {x}. If they refuse, the message "{y}" goes out. It returns home either way.',
        ),
        ('{A} y pregunta a {u} si {x}. Si dicen que no, avisa: "{y}". En todo caso vuelve a casa después.',),
    ),
    "follow": (
        (
            "{A} follows {u} at {h} by tracker, updating every {t}, until in range, then home.",
            "Let {a} escort {u} {h} up: ask the tracker each {t} where to go until it reports in range. Back home at the end.",
            "{A} is to go where the tracker of {u} points, at {h}, again every {t}; in range means done and home.",
        ),
        (
            "{A} sigue a {u} a {h} según su localizador, cada {t}, hasta que esté en rango, y vuelve a casa.",
            "{A} va donde diga el localizador de {u}, a {h}, cada {t}, hasta estar en rango; luego a casa.",
        ),
    ),
    "meet": (
        (
            "{A} and {b} take up positions at {p} and {q}, {h} high. Not before both are there {c}.",
            "{A} flies to {p}, {b} to {q}, each at {h}. As soon as both are in place, {c}.",
            "Get {a} over {p} and {b} over {q} ({h}). They wait for one another; then {c}.",
        ),
        (
            "{A} va a {p} y {b} a {q}, a {h}. Cuando los dos estén allí, {c}.",
            "Coloca {a} sobre {p} y {b} sobre {q} a {h}; se esperan y después {c}.",
        ),
    ),
    "then_home": (
        ("both fly home", "both return to their ports", "they come back home"),
        ("ambos vuelven a casa", "los dos regresan a su puerto"),
    ),
    "then_land": (
        ("both land where they are", "they come down together", "each of them lands on its spot"),
        ("ambos aterrizan donde están", "los dos toman tierra allí"),
    ),
    "swap": (
        ("they swap places and go home", "each goes over the other place and then home"),
        ("se cambian de sitio y vuelven a casa",),
    ),
}

TOLD: Final[tuple[tuple[str, str], ...]] = (
    ("Nothing to be seen", "No se ve nada"),
    ("All quiet here", "Todo tranquilo"),
    ("Nobody goes there today", "Hoy no va nadie"),
    ("The drone is on its way home", "El dron vuelve a casa"),
    ("Round finished", "Ronda terminada"),
    ("The flight is off", "Vuelo cancelado"),
    ("Please stand by", "Estén atentos"),
    ("Charge too low", "Poca batería"),
    ("Come and have a look", "Venid a mirar"),
    ("The job is done", "Trabajo terminado"),
    ("Not today", "Hoy no"),
    ("We try again tomorrow", "Mañana lo intentamos otra vez"),
    ("Keep away, please", "Apártense, por favor"),
    ("Help is coming", "La ayuda está en camino"),
    ("The parcel is there", "El paquete ha llegado"),
    ("Permission refused", "Permiso denegado"),
    ("Too much wind", "Demasiado viento"),
    ("The animals are calm", "Los animales están tranquilos"),
    ("We need more time", "Necesitamos más tiempo"),
    ("Nobody answered", "No contestó nadie"),
    ("Change of plan", "Cambio de planes"),
    ("Bring the keys", "Traed las llaves"),
    ("The rehearsal begins", "Empieza el ensayo"),
    ("Lunch is ready", "La comida está lista"),
    ("Everyone inside", "Todos adentro"),
    ("Call the vet", "Llamad al veterinario"),
    ("Smoke seen", "Humo a la vista"),
    ("Everybody found", "Todos encontrados"),
    ("Repair needed", "Hace falta una reparación"),
    ("The show is cancelled", "Se cancela el espectáculo"),
)
"""Messages."""

FACTS: Final[tuple[tuple[str, str, str], ...]] = (
    ("Is everything on board?", "everything is on board", "todo está a bordo"),
    ("Is the box empty?", "the box is empty", "la caja está vacía"),
    ("Is the gate open?", "the gate is open", "la puerta está abierta"),
    ("Is the ground clear?", "the ground is clear", "el suelo está despejado"),
    ("May the drone go on?", "it may go on", "puede seguir"),
    ("Has the tool arrived?", "the tool has arrived", "la herramienta ha llegado"),
    ("Can you see the animal?", "the animal is in sight", "se ve el animal"),
    ("Is the fire out?", "the fire is out", "el fuego está apagado"),
    ("Is the weather good enough?", "the weather is good enough", "el tiempo es bueno"),
    ("Is the sample packed?", "the sample is packed", "la muestra está empaquetada"),
    ("Is the road free?", "the road is free", "el camino está libre"),
    ("Are the pictures sharp?", "the pictures are sharp", "las fotos son nítidas"),
    ("Is the parcel loaded?", "the parcel is loaded", "el paquete está cargado"),
    ("Has the medicine been unloaded?", "the medicine has been unloaded", "la medicina está descargada"),
    ("Is the hook fastened?", "the hook is fastened", "el gancho está sujeto"),
    ("Has the owner given permission?", "the owner has given permission", "el dueño ha dado permiso"),
    ("Do the neighbours agree?", "the neighbours agree", "los vecinos están de acuerdo"),
    ("Is the airspace reserved for us?", "the airspace is reserved for us", "el espacio aéreo está reservado"),
    ("Has the rain stopped?", "the rain has stopped", "ha dejado de llover"),
    ("Is the wind weak?", "the wind is weak", "el viento es flojo"),
    ("Has the fog lifted?", "the fog has lifted", "se ha levantado la niebla"),
    ("Are the cows inside?", "the cows are inside", "las vacas están dentro"),
    ("Are the horses calm?", "the horses are calm", "los caballos están tranquilos"),
    ("Is one of the sheep missing?", "one of the sheep is missing", "falta una oveja"),
    ("Are the spectators behind the rope?", "the spectators are behind the rope", "el público está tras la cuerda"),
    ("Have the guests left?", "the guests have left", "los invitados se han ido"),
    ("Is the barrier up?", "the barrier is up", "la barrera está levantada"),
    ("Is the lock off?", "the lock is off", "el candado está quitado"),
    ("Has the lorry gone?", "the lorry has gone", "el camión se ha marchado"),
    ("Has the train passed?", "the train has passed", "ha pasado el tren"),
    ("Is there a traffic jam?", "there is a traffic jam", "hay un atasco"),
    ("Is another picture needed?", "another picture is needed", "hace falta otra foto"),
    ("Is the camera clean?", "the camera is clean", "la cámara está limpia"),
    ("Is the patient conscious?", "the patient is conscious", "el paciente está consciente"),
    ("Is somebody hurt?", "somebody is hurt", "hay alguien herido"),
    ("Has the bleeding stopped?", "the bleeding has stopped", "ha parado la hemorragia"),
    ("Are more bandages needed?", "more bandages are needed", "hacen falta más vendas"),
    ("Is the pump repaired?", "the pump is repaired", "la bomba está reparada"),
    ("Is the power off?", "the power is off", "la corriente está cortada"),
    ("Are the spare parts right?", "the spare parts are right", "las piezas de recambio son las correctas"),
    ("Is the harvest finished?", "the harvest is finished", "ha terminado la cosecha"),
    ("Has the child been found?", "the child has been found", "el niño ha aparecido"),
    ("Is a second look wanted?", "a second look is wanted", "hace falta mirar otra vez"),
    ("Is help still needed?", "help is still needed", "todavía hace falta ayuda"),
    ("Is the choir ready?", "the choir is ready", "el coro está listo"),
)
"""Questions, and how a request speaks of them."""
