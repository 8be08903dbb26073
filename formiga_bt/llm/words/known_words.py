"""Requests of which every word is known: flights, places, times, nothing else. What such a request asks for can be flown.

So a model that says of it that no verb can do that, or that something is not there, is wrong; and if it names no place, it is
certain that none is named in words that nobody here knows.
"""

import re
from typing import Final

from formiga_bt.base.units import UNITS
from formiga_bt.llm.words.amounts import NUMBERS, OTHER_UNITS, UNIT_WORDS
from formiga_bt.llm.words.wording import DRONES, LIGHT_HEAVY, PEOPLE, Words, types_said
from formiga_bt.llm.world import RequestWorld

_LOOK: Final = """
    look looks looking check checks checking inspect inspects inspecting watch watches watching observe observes see
    view visit visits visiting search searches searching explore explores exploring scan scans scanning survey surveys
    patrol patrols mira mire mirar vistazo revisa revise revisar inspecciona inspeccione inspeccionar comprueba
    compruebe comprobar vigila vigile vigilar observa observar visita visite visitar busca busque buscar explora
    explorar
"""
_GO: Final = """
    go goes going fly flies flying send launch dispatch travel travels head heads move moves proceed proceeds ve vaya ir
    va vuela vuele volar manda mande envía envíe lanza despacha acércate
"""
_HOME: Final = """
    home port ports back return returns returning casa puerto vuelve vuelva volver regresa regrese regresar
"""
_SMALL: Final = """
    a an the this that these those it its it's they them their each one ones another other others all both every any
    some none same and or but then so of to at in on over above below under round around about near beside by from for
    with without until till while during between into onto out off up down through across along towards toward past as
    is are be been being was has have having had do does doing done did will would shall should must can could may let
    lets make makes want wants need needs i we you me us my our your please kindly thanks thank hello hi now today here
    there only just also too again once twice first second third last next finally afterwards after before later
    meanwhile when where which who what quick quickly short time times total more not no yes if else otherwise nobody
    day way than least most
"""
_DO: Final = """
    light heavy small big machine machines type use using hover hovers hovering hold holds stay stays staying wait waits
    waiting pause pauses land lands landing settle settles park parks come comes coming circle circles circling orbit
    orbits loop loops lap laps turns zigzag zigzags weave weaves climb climbs rise rises descend descends start starts
    end ends finish finishes begin begins keep keeps keeping remain remains line repeat repeats gather gathers assemble
    meet meets form forms pass passes cover covers leave leaves rest rests
"""
_WHERE: Final = """
    place places spot spots point points position positions ground air north south east west side sides left right
    straight apart away distance centre center middle ring rings radius triangle corner corners leg legs swing swings
    swinging row neighbour neighbours neighbor neighbors high height altitude top together base own halfway region area
    whole entire station stations round trip way route ask asks asked confirm confirms confirmed agree agrees agreed say
    says said okay ok
"""
_SPANISH: Final = """
    un una unos unas uno el la los las lo y o e que de del al en con sin sobre encima desde hasta hacia por para entre
    cada todo toda todos todas su sus se le les me nos luego después antes mientras durante primero segundo final favor
    gracias ya ahora hoy allí ahí aquí dron drones ligero ligeros pesado pesados haz hace haga hacer da dé dar echa eche
    echar queda quede quedarse espera espere esperar permanece aterriza aterrice aterrizar aterrizan posa pose posarse
    toma tome tierra suelo aire vuelta vueltas vez veces círculo circulo rodea rodee rodear anillo tramos zigzag línea
    recta altura metros radio lado lados norte sur este oeste izquierda derecha quiero necesito puede debe tiene vuelven
    vuelvan van vuelan punto sitio lugar centro juntos separados ida a eso esto otro otra mismo misma también no sí si
    cuando donde solo
"""
KNOWN: Final = frozenset(f"{_LOOK} {_GO} {_HOME} {_SMALL} {_DO} {_WHERE} {_SPANISH}".split())
_UPWARDS: Final = re.compile(
    r"\b(?:take\w* off|lift\w* off|climb\w*|ris(?:e|es|ing)|ascend\w*|straight up|(?:go|goes|fly|flies|come|comes) up|"
    r"desp[ei]e?g\w+|sub[ea]\w*|asciend\w+)\b|(?<!m )(?<!metres )(?<!meters )\bup\b"
    r"|\bto (?:a height of )?\d+ ?m(?:et\w+)?\b",
    re.IGNORECASE,
)
_FIGURE: Final = re.compile(
    r"\b(?:circl\w+|orbit\w*|laps?|loops?|rings?|zig-?zag\w*|weav\w+|triang\w+|lines?|round|turns?|legs?|vueltas?|c[ií]rculo|"
    r"anillo|rode\w+|l[ií]nea|tramos|triáng\w+|north|south|east|west|norte|sur|este|oeste)\b",
    re.IGNORECASE,
)
"""Figures have a question of their own; who flies to the north does say where to."""
_PHRASES: Final = re.compile(
    r"\b(?:tak(?:e|es|ing) (?:off|turns|a (?:short |quick )?look)|(?:touch|touches|set|sets|put|puts) down"
    r"|in (?:this|that) order)\b",
    re.IGNORECASE,
)
"""What is known as a whole: who takes off takes nothing along."""
_WORD: Final = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)?")


def unknown_words(words: Words, world: RequestWorld) -> list[str]:
    """Return the words of a request that are neither known here nor names of the site, its machines and its people."""
    types = world.catalogue.types.values()
    names = [*words.places.values(), *words.agents.values()]
    nouns = [*DRONES, *(noun for one in (*LIGHT_HEAVY.values(), *PEOPLE.values()) for noun in one)]
    nouns += [noun + end for one in types for noun in (one.name, one.label) if noun for end in ("", "s")]
    text = _PHRASES.sub(" ", words.text)
    for name in sorted({*names, *nouns}, key=len, reverse=True):
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", " ", text, flags=re.IGNORECASE)
    plain = {*KNOWN, *NUMBERS, *UNIT_WORDS, *OTHER_UNITS, *UNITS}
    return [one for match in _WORD.finditer(text) if (one := match[0].casefold()) not in plain]


def goes_nowhere(words: Words, world: RequestWorld) -> bool:
    """Return whether a request wants a flight to somewhere, and certainly does not say where to."""
    if words.places or len(words.agents) > 1 or unknown_words(words, world):
        return False
    types, site = world.catalogue.types, world.site
    if any(types[site.agents[one].type].human for one in words.agents):
        return False
    if any(types[one].human for one in types_said(words, world.catalogue)):
        return False
    goal = "|".join(map(re.escape, words.agents.values()))
    to_one = rf"\b(?:to|at|over|above|near|round|around|a|sobre|hasta|{'|'.join(_LOOK.split())})\s+(?:the\s+)?(?:{goal})(?!\w)"
    if goal and re.search(to_one, words.text, re.IGNORECASE):
        return False
    if _UPWARDS.search(words.text) or _FIGURE.search(words.text):
        return False
    said = {match[0].casefold() for match in _WORD.finditer(words.text)}
    return bool(said & {*_LOOK.split()}) or bool(said & {*_GO.split()} and not said & {*_HOME.split()})
