"""How people say an answer in the middle that starts a second machine, or decides about what was told before: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

SECOND: Final[Mapping[str, Both]] = {
    "keeps": (
        (
            "{A} {k} and stays up there. Meanwhile ask {u} if {x}; on a yes {b} {d}. At the end {a_} comes home.",
            "{A} {k} and keeps watching. If {u} says that {x}, {b} {d}. After that {a_} goes home, yes or no.",
            "{A} {k} and holds there while {u} is asked if {x}. Only with a yes {b} {d}. Last of all {a_} "
            "returns home.",
            "{A} {k} and waits. {U} decides if {x}: with a yes {b} {d}. In any case {a_} then flies home.",
        ),
        (
            "{A} {k} y se queda arriba. Mientras, pregunta a {u} si {x}; con un sí, {b} {d}. Al final {a_} "
            "vuelve a casa.",
            "{A} {k} y sigue vigilando. Si {u} dice que {x}, {b} {d}. Después {a_} vuelve a casa en todo caso.",
        ),
        (
            "I want eyes in the sky first: {a} {k} and does not leave. Then the question to {u} whether {x}. "
            "Yes: {b} {d}. "
            "When that is over, or after a no, {a_} comes home.",
            "Overwatch by {a}: it {k} and holds. Ask {u}: is it so that {x}? Affirm, and {b} {d}. Negative, "
            "and it does not. "
            "Either way {a_} recovers home last.",
            "{A} {k} and remains on watch there. Does {u} confirm that {x}? Then, under its eyes, {b} {d}. "
            "With yes and with no {a_} flies home when all is done.",
            "{A} {k} and stays in the air there till the end. {B} {d}, but only if {u}, asked in between, says "
            "that {x}. "
            "Whatever was said, {a_} goes home last.",
            "First machine: {a} {k} and hangs on up there. Second machine: if {u}, who is asked then, says "
            "that {x}, {b} {d}. "
            "Finally {a_} returns home in both cases.",
            "Please ensure that {a} {k} and remains there as a guard. Thereafter {u} is asked whether {x}; "
            "given a yes, {b} {d}. "
            "Whether or not, {a_} comes home at the end.",
            "One keeps watch: {a} {k}. One waits for its turn: after a yes of {u} to the question if {x}, {b} {d}. "
            "The watch ends with the flight home of {a_}, with a yes as with a no.",
            'While {a} {k} and stays over it, put to {u}: "{question}" On a yes {b} {d}. When this is finished, '
            "or nothing was to do, {a_} goes to home.",
        ),
        (
            "Quiero ojos en el aire: {a} {k} y no se va. Luego, la pregunta a {u} de si {x}. Con un sí, {b} {d}. "
            "Al final, con sí o con no, {a_} vuelve a casa.",
            "{A} {k} y se queda en el aire hasta el final. {B} {d}, pero solo si {u}, preguntado entretanto, "
            "dice que {x}. "
            "Diga lo que diga, {a_} vuelve a casa el último.",
            "Uno monta guardia: {a} {k}. El otro espera: tras un sí de {u} a si {x}, {b} {d}. "
            "Sea cual sea la respuesta, al final {a_} regresa a casa.",
        ),
    ),
    "both": (
        (
            "Ask {u} if {x}. If so, {b} {d}, and at the same time {a} {k} and comes home. If not, nobody flies.",
            "Only if {u} says that {x}: {b} {d} while {a} {k} and returns home. Otherwise nothing happens.",
            "{U} is asked whether {x}. On a yes, both at once: {b} {d}; {a} {k} and goes home. On a no all "
            "stay where they are.",
            "With a yes of {u} to the question if {x}, {b} {d}; meanwhile {a} {k} and flies home. With a no "
            "nothing takes off.",
        ),
        (
            "Pregunta a {u} si {x}. Si es así, {b} {d} y a la vez {a} {k} y vuelve a casa. Si no, no vuela nadie.",
            "Solo si {u} dice que {x}: {b} {d} mientras {a} {k} y vuelve a casa. Si no, nada.",
        ),
        (
            "Rescue plan, to be released by {u}, who must say that {x}. Then {b} {d}; as a lookout from above, "
            "in the same time, "
            "{a} {k} and comes home. Not released: all stay on the ground.",
            'Put it to {u}: "{question}" A yes starts two machines at the same moment: {b} {d}, and {a} {k} '
            "and returns home. "
            "A no starts none.",
            "{B} {d}. It has a helper in the sky: simultaneously {a} {k}, then home. But all that only if {u} "
            "has been asked "
            "and says that {x}; after a no we leave it.",
            "{U} says yes or no to the question if {x}. No: nothing at all. Yes: two flights in parallel, in "
            "one of which "
            "{b} {d}, and in the other {a} {k} and goes home.",
            "Once {u} has agreed that {x}, let two start together: {b} {d}; {a} {k} and goes home. "
            "Should {u} say no, forget the whole thing.",
            "Go / no-go by {u} ({x}, or not). On go, concurrently: {b} {d}; {a} {k}, RTB. On no-go, stand down.",
        ),
        (
            "Plan de rescate, si {u} dice que {x}: {b} {d}; al mismo tiempo, desde arriba, {a} {k} y vuelve a casa. "
            "Con un no, todos en tierra.",
            "Que {u} diga si {x}. No: nada. Sí: dos vuelos en paralelo; en uno {b} {d}, en el otro {a} {k} y "
            "vuelve a casa.",
        ),
    ),
    "joins": (
        (
            "Ask {u} if {x}. Whatever the answer, {b} {d}; only on a yes, at the same time, {a} {k} and comes home.",
            "First {u} says whether {x}. In any case {b} {d}. If it is a yes, meanwhile {a} {k} and returns home.",
            "Ask {u} if {x}. If so, {b} {d} while {a} {k} and flies home. If not, {b_} does its flight alone.",
            "{U} is asked whether {x}. Yes: {b} {d}, and at the same time {a} {k} and goes home. No: {b_} "
            "flies all the same, alone.",
        ),
        (
            "Pregunta a {u} si {x}. En todo caso {b} {d}; solo con un sí, a la vez, {a} {k} y vuelve a casa.",
            "Pregunta a {u} si {x}. Si es así, {b} {d} mientras {a} {k} y vuelve a casa. Si no, {b_} vuela "
            "igual, pero solo.",
        ),
        (
            "{B} {d}, that much is certain. Whether it has company is for {u} to say, who is asked before the "
            "start if {x}: "
            "on a yes, in the same time, {a} {k} and goes home; on a no it is alone.",
            "Before take-off, the question to {u}: is it so that {x}? Affirm: {b} {d}, concurrently {a} {k}, RTB. "
            "Negative: only {b_} flies, the same as above.",
            "A second pair of eyes depends on {u}. With or without it {b} {d}; but if {u}, asked at the very "
            "beginning, "
            "says that {x}, then alongside {a} {k} and returns home.",
            'Start with a question to {u}: "{question}" With a no, one flight: {b} {d}. With a yes, the same '
            "flight and another one "
            "at the same time: {a} {k} and comes home.",
            "Please ensure that {u} is first consulted on whether {x}. {B} {d} regardless of the reply. In parallel, "
            "given a positive reply only, {a} {k} and comes home.",
            "There is one job and perhaps a helper. The job: {b} {d}. The helper, at the same time and only "
            "after {u} was asked "
            "at the start and has said that {x}: {a} {k}, then home.",
            "Before all, {u} must tell if {x}. By yes start two together: {b} {d}, {a} {k} and goes to home. "
            "By no starts only {b_} and makes the same.",
        ),
        (
            "{B} {d}, eso seguro. Que vaya acompañado lo decide {u}, a quien se pregunta antes si {x}: con un sí, "
            "al mismo tiempo, {a} {k} y vuelve a casa; con un no, va solo.",
            "Antes de despegar, pregunta a {u} si {x}. Con un no, un vuelo: {b} {d}. Con un sí, ese mismo "
            "vuelo y otro a la vez: "
            "{a} {k} y regresa a casa.",
            "Hay un trabajo y quizá un ayudante. El trabajo: {b} {d}. El ayudante, a la vez y solo si {u}, "
            "preguntado al principio, "
            "dice que {x}: {a} {k} y a casa.",
        ),
    ),
    "earlier": (
        (
            "{A} {c} and after that {d}, but the second only if {u} says that {x}. It comes home in any case.",
            "{A} {c}; then it {d}, too, but only if {u}, asked in between, confirms that {x}. Home either way.",
            "{A} {c}. Then ask {u} if {x}; only with a yes it {d}. In both cases it returns home.",
            "{A} {c}, then {d} and comes home; leave the second part out unless {u} then says that {x}.",
        ),
        (
            "{A} {c} y después {d}, pero lo segundo solo si {u} dice que {x}. Vuelve a casa en todo caso.",
            "{A} {c}. Luego pregunta a {u} si {x}; solo con un sí {d}. En ambos casos vuelve a casa.",
        ),
        (
            "Two legs for {a}. Leg one: it {c}. Leg two, flown only if {u} on request reports that {x}: it "
            "{d}. RTB anyway.",
            "{A} {c}. There it stops to think: {u} is asked if {x}. Yes, and it {d}. No, and it does not. Home "
            "it goes both times.",
            "{A} {c}, {d}, returns home. The middle one of these three needs a yes from {u} to the question "
            "whether {x}, "
            "to be asked just before; lacking it, go home at once.",
            "{A} {d}, but only under the condition that {u} says that {x}, and that is asked not at the start "
            "but after it {c}. "
            "The end is the way home, with the one answer and with the other.",
            '{A} {c}. Next, the question for {u}: "{question}" If the answer is yes, it {d}. Whatever the '
            "answer, home.",
            "Please have it so: {a} {c}; {u} is then consulted on whether {x}; if so, it {d}; finally, if so "
            "or not, it comes home.",
            "{A} {c}, and, should {u} then reply that {x}, {d}, too. Otherwise it skips that. Finish: home.",
            "After {a} {c}, {u} gets a say: if {x}, it {d}, and if not, not. Then it returns to home, in all cases.",
            "The extra is that it {d}. {U} grants the extra by saying that {x} when asked, and that is after {a} {c}. "
            "Extra or no extra, it flies home last.",
            "{A} {c}. What follows depends on {u} being asked whether {x}. After a yes it {d} and then goes home. "
            "After a no it goes home directly.",
        ),
        (
            "{A} {c}. Lo que sigue depende de {u}: si dice que {x}, {d} y luego vuelve a casa; si dice que no, "
            "vuelve directamente.",
            "Dos tramos para {a}. Primero: {c}. Segundo, solo si {u}, al preguntarle entonces, dice que {x}: "
            "{d}. Y a casa siempre.",
            "{A} {c}, {d} y vuelve a casa; lo de en medio, solo si {u}, preguntado justo antes, confirma que {x}.",
        ),
    ),
}
"""`{k}`, `{c}`: what the first one does; `{d}`: what an answer decides; `{a_}`, `{b_}`: who was named first."""
BOTH_AGREE: Final[Both] = (
    (
        "First {u} must confirm that {x}, then {v} that {y}; only then {a}.",
        "Wait until {u} says that {x} and after that until {v} says that {y}. Then {a}.",
        "Ask {u} if {x}. After a yes ask {v} if {y}. With both yeses {a}.",
        "{A}, but only after {u} has confirmed that {x} and, asked next, {v} that {y}.",
    ),
    (
        "Primero {u} debe confirmar que {x}, luego {v} que {y}; solo entonces {a}.",
        "Pregunta a {u} si {x}. Tras un sí, pregunta a {v} si {y}. Con los dos síes, {a}.",
    ),
    (
        "Two signatures are needed, in this order. {U}: {x}. {V}: {y}. With both of them {a}.",
        "Two keys open the lock: the word of {u} that {x}, and, asked second, the word of {v} that {y}. Then {a}.",
        "Go round and ask: {u} first, whether {x}, and {v} afterwards, whether {y}. When both have said yes, {a}.",
        "Poll {u}: {x}? Affirm. Then poll {v}: {y}? Affirm. Given these two, in that sequence, {a}.",
        "Please ensure that {u} has confirmed that {x} prior to {v} being asked to confirm that {y}; thereafter {a}.",
        "{A}. It may not start before {u} agrees that {x}; and when that is given, {v} has still to agree that {y}.",
        "Has {u} said that {x}? Good, then to {v} is made the next question, if {y}. Also yes? Then {a}.",
        "One yes is not enough: I need it from {u}, for the question whether {x}, and then from {v}, for whether {y}. "
        "Having got the two, {a}.",
    ),
    (
        "Hacen falta dos firmas, por este orden. {U}: que {x}. {V}: que {y}. Con ambas, {a}.",
        "Un sí no basta: primero el de {u} a si {x} y luego el de {v} a si {y}. Con los dos, {a}.",
        "¿Ha dicho {u} que {x}? Bien: entonces se pregunta a {v} si {y}. ¿También sí? Pues {a}.",
        "{A}, pero no antes de que {u} conteste que sí a si {x} y, preguntado después, {v} que sí a si {y}.",
    ),
)
"""Two people are asked, one after the other."""
FIRST_AGAIN: Final[Both] = (
    ("the first one", "the first machine"),
    ("el primero", "el primer dron"),
)
HOVERS: Final[Both] = (
    ("flies to {p} at {h}", "takes its position over {p}, {h} up", "hovers above {p} at {h}", "goes over {p} at {h}"),
    ("vuela a {p} a {h}", "se coloca sobre {p} a {h}"),
    (
        "climbs to {h} over {p}",
        "stands in the air at {h} above {p}",
        "takes station overhead {p}, altitude {h},",
        "is the lookout above {p}, {h} from the ground,",
        "looks down at {p} from {h}",
        "hangs over {p} like a lamp, {h} high,",
    ),
    ("se planta en el aire a {h} sobre {p}", "mira {p} desde {h}", "ocupa su puesto encima de {p}, a {h} de altura,"),
)
"""`{k}` of a machine that stays there until more is said."""
