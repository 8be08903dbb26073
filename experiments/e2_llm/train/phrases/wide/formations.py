"""How many kinds of people say several machines that take their places together: tables only."""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_FORMATION: Final[Mapping[str, Both]] = {
    "line": (
        (
            "the segment from {p} to {q} is to be manned by {n} {ms} at equal intervals, altitude {h}{c}",
            "string out {n} {ms} at regular intervals from {p} as far as {q}, {h} up{c}",
            "{N} {ms}, like beads on a string: the first over {p}, the last over {q}, equal gaps, all at {h}{c}",
            "I want to see a chain of {n} {ms} in the air that begins at {p} and ends at {q}, {h} high{c}",
            "{N} {ms} share out the straight way between {p} and {q} evenly, ends included, {h}{c}",
            (
                "draw a line from {p} to {q} and have {n} {ms} hover on it at the same distance of one "
                "another, in {h} of height{c}"
            ),
            "{N} {ms}, stations equally spaced, {p} through {q}, all at {h} at one time{c}",
            "{N} {ms} form a fence in the sky, {h} up, with its ends over {p} and {q}{c}",
            "a picket line please: {p} to {q}, {n} {ms}, {h}{c}",
            "from {p} to {q} there should hover, evenly apart and {h} up, {n} {ms}{c}",
            "{N} {ms} at once, collinear between the endpoints {p} and {q}, equidistant, {h} above ground{c}",
        ),
        (
            "{n} {ms} a intervalos iguales sobre el segmento de {p} a {q}, altura {h}{c}",
            "una cadena de {n} {ms} en el aire, de {p} a {q}, a {h}{c}",
            "como cuentas en un hilo: {n} {ms}, el primero sobre {p}, el último sobre {q}, a {h}{c}",
            "{n} {ms} se reparten por igual la recta entre {p} y {q}, extremos incluidos, a {h}{c}",
            "forma con {n} {ms} una fila recta que empiece en {p} y acabe en {q}, a {h}{c}",
        ),
    ),
    "row": (
        (
            "line abreast at {p}: {n} {ms}, spacing {g}, altitude {h}{c}",
            "{N} {ms} stand shoulder to shoulder in the air at {p}, with {g} of room between neighbours, {h} up{c}",
            "park {n} {ms} in the sky in a row that starts at {p}, interval {g}, {h} high{c}",
            "{N} {ms} hover at {p} like birds on a wire, every {g} one, at {h}{c}",
            "I need {n} {ms} beside one another at {p} in a distance of {g}, and {h} of height{c}",
            "a row at {p} please, made of {n} {ms}, offset {g} from one to the following, {h} above ground{c}",
            "{N} {ms}, side by side, first one over {p}, then one each {g}, all at {h} together{c}",
            "a rank of {n} {ms} takes station at {p}; lateral separation {g}; height {h}{c}",
            "at {p} we want {n} {ms} hovering in line, leaving {g} from each to the next, {h} up{c}",
        ),
        (
            "fila en {p}: {n} {ms}, separación {g}, altura {h}{c}",
            "{n} {ms} hombro con hombro en el aire en {p}, con {g} entre vecinos, a {h}{c}",
            "{n} {ms} como pájaros en un cable en {p}, uno cada {g}, a {h}{c}",
            "en {p} quiero {n} {ms} uno al lado del otro, {g} de distancia entre ellos, a {h}{c}",
        ),
    ),
    "each": (
        (
            "every one of these places gets its own machine out of {n} {ms}: {ps}; height {h}, all at one time{c}",
            "posts to be manned at the same time by {n} {ms}, {h} up, are {ps}, one machine per post{c}",
            "{N} {ms} split up: {ps}, a single one over each, altitude {h}{c}",
            "I want to see {n} {ms} hovering {h} high, one apiece over {ps}{c}",
            "stations for {n} {ms}, {h}: {ps}, in that order, one per station{c}",
            "distribute {n} {ms} so that {ps} have one each above them, {h} up{c}",
            "a single drone of {n} {ms} goes at {h} to every one of {ps}, simultaneously{c}",
            "{N} {ms} man {ps} ({h}), nobody doubles up{c}",
            "could {ps} each have a drone overhead at {h}, {n} {ms} in all{c}",
        ),
        (
            "{n} {ms} se reparten: {ps}, uno por lugar, altura {h}, a la vez{c}",
            "puestos para {n} {ms} a {h}: {ps}, uno en cada puesto{c}",
            "cada uno de estos sitios recibe un dron de {n} {ms}: {ps}, a {h}{c}",
            "distribuye {n} {ms} de modo que haya uno sobre cada lugar, {ps}, a {h}{c}",
        ),
    ),
    "ring": (
        (
            "encircle {p}: {n} {ms}, evenly spread on a radius of {r}, altitude {h}, each holding its point{c}",
            "{N} {ms} stand about {p} like the numbers of a clock, {r} from the middle, {h} up{c}",
            "a guard of {n} {ms} hovers all round {p}, evenly, {r} out, {h} high{c}",
            "with {p} as midpoint, {n} {ms} take equal shares of a circle of radius {r} and hover there at {h}{c}",
            "{p} is to be hemmed in from all sides by {n} {ms}: {r} away, {h} up{c}",
            "I want {n} {ms} standing in the air in a ring around {p}, in the distance of {r}, {h} of altitude{c}",
            "like candles on a cake, {n} {ms} sit in the air around {p}, {r} from it, at {h}{c}",
            "{N} {ms} cordon off {p} from above at {h}, evenly placed on a circle of {r}{c}",
            "make a crown of {n} hovering {ms} above and around {p}, radius {r}, height {h}{c}",
            "circular formation, centre {p}, radius {r}, {n} {ms}, altitude {h}, stationary{c}",
        ),
        (
            "cerca {p} con {n} {ms} repartidos por igual en un radio de {r}, a {h}, quietos{c}",
            "{n} {ms} en corro alrededor de {p}, a {r} del centro y {h} de altura{c}",
            "como las horas de un reloj: {n} {ms} en torno a {p}, radio {r}, altura {h}{c}",
            "formación circular: centro {p}, radio {r}, {n} {ms}, altura {h}{c}",
            "{p} queda rodeado por {n} {ms} fijos en el aire, a {r} y a {h} de altura{c}",
        ),
    ),
    "triangle": (
        (
            (
                "{N} {ms} hover at {h} as a square corner: one over {p}, two others {r} from it, at a right "
                "angle to each other{c}"
            ),
            "make an L in the air at {h} of {n} {ms}: its corner over {p}, both its arms {r} long{c}",
            "vertex of a right angle over {p}, catheti of {r}: a {m} at each of the three points, {h} high{c}",
            (
                "one {m} stands over {p}, a second {r} away, a third also {r} away but a quarter turn round "
                "from that, all {h} up{c}"
            ),
            "{N} {ms}, altitude {h}, on the two ends and the elbow of a carpenter's square; elbow at {p}, arms {r}{c}",
            (
                "half a square, cut corner to corner: sides {r}, the right-angled corner at {p}, one of {n} "
                "{ms} at each corner, {h} up{c}"
            ),
            "at {p} two perpendicular arms begin, each {r} long; {n} {ms} stand at {p} and at the tips, {h} up{c}",
            (
                "I want to see {n} {ms} at {h}: the first over {p}, the other two at {r} from the first and "
                "in square to it{c}"
            ),
            "an isosceles right triangle of {n} {ms}, right angle at {p}, equal sides {r}, height {h}{c}",
            (
                "formation L-shape, {n} {ms}, altitude {h}: pivot over {p}, wing one {r} out, wing two {r} "
                "out, ninety degrees between{c}"
            ),
            (
                "send out three together, all {ms}, {h} up: one for {p} itself, the remaining two {r} off "
                "along lines that meet there at 90 degrees{c}"
            ),
            (
                "like the corner of a room seen from above: {p} is the corner, walls of {r} go off from it, "
                "and {n} {ms} mark the corner and the wall ends at {h}{c}"
            ),
            (
                "{N} {ms} take station at one time: over {p}, and {r} from it on two directions square to "
                "one another; all at {h}{c}"
            ),
            (
                "a right triangle, short sides both {r}, with its square corner at {p}, is to be marked in "
                "the air by {n} {ms} ({h}){c}"
            ),
            (
                "two legs of {r} meet squarely over {p}; have {n} {ms} hover, {h} up, where they meet and "
                "where they stop{c}"
            ),
            (
                "{N} {ms} make a corner like that of a sheet of paper, the corner itself over {p}, {r} along "
                "either edge, all {h} high{c}"
            ),
            (
                "post number one is {p}; posts two and three are {r} from it, seen from there at 90 degrees; "
                "{n} {ms} man them at {h}{c}"
            ),
            (
                "please bring {n} {ms} at {h} into the shape of a set square whose right angle sits on {p} "
                "and whose short sides are {r}{c}"
            ),
            "three points, three {ms}, {h}: A is {p}, B and C lie {r} from A, and the angle at A is a right one{c}",
        ),
        (
            "{n} {ms} a {h} en escuadra: uno sobre {p} y los otros dos a {r} de él, en ángulo recto{c}",
            "forma una L en el aire con {n} {ms} a {h}: la esquina sobre {p}, brazos de {r}{c}",
            "vértice del ángulo recto en {p}, catetos de {r}: un {m} en cada uno de los tres puntos, a {h}{c}",
            "medio cuadrado de lado {r} con la esquina recta en {p}: {n} {ms}, uno por esquina, altura {h}{c}",
            (
                "un {m} sobre {p}, otro a {r}, y el tercero también a {r} pero un cuarto de vuelta más allá, "
                "todos a {h}{c}"
            ),
            "dos brazos perpendiculares de {r} salen de {p}; {n} {ms} flotan en {p} y en las puntas, a {h}{c}",
            "{n} {ms} en triángulo rectángulo isósceles: ángulo recto sobre {p}, lados iguales de {r}, altura {h}{c}",
        ),
    ),
}

