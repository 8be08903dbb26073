"""How very different people say parked machines and rounds: tables only.

The keys are those of `turns`.
"""

from collections.abc import Mapping
from typing import Final

from experiments.e2_llm.train.phrases import Both

MORE_PARKED: Final[Mapping[str, Both]] = {
    "two": (
        (
            "I want to see {a} and {b} standing on the ground at {p}, {g} from one to the other{e}.",
            "{P} is the parking place: {a} and {b} go down there with a gap of {g}{e}.",
            "Touchdown at {p} for {a} and {b}, spacing {g}, and they remain down{e}.",
            "Like two parked cars, {a} and {b} stand on the ground at {p}, {g} apart{e}.",
            "At {p}, {a} and {b} are landed as neighbours at a distance of {g} and left standing{e}.",
            "To both {a} and {b}: land by {p}, leave {g} between you, stay down{e}.",
            "A pair on the ground at {p}: {a} and {b}, {g} of room between them{e}.",
            "{A} lands at {p}, {b} lands {g} beside it, and both stay on the ground{e}.",
            "{A} and {b} have to sit down by {p} in the distance of {g} one to the other{e}.",
            "Please ensure that {a} and {b} are on the ground at {p} with a clearance of {g}{e}.",
            "Give me {a} and {b} sitting on the ground at {p} like two hens, {g} apart{e}.",
            "{P}, full stop, {a} plus {b}, {g} separation on the ground{e}.",
        ),
        (
            "Quiero ver {a} y {b} posados en {p}, con {g} de uno a otro{e}.",
            "{A} aterriza en {p}, {b} a {g} de él, y ahí siguen los dos{e}.",
            "Como dos coches aparcados: {a} y {b} en el suelo en {p}, separados {g}{e}.",
            "{P} es el aparcamiento de {a} y {b}, con un hueco de {g}: aterrizan y no se mueven{e}.",
            "Toma de tierra en {p} para {a} y {b}, separación {g}, y en tierra siguen{e}.",
            "Asegúrate de que {a} y {b} estén en tierra en {p}, a una distancia de {g}{e}.",
        ),
    ),
    "more": (
        (
            "I want to see {n} {ms} standing in a row at {p}, {g} from one to the next{e}.",
            "Line {n} {ms} up on the ground at {p}, a gap of {g} between neighbours{e}.",
            "{P}: touchdown of {n} {ms}, spacing {g}, and they remain down{e}.",
            "Like parked cars, {n} {ms} stand on the ground at {p} with {g} from each to the next{e}.",
            "At {p} there should be {n} {ms} parked, {g} of room between them{e}.",
            "{N} {ms} make a row on the ground by {p}; leave {g} each time between two{e}.",
            "Like pearls on a string, {g} apart, {n} {ms} sit on the ground at {p}{e}.",
            "Please ensure that {n} {ms} are on the ground at {p} with a clearance of {g}{e}.",
            "Use {n} {ms}. They land at {p}, each {g} beside the last one, and stay down{e}.",
            "{N} {ms} have to sit down by {p} in the distance of {g} the one to the other{e}.",
            "{P} gets {n} {ms} on its ground, {g} from machine to machine{e}.",
        ),
        (
            "Quiero ver {n} {ms} posados en fila en {p}, con {g} de uno a otro{e}.",
            "Como coches aparcados: {n} {ms} en el suelo en {p}, separados {g}{e}.",
            "Forma una fila de {n} {ms} en tierra en {p}, dejando {g} entre cada dos{e}.",
            "{N} {ms} toman tierra en {p}, separación {g}, y en tierra siguen{e}.",
            "Asegúrate de que haya {n} {ms} en tierra en {p}, a una distancia de {g}{e}.",
        ),
    ),
    "good": (
        (
            "; nobody flies back",
            ", and that is the end of it",
            " permanently",
            ", without any return",
            "; I will collect them by hand",
            ", to be picked up by car some day",
            "; engines off, job done",
        ),
        (
            "; nadie vuelve",
            ", y ahí acaba todo",
            " de forma permanente",
            ", sin regreso",
            "; ya los recogeré yo a mano",
        ),
    ),
    "home": (
        (
            " for {t}, whereupon they return to their ports",
            " while {t} go by; the flight home follows",
            "; after {t} on the ground, everybody home",
            "; {t} later it is time to fly home",
            ". Time on the ground: {t}. Then home with them",
            " during {t} and after to home",
        ),
        (
            "; a los {t}, todos a casa",
            ". Tiempo en tierra: {t}. Después regresan a casa",
            "; pasados {t}, cada cual vuelve a su puerto",
            " por espacio de {t}, tras lo cual regresan a casa",
        ),
    ),
    "ask_home": (
        (
            "; when {u}, on being asked, says that {x}, they fly home",
            ". Ask {u} if {x}; with the yes they return home",
            ". The way home is free once {u} has confirmed that {x}",
            "; {u} sends them home by saying that {x}",
            ", and nobody goes home before {u} has answered yes to the question if {x}",
        ),
        (
            ". Pregunta a {u} si {x}; con el sí vuelven a casa",
            "; no vuelven a casa antes de que {u} diga que sí a la pregunta de si {x}",
            ". La vuelta a casa empieza con el sí de {u} a si {x}",
        ),
    ),
}

