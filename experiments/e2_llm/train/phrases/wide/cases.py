"""How very different people say what depends on people, charge and time, with the keys of `cases`: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_CASES: Final[Mapping[str, Both]] = {
    "yes_no": (
        (
            'Put this to {u}: "{question}" If the answer is yes, {a}. If the answer is no, {b}.',
            'Before anything moves, ask {u}: "{question}" Yes means: {a}. No means: {b}.',
            "It all hangs on {u}. Should {u} say that {x}, then {a}; should the answer be no, then {b}.",
            "Two plans, and {u} picks one by telling us if {x}. Plan one, for a yes: {a}. Plan two, for a no: {b}.",
            "Get an answer from {u} on whether {x}. Affirmative: {a}. Negative: {b}.",
            "Would you find out from {u} if {x}? In that case {a}, and in the other case {b}.",
            "I do not know if {x}, but {u} does, so ask. If it is so, {a}. If it is not so, {b}.",
            "Please ensure that {u} is consulted first as to whether {x}. Following a yes, {a}. Following a no, {b}.",
            "To {u} must be made the question if {x}. With answer yes, {a}. With answer no, {b}.",
            "{A}: that is for when {u} answers yes to the question if {x}. For a no it is this: {b}.",
            "{U} knows whether {x}. Thumbs up: {a}. Thumbs down: {b}.",
            "First step: call {u} and ask if {x}. Second step: after a yes {a}; after a no {b}.",
            "Depending on what {u} replies when asked if {x}: yes -> {a}; no -> {b}.",
            "Would {u} be so kind as to tell us if {x}? On a positive reply {a}; on a negative one {b}.",
            "Decision by {u}, asked once at the start: {x}, yes or no? For yes, {a}. For no, {b}.",
            "When {u} nods to the question whether {x}, {a}. When {u} shakes the head, {b}.",
        ),
        (
            "Antes de nada, que {u} diga si {x}. Si la respuesta es sí, {a}. Si es no, {b}.",
            "No sé si {x}, pero {u} lo sabe: pregúntale. Con un sí, {a}. Con un no, {b}.",
            "Todo depende de {u}: ¿{x}? En caso afirmativo, {a}. En caso negativo, {b}.",
            "Hay dos planes y elige {u}, según responda si {x}. Para el sí: {a}. Para el no: {b}.",
            "Decide {u}: si contesta que {x}, {a}; si contesta que no, {b}.",
            "Pídele a {u} una respuesta clara sobre si {x}. Afirmativo: {a}. Negativo: {b}.",
            "Lo primero, consultar con {u} si {x}; tras un sí {a}, tras un no {b}.",
        ),
    ),
    "if_yes": (
        (
            'Ask {u}: "{question}" With a yes, {a}. With a no, leave everything as it is.',
            "{A}, but only if {u}, asked beforehand, says that {x}.",
            "Do not start before you have asked {u} if {x}. If it is a yes, {a}. If it is a no, forget it.",
            "{A}. Wait, first ask {u} if {x}, and do it only if the answer is yes; with a no we do nothing.",
            "Request go / no-go from {u}: {x}? On go, {a}. On no-go, stand down.",
            "Supposing {u} tells you that {x}, {a}. Otherwise that was all.",
            "I would like the following, on the one condition that {u} says yes when asked if {x}: {a}.",
            "The permission lies with {u}, who is to be asked whether {x}: if granted, {a}; if denied, nothing at all.",
            "Is it true that {x}? Let {u} answer that. Only if it is, {a}.",
            "Only in the case that {u} answers with yes if {x}, {a}; in the other case it is made nothing.",
            "Kindly enquire of {u} whether {x}; should the reply be yes, {a}; should it be no, the matter ends there.",
            "Without a yes from {u} to the question whether {x} we stay on the ground; with it, {a}.",
            "{U} gives the green light by saying that {x}; then {a}. A red light and nothing is flown.",
            "My boss wants {u} asked first if {x}. Yes, and {a}. No, and we pack up.",
        ),
        (
            "{A}, pero solo si {u}, a quien hay que preguntar antes, dice que {x}.",
            "Antes de empezar pregunta a {u} si {x}. Si dice que sí, {a}. Si dice que no, lo dejamos.",
            "Todo depende de {u}: si contesta que {x}, {a}; si contesta que no, no se hace nada.",
            "Sin un sí de {u} a la pregunta de si {x} no se vuela; con él, {a}.",
            "¿Es verdad que {x}? Que lo diga {u}, y solo en ese caso {a}.",
            "Luz verde de {u}, es decir, que confirme que {x}: entonces {a}. Con luz roja, nada.",
            "Le ruego que consulte a {u} si {x}; con respuesta afirmativa, {a}; con negativa, nada más.",
        ),
    ),
    "battery": (
        (
            'Look at the charge first. More than {b}: {a}. Not more: tell people "{x}".',
            'Anything over {b} in the battery and {a}; otherwise just pass on "{x}".',
            'Charge check. Above {b}, {a}. Otherwise transmit "{x}".',
            'Has it got more than {b} of battery? Then {a}. Has it not? Then say "{x}" to everybody.',
            '{A}, but only if the battery shows more than {b}; otherwise we get the message "{x}".',
            'Send the message "{x}" unless there is more than {b} of charge, in which case {a}.',
            'With a battery of more than {b}, {a}. With a battery of less, to the people is said "{x}".',
            'I do not want it running dry: only above {b} of charge {a}, otherwise it is enough to announce "{x}".',
            'Please ensure that the state of charge exceeds {b}; if it does, {a}; if not, inform the team: "{x}".',
            'The battery decides. Over {b} means this: {a}. Anything else means a message: "{x}".',
            'If the charge is better than {b}, {a}; if it is worse, let me know by "{x}".',
            'Should there remain more than {b} in the battery, {a}; should there not, the word is "{x}".',
            'Minimum for the flight: more than {b} of battery. Given that, {a}. Lacking that, the notice "{x}" '
            "goes out.",
        ),
        (
            'Mira primero la carga. Más del {b}: {a}. Si no llega: avisa con "{x}".',
            '¿Tiene más del {b} de batería? Entonces {a}. ¿No? Entonces di a todos "{x}".',
            'La batería decide: por encima del {b}, {a}; en otro caso, mensaje "{x}".',
            'Manda el aviso "{x}", salvo que quede más del {b} de carga; en ese caso {a}.',
            'Si la carga supera el {b}, {a}. De lo contrario, comunica a la gente "{x}".',
            'No quiero que se quede sin pilas: solo si pasa del {b} de batería, {a}; si no, di "{x}".',
            'Con la batería a más del {b}, {a}; con menos, basta con anunciar "{x}".',
        ),
    ),
    "charged": (
        (
            "Not yet! Let {m} charge until it shows {b} or more; after that {a}.",
            "Hold the start till {m} has {b} or more in the battery. Then {a}.",
            "Battery of {m} at {b} or above: that is the signal. At that moment {a}.",
            "{A}, though not before the battery of {m} has climbed to {b}.",
            "Leave {m} on charge. At {b}, go: {a}.",
            "Be patient until {m} is {b} full or fuller, and then {a}.",
            "Departure is upon the battery of {m} reaching {b}; {a}.",
            "When the battery of {m} will have {b} at the minimum, {a}. Before, wait.",
            "Please ensure that {m} waits for a charge of at least {b}. Thereafter {a}.",
            "Keep waiting as long as the battery of {m} is under {b}; once it is no longer, {a}.",
            "I want at least {b} of charge in {m} first, however long it takes; then {a}.",
        ),
        (
            "Todavía no: deja que {m} llegue al {b} de batería o más; después {a}.",
            "Salida cuando la carga de {m} alcance el {b}. Entonces {a}.",
            "{A}, pero no antes de que la batería de {m} esté al {b} o más.",
            "Mientras {m} tenga menos del {b} de carga, a esperar; luego {a}.",
            "Ten paciencia hasta que {m} esté al {b} de batería por lo menos, y entonces {a}.",
            "Quiero primero un mínimo del {b} de carga en {m}; a continuación {a}.",
        ),
    ),
    "again": (
        (
            "Keep at it: {a}, and every {t} anew, till the count is complete, which is to say {n}.",
            "Sortie plan: {n}, launch interval {t}. Each sortie: {a}.",
            "I have to see it change with time, so {n}, one every {t}: {a}.",
            "Repeat at {t} intervals until done {n}: {a}.",
            "Every {t} the same: {a}. That {n}, no more.",
            "{A}. Do it {n} altogether, starting one every {t}.",
            "Like a clock: each {t}, {a}; stop when that has been done {n}.",
            "A flight every {t}, to be flown {n}: {a}.",
            "Repeat {n} with an interval of {t}: {a}.",
            "{A}. I want to see this {n}, with {t} from one start to the next.",
            "Schedule: {n}, period {t}. Each time {a}.",
            "So it goes {n}, always after {t} again: {a}.",
            "Loop: {n}. Interval: {t}. Content: {a}.",
            "Kindly arrange that {n}, and each time {t} after the last start, {a}.",
            "On a timer of {t}, {n} in total, {a}.",
            "{A}; {t} after that began, again; and so on until it has happened {n}.",
            "The following has to occur {n}, one start every {t}: {a}.",
            "Each {t} one time, together {n}: {a}.",
            "Set the alarm to {t}. Whenever it goes off {a}. After it was done {n} we are finished.",
        ),
        (
            "Plan de salidas: {n}, una cada {t}. En cada salida {a}.",
            "Quiero ver cómo cambia con el tiempo; por eso, {n} y cada {t}, {a}.",
            "Como un reloj, cada {t}: {a}. Así {n} en total.",
            "{A}. Hazlo {n}, con {t} entre una salida y la siguiente.",
            "Programa: {n}, una salida cada {t}. Cada vez {a}.",
            "Un vuelo cada {t}, {n} en total: {a}.",
            "Repite {n}, con un intervalo de {t}, lo siguiente: {a}.",
            "{A}; y así cada {t} hasta que se haya hecho {n}.",
            "Que esto ocurra {n}, a razón de uno cada {t}: {a}.",
        ),
    ),
    "escalate": (
        (
            'Ask {u} first: "{question}" No yes? Then the same question goes to {v}. With one yes, {a}.',
            "One yes is enough: first {u} is asked if {x}, and only without a yes {v} is asked too. Then {a}.",
            "{U} is my first choice, {v} my second. If the first does not confirm that {x}, ask the second. "
            "Given a yes, {a}.",
            "{A}, once {u} has agreed that {x}; if {u} does not, ask {v}, whose yes will also do.",
            "Go down the list: {u}, then, failing a yes, {v}. The question is whether {x}. When somebody said "
            "yes, {a}.",
            "Try {u} with the question if {x}. Does no yes come, try {v} with the same. With a yes of one of both {a}.",
            "Primary: {u}. Backup: {v}, asked only if the primary does not say yes. Question: {x}? After a yes, {a}.",
            "Please ensure that {u}, or in the absence of a yes {v}, has confirmed that {x}. Thereafter {a}.",
            "Has {u} said that {x}? Fine, {a}. If not, perhaps {v} says it when asked; then likewise {a}.",
            "Would {u} confirm that {x}? Otherwise bother {v} with it. As soon as either says yes, {a}.",
            "Before {a}, {u} has to say that {x}; unless there is a yes, it is {v} who is asked and has to say it.",
        ),
        (
            "Con un sí basta: primero pregunta a {u} si {x}; si no dice que sí, pregunta lo mismo a {v}. Después {a}.",
            "Titular: {u}. Suplente: {v}, solo si el primero no dice que sí. La pregunta es si {x}. Tras un sí, {a}.",
            "{A}, cuando {u} confirme que {x}; si no lo confirma, se pregunta a {v} y vale su sí.",
            "Prueba con {u}: ¿{x}? Si no llega un sí, prueba con {v}. Con el sí de uno de los dos, {a}.",
            "¿Dice {u} que {x}? Entonces {a}. Si no, pregunta a {v}, y con su sí también {a}.",
        ),
    ),
    "refused": (
        (
            '{A}. Ask {u}: "{question}" A no is passed on as "{y}". Whatever the answer, it flies home at the end.',
            '{A} and puts the question to {u} whether {x}. If that is denied, tell people "{y}". It goes home anyhow.',
            '{A}. Then find out from {u} if {x}. Negative: send "{y}". After that, home, no matter what was said.',
            '{A}, then has {u} asked if {x}; should the reply be no, "{y}" is announced; the return home takes '
            "place regardless.",
            "Afterwards it comes home with a yes as with a no; but first {a}, and {u} is asked if {x}, and on "
            'a no we hear "{y}".',
            '{A}. In the middle comes a question to {u}: is it so that {x}? On a no, write "{y}" to all. Home '
            "it flies in each case.",
            '{A}; next, {u} is to say whether {x}; only a no leads to the message "{y}"; either answer leads home.',
            '{A}. Then {u} gets asked if {x}. If no: "{y}". Yes or no, the machine heads home.',
            '{A}. I need to hear from {u} if {x}. Just a no makes it say "{y}", and both answers make it return home.',
            '{A}, consults {u} on whether {x}, reports "{y}" if the answer is no, and returns home, be the '
            "answer yes or no.",
        ),
        (
            '{A}. Luego {u} tiene que decir si {x}; si es que no, mensaje "{y}". Con sí o con no, vuelve a casa.',
            '{A} y consulta a {u} si {x}. Una negativa se comunica así: "{y}". Al final regresa a casa pase lo '
            "que pase.",
            '{A}. En medio viene una pregunta a {u}: ¿{x}? Con un no, di a todos "{y}". A casa vuelve en ambos casos.',
            '{A}; después, pregunta a {u} si {x}. Si lo niega, anuncia "{y}". La vuelta a casa se hace igualmente.',
        ),
    ),
    "follow": (
        (
            "{A} stays with {u} the way the tracker shows, {h} high, with a new fix every {t}. Once in range, go home.",
            "Shadow {u} with {a} at {h}: query the tracker every {t}, fly where it says, stop when it reports "
            "in range, then home.",
            "{U} is walking somewhere. Let {a} go after the tracker, {h} up, asking again each {t}; in range = "
            "finished, home.",
            "Tracker of {u}: fix every {t}. {A} flies to each fix at {h}. Break off when in range. Then home.",
            "Like a dog, {a} runs after {u}, {h} high, sniffing the tracker every {t}, until it is in range, "
            "and trots home.",
            "Where is {u}? {A} finds out by the tracker: each {t} a new bearing, flown at {h}, until in range; "
            "then it returns home.",
            "The tracker of {u} leads {a} at the height of {h}. It is to ask each {t}. When the tracker says "
            "in range, return to home.",
            "Please ensure that {a} follows {u} at {h} by means of the tracker, refreshed every {t}, until in "
            "range; it then flies home.",
            "Every {t} the tracker of {u} tells {a} where to go, {h} above ground. That ends with in range. "
            "After it, home.",
        ),
        (
            "{A} va tras {u} a {h}: cada {t} mira el localizador y vuela adonde diga; cuando esté en rango, a casa.",
            "Localizador de {u}: lectura cada {t}. {A} vuela a cada lectura a {h}. Al estar en rango, fin y a casa.",
            "¿Dónde está {u}? Que lo diga su localizador cada {t}: {a} lo sigue a {h} hasta estar en rango y "
            "regresa a casa.",
            "Como un perro, {a} sigue a {u} a {h}, con una lectura del localizador cada {t}, hasta el rango; "
            "luego vuelve a casa.",
        ),
    ),
}
"""English ones may have `{question}`: the question itself, which there is in English only."""

SENDING: Final[Both] = (("send the word: {x}",), ("di: {x}",))
"""What happens on a no when nothing is flown."""
MORE_SENDING: Final[Both] = (
    (
        'people get the message "{x}"',
        'tell everybody "{x}"',
        'just the notice "{x}" goes out',
        'it is enough to announce "{x}"',
        'inform all of "{x}"',
        'write "{x}" to the team',
    ),
    ('avisa a todos: "{x}"', 'basta con anunciar "{x}"', 'manda el mensaje "{x}"', 'que la gente sepa esto: "{x}"'),
)