MORE_FORMATION_THEN: Final[Mapping[str, Both]] = {
    "wait_home": (
        (
            ". With everybody in position the clock runs for {t}; then all RTB.",
            ". When the last has arrived they hold for {t}, and all of them go back to their ports.",
            ", and stay so for {t} before everybody returns home.",
            ". Hold {t}. Recover all.",
            ". Home with all of them, though only when they have stood complete for {t}.",
            "; they keep still {t} long, all together, and after it each flies back to its own port.",
            ". I'd like a picture of this, so please {t} of standing still; home for everyone afterwards.",
            ". All there? {T} from then on, and home.",
        ),
        (
            ". Con todos en su sitio, {t}; luego todos a casa.",
            ". Mantienen la formación {t} y cada uno vuelve a su puerto.",
            ". Cuando llegue el último, {t} quietos; después regresan.",
        ),
    ),
    "home": (
        (
            ". When the last has arrived, all RTB.",
            ". As soon as everybody is in place they go back to their ports.",
            ". Once the formation is complete, all of them return home.",
            ", and when that stands, home with everybody.",
            ". All in position? Then all go home.",
            "; they wait for the slowest, then each flies back to its port.",
            ". Nobody goes home before all are there; then all do.",
        ),
        (
            ". Cuando estén todos en su sitio, vuelven a su puerto.",
            ". Se espera al último y luego todos a casa.",
            ". Con la formación completa, regresan.",
        ),
    ),
    "ask_home": (
        (
            ". In position, they await the word of {u}: {x}? Affirmative means all RTB.",
            ". They stay up until {u} gives the all-clear that {x}; home after that.",
            ". Back home only with a nod from {u} that {x}.",
            ". With all there, {u} is asked if {x}; given a yes, everybody returns to its port.",
            "; they may go home when, and only when, {u} agrees that {x}.",
            ". Query to {u} then, whether {x}. If so: home with all.",
        ),
        (
            ". Ya en posición, se pregunta a {u} si {x}; con un sí, todos a casa.",
            ". No vuelven a casa hasta que {u} dé el visto bueno: {x}.",
            ". Si {u} da luz verde ({x}), regresan todos.",
        ),
    ),
    "wait_land": (
        (
            ". With everybody in position, hold {t}; then all straight down.",
            ". {T} after the last has arrived, each sets down right below itself.",
            ", stay so for {t}, and touch down vertically, each where it hovers.",
            ". They stand for {t}. Then they sink to the ground underneath, every one at its point.",
            ". Landing on the spot for all, {t} after they are complete.",
            "; all hold {t}, all descend where they are, full stop.",
            ". Keep that picture for {t} before they all land below their positions.",
            ". When complete, count {t}, and bring each down on the ground under it.",
        ),
        (
            ". Con todos en su sitio, {t}; luego cada uno baja y aterriza justo debajo.",
            ". Aguantan {t} y se posan en vertical, cada cual en su punto.",
            ". {T} después de llegar el último, toman tierra allí mismo.",
        ),
    ),
    "ask_land": (
        (
            ". In position, clearance from {u} is awaited ({x}); with it, all straight down.",
            ". They come down below themselves only once {u} nods that {x}.",
            ". With all there, ask {u} if {x}. If so, each sets down right where it hovers.",
            "; thumbs up of {u} that {x}, and each touches down underneath its position.",
            ". Landing of all, vertically, is subject to the confirmation of {u} that {x}.",
            ". They wait in the air till {u} agrees that {x}; then to the ground, each below itself.",
        ),
        (
            ". Ya en posición, si {u} da el visto bueno ({x}), cada uno aterriza justo debajo.",
            ". Pregunta entonces a {u} si {x}; con un sí bajan en vertical y se posan allí.",
            ". No aterrizan allí mismo hasta que {u} confirme que {x}.",
        ),
    ),
    "tell_land": (
        (
            '. Once all are there, people get the message "{y}" and each sets down right below itself.',
            '; complete, they announce "{y}", then straight down to the ground with all.',
            '. When the last has arrived, send "{y}"; after that they touch down where they hover.',
            '. All in position: message "{y}". Then landing, each at its own point.',
            ', let everybody know "{y}", and land underneath their positions.',
        ),
        (
            '. Cuando estén todos, se avisa "{y}" y cada uno baja a tierra justo debajo.',
            '. En posición, mensaje: "{y}". Después aterrizan allí mismo.',
        ),
    ),
}