MORE_ROUNDS: Final[Mapping[str, Both]] = {
    "stops_pass": (
        (
            "Waypoints for {a}: {ps}. Constant {h}, no holding anywhere, recover at home.",
            "{A} strings these together at {h} without ever stopping: {ps}. Then it flies home.",
            "{A} flies by {ps}, keeps moving, keeps {h}, keeps that order, and ends at home.",
            "Postman's round by {a}, but nobody gets off: {ps}, all of it {h} high, then home.",
            "Overfly in sequence with {a}: {ps}. Altitude {h}. No dwell. RTB.",
            "The order is {ps}. {A} goes along it in the height of {h}, does not stop, and returns to home.",
            "I drew a line through {ps} on my map; let {a} follow it {h} up in one go and come home.",
            "A non-stop flight of {a} over {ps} at {h}, in exactly this order, with the return home at the end.",
        ),
        (
            "Puntos de paso de {a}: {ps}. Siempre a {h}, sin detenerse en ninguno, y regreso a casa.",
            "{A} enlaza de un tirón {ps}, por ese orden y a {h}, y vuelve a casa.",
            "Vuelo sin paradas de {a} por {ps}, altura {h}, y al final a casa.",
            "He trazado una línea por {ps}: que la siga {a} a {h} sin parar, y a casa.",
        ),
    ),
    "stops_ground": (
        (
            "Deliveries for {ps}, in that order, by {a}: land, {t} to unload on the ground, on to the next; home.",
            "Intermediate landings of {a} at {ps}, one after another, ground time {t} apiece, final landing at home.",
            "{A} plays postman: down at {ps}, in sequence, {t} on the ground by each letter box, and then home.",
            "Could {a} call at {ps}, in the order given, with its legs on the ground for {t} at each, before it flies home?",
            "Bus line of {a}: {ps}. At every stop it stands on the ground for {t}. Terminus: home.",
            "Full-stop landings with {a} at {ps}, in this sequence, {t} on the deck each time; then RTB.",
            "I have something to load at {ps}. {A} lands at each in that order, waits {t} on the ground, and "
            "finally flies home.",
            "{A} hops from one to the next and rests {t} on the ground every time: {ps}. Then home.",
            "Landing, {t} of pause, next one: that is how {a} does {ps}. Home to finish.",
            "{Ps}, in this order: on each of them {a} is put down for {t}, and at the end it goes to home.",
            "Milk round. {A} sets down at {ps}, one by one, {t} of standing per place, home afterwards.",
            "Please ensure that {a} lands in turn at {ps}, remaining {t} on the ground at each, prior to "
            "returning home.",
            "Let {a} come down at every one of these, first to last, with a stay of {t} on the ground: {ps}. "
            "Then back home.",
            "People are waiting at {ps}. {A} should land at each of those, one after the other, give them {t}, "
            "and then go home.",
        ),
        (
            "{A} hace de cartero: baja al suelo en {ps}, uno tras otro, {t} en cada uno, y después a casa.",
            "Repartos en {ps}, justo en ese orden: {a} aterriza, espera {t} en tierra y sigue con el próximo; al final a casa.",
            "Línea de autobús de {a}: {ps}. En cada parada, {t} en el suelo. Final: a casa.",
            "{A} va saltando de uno a otro y descansa {t} en tierra en cada uno: {ps}. Luego a casa.",
            "Aterrizar, {t} de pausa, el siguiente: así hace {a} {ps}. Al terminar, a casa.",
            "Hay gente esperando en {ps}. Que {a} aterrice en cada uno por ese orden, espere {t} en tierra y "
            "vuelva a casa.",
            "Tomas de tierra de {a} por este orden: {ps}. Estancia en el suelo: {t} en cada una. Y a casa.",
        ),
    ),
    "stops_ring": (
        (
            "One three-sixty around each with {a}, radius {r}, {h} high, in this sequence: {ps}. Then RTB.",
            "Merry-go-round for {a}: first to last {ps}, one turn about each, {r} from the middle, {h} above "
            "ground; then home.",
            "{Ps} are the centres. {A} draws one circle round each in turn, radius {r}, altitude {h}, and flies home.",
            "Single orbits by {a}: {ps}. All of them {r} in radius and at {h}. Home last.",
            "{A} goes once around each, one after the other: {ps}. It keeps {r} away and {h} up, and returns "
            "home at the end.",
            "Please make with {a} one tour around each of {ps}, in the distance of {r} and the height of {h}, "
            "then home.",
            "Every one of these is circled one time by {a} in the order given, {r} out at {h}: {ps}. After that, home.",
            "I would like to see all sides of {ps}. Thus {a} flies a circle of radius {r} round each in turn "
            "at {h} and comes home.",
        ),
        (
            "Un giro completo de {a} alrededor de cada uno, radio {r}, altura {h}, por este orden: {ps}. Luego a casa.",
            "Los centros son {ps}: {a} traza un círculo en torno a cada uno, de {r} de radio y a {h}, y vuelve a casa.",
            "Como un tiovivo: {a} rodea una vez cada sitio, {ps}, a {r} del centro y {h} de altura; después a casa.",
            "Quiero ver todos los lados de {ps}: {a} da una vuelta a cada uno con radio {r} a {h}, y a casa.",
        ),
    ),
    "stops_two": (
        (
            "Split the work: {a} takes {ps}; {b} takes {qs}. Both start together, fly {h} high, hover {t} at "
            "each, go home.",
            "{H}, {t} per waypoint, simultaneous, RTB. {A}: {ps}. {B}: {qs}.",
            "While {a} is at its list ({ps}), {b} is at its own ({qs}); each keeps to the order, {h} up, {t} a "
            "place, home last.",
            "List one, for {a}: {ps}. List two, for {b}: {qs}. Work both off at the same time from {h}, {t} "
            "each, then home.",
            "The two fly together in time: {a} by {ps}; {b} by {qs}. Height {h}, pause {t} on each, after it to home.",
            "Please ensure that {a} ({ps}) and {b} ({qs}) do their rounds concurrently at {h}, hold {t} at "
            "each, and return home.",
        ),
        (
            "Reparte el trabajo: {a} se ocupa de {ps}; {b}, de {qs}. Salen a la vez, a {h}, {t} sobre cada "
            "sitio, y a casa.",
            "Lista de {a}: {ps}. Lista de {b}: {qs}. Las dos a la vez, a {h}, {t} en cada punto, y regreso a casa.",
            "Mientras {a} hace {ps}, {b} hace {qs}; ambos a {h}, {t} por sitio, y al final a casa.",
        ),
    ),
    "there_back": (
        (
            "Over {p} {a} begins, {h} high. It then visits {q} and comes back over {p}, and does so {n}. Home to finish.",
            "Like a ball between two players: from {p}, where {a} starts, to {q} and back to {p}, {n}, {h} up; then home.",
            "First to {p}. Loop ({n}): to {q}, to {p}. All at {h}, by {a}. Last: home.",
            "{A} reports over {p} at {h}; from there it flies the leg to {q} and back {n}; RTB.",
            "Ping-pong for {a}: it begins at {p}, and {n} it goes over to {q} and back to {p}. {H} up "
            "throughout, then home.",
            "Like a pendulum, {a} swings out from {p} to {q} and back again {n}, {h} high. Home when done.",
            "{P} is one end, {q} the other. {A} starts at the first and does the return trip {n} at {h}. "
            "Afterwards home.",
            "The round trip {p} - {q} - {p} is flown {n} by {a} at {h}. Then it returns home.",
            "{N} there and {n} back, that is what {a} does between {p}, where it begins, and {q}, {h} up; "
            "finally home.",
            "Pendulum route with {a}, height {h}: go to {p}; then to {q} and again to {p}, and this {n}; then to home.",
            "Outbound {p} to {q}, inbound {q} to {p}: {n} with {a} at {h}, then recover at home.",
        ),
        (
            "Primero a {p}. Bucle ({n}): a {q} y a {p}. Todo a {h}, con {a}. Por último, a casa.",
            "Como un péndulo, {a} va de {p} a {q} y otra vez a {p}, {n}, a {h}. Luego a casa.",
            "{P} es un extremo y {q} el otro: {a} empieza en el primero y hace {n} la ida y vuelta a {h}; "
            "después, a casa.",
            "El trayecto {p} - {q} - {p} lo hace {a} {n} a {h}; al acabar vuelve a casa.",
            "Pimpón de {a}: sale de {p} y {n} va a {q} y regresa a {p}, a {h}. Después, a casa.",
        ),
    ),
    "there_back_ground": (
        (
            "A shuttle service by {a}: it lands at {p}; then {n} over to {q} and back to {p}, {t} on the "
            "ground at each landing. Home last.",
            "{A} begins with a landing at {p}. {N} it hops to {q} and returns to {p}. After each touchdown, "
            "{t} of standing. Then home.",
            "The shuttle {p} - {q} - {p} runs {n}; {a} lands at each end and loads for {t} on the ground; when "
            "done, home.",
            "Please load {t} after every landing of {a}: the first at {p}, then {n} at {q} and back at {p}. At "
            "last, home.",
        ),
        (
            "Servicio de ida y vuelta con {a}: aterriza en {p}; luego {n} a {q} y de vuelta a {p}, {t} en "
            "tierra en cada toma. Al final a casa.",
            "{A} empieza aterrizando en {p}; después {n} salta a {q} y regresa a {p}, con {t} en el suelo cada "
            "vez. Luego, a casa.",
        ),
    ),
    "periodic": (
        (
            "Keep repeating, {n} in total and every {e}: {a} to {p}, {h} up; hold there {t}; home.",
            "Once per {e} somebody should look after {p}. Let {a} do it {n}: {t} in the air above it at {h}, home again.",
            "Sortie plan: {n}, launch interval {e}. Each sortie: {a}, overhead {p}, {h}, hold {t}, return home.",
            "The visits to {p} by {a} come every {e}, and {n} is how often: each from {h}, {t} long, ending at home.",
            "Every {e}: {a} out to {p}, {t} on station at {h}, RTB. Run it {n}.",
            "Check on {p} by {a} once each {e}, {n} altogether: hang {h} above it for {t}, go home.",
            "Like the night watchman: each {e}, {a} looks at {p} from {h} for {t} and goes home; he does {n}.",
            "{N} I would like a look at {p}. {A} leaves every {e}, stands {t} in the air there at {h}, and "
            "returns home.",
            "I do not trust {p}. So every {e} {a} flies there, {h} up, stays {t}, and comes home, {n} in all.",
            "Timetable of {a}: departure each {e}, destination {p}, {h}, {t} of waiting in the air, home "
            "again. {N} in total.",
            "{A} must go {n} to {p}, always after {e} one time, in {h}, rest {t} over it and go back to home.",
            "Monitoring interval {e}, visits {n}. Per visit {a} hovers {t} over {p} at {h} and then returns home.",
            "Go, hover {t} above {p} at {h}, go home: {a} keeps to that {n} in total, setting out each {e}.",
            "{P} is visited {n} by {a}. A visit: {h} high, {t} long, home. From one start to the next: {e}.",
            "Please ensure that {p} is looked at every {e}, {n} overall, by {a} from {h} for {t}, with a "
            "return home each time.",
        ),
        (
            "Plan de salidas: {n}, una cada {e}. En cada una, {a} va a {p}, a {h}, aguanta {t} y vuelve a casa.",
            "{A} repite esto {n}, empezando cada {e}: hasta {p} a {h}, {t} en el aire, a casa.",
            "Como un vigilante nocturno: cada {e} {a} mira {p} desde {h} durante {t} y vuelve a casa; {n} en total.",
            "Horario de {a}: salida cada {e} hacia {p}, a {h}, {t} en el aire y a casa. {N} en total.",
            "{P} recibe {n} la visita de {a}, una cada {e}: a {h}, {t} encima y de regreso a casa.",
            "Quiero saber cómo sigue {p}: cada {e}, y así {n}, {a} va a {h}, se queda {t} y regresa a casa.",
            "Intervalo: {e}. Visitas a {p}: {n}. En cada una {a} se queda {t} a {h} y luego vuelve a casa.",
        ),
    ),
}