THEN_TOO: Final[Mapping[str, Both]] = {
    "land": (
        (
            ". Once all are in place they land there.",
            "; when every one has arrived, all land where they are.",
            ", and land on the spot when all have arrived.",
        ),
        (". Cuando hayan llegado todos, aterrizan allí mismo.", "; con todos en su sitio aterrizan donde están."),
        (
            ". Nobody comes down before all are up there; then each sets down right below itself.",
            ". All in position? Then straight down with everybody.",
            "; they wait for the slowest of them and touch down, each underneath its position.",
            ". When that picture is complete, all sink to the ground below them.",
            ". Formation complete: vertical landing of all, each on its own point.",
            ". As soon as the last has come, each one goes to ground exactly there.",
            ", and with everybody in place each makes a full stop landing on the spot.",
        ),
        (
            ". Se espera al último y cada uno baja en vertical a tierra.",
            ". Con la formación completa, cada uno se posa justo debajo.",
            ". ¿Están todos? Entonces al suelo, cada cual en su punto.",
        ),
    ),
    "tell_home": (
        (
            '. When all are there, everybody is told "{y}", and they fly home.',
            '; then they report "{y}" and all return home.',
            '. After that the message "{y}" goes out and they come home.',
        ),
        ('; avisan "{y}" y vuelven a casa.', '. Cuando estén todos, avisan "{y}" y regresan.'),
        (
            '. Formation complete: broadcast "{y}", then all RTB.',
            '. All in position, people get to hear "{y}"; home with everybody after that.',
            ', let everybody know "{y}" as soon as the last is in place, and go back to their ports.',
            '. With the last one there, send "{y}"; each then flies back to its own port.',
            '; complete, they announce "{y}" and make for home.',
        ),
        (
            '. En posición, mensaje: "{y}". Después todos a casa.',
            '. Con todos allí se anuncia "{y}" y cada uno regresa.',
        ),
    ),
}
"""More that they do then, in plain and in wide words."""
