"""Words that put questions to people, as patterns: who asks, who says yes; English and Spanish."""

import re
from typing import Final

CASE: Final = re.IGNORECASE
DET: Final = (
    r"(?:(?:(?:one|any|some|uno|alguno|cualquiera) (?:of|de)|both|either|the|an?|one|another|some|el|la|los|las|un|una|otro|"
    r"otra|al?|del?)\s+)*"
)
YES: Final = (
    r"(?:yes|ok|okay|permission|approval|confirmation|consent|agreement|word|go-ahead|clearance|answer|"
    r"s[ií]|permiso|confirmación|aprobación|visto bueno)"
)
BY: Final = r"(?:from|of|by|de|del)"
SAYS: Final = (
    rf"(?:says?|said|answers?|answered)\s+(?:yes|so|(?:that|it)\b(?!(?:\s+it)?\s*(?:is|'s)\s+(?:not\b|un|too\b|no\b|danger|risk))|ok|okay)\b"
    rf"|(?:gives?|gave|given)\s+(?:\w+\s+)?{YES}\b"
    r"|(?:agree|confirm|approve|permit|consent|okay)(?:s|d|ed|ted|ting)?\b|allows?\b|allowed\b"
    r"|di(?:ce|cen|ga|gan|cho)\s+que\s+(?:(?:es|está?|esté|todo está)\s+(?:segur[oa]|libre|despejad[oa]|bien|list[oa])|"
    r"pued[ea]n?)\b"
    r"|di(?:ce|cen|ga|gan|cho)\s+(?:que\s+)?s[ií]\b|confirm[ae]n?\b|aprueb[ae]n?\b|acept[ae]n?\b|autori[cz][ae]n?\b"
    rf"|d(?:a|an|é|en)\s+(?:\w+\s+)?{YES}\b|est[áé]n? de acuerdo\b"
)
AUX: Final = (
    r"(?:(?:both|each|all|ha(?:ve|s) to|have|has|had|must|need to|needs to|is to|are to|should|shall|will|also|first|ambos|"
    r"los dos|también|haya|hayan|ha|han|deben?|tienen? que)\s+)*"
)
ASK: Final = r"\b(?:asks?|asking|consults?|preg[uú]nt(?:a|e|ar|an|en)(?:les?)?|consult(?:a|e|ar|an|en)(?:les?)?)"
ASKED: Final = re.compile(
    rf"(?P<ask>{ASK})\s+(?:first\s+|primero\s+)?(?:for\s+)?(?:{YES}\s+{BY}\s+)?{DET}$"
    rf"|\b{YES}\s+{BY}\s+{DET}$"
    rf"|\bp[ií]d(?:e|a|en|an)(?:les?)?\s+(?:(?:el |su )?{YES}\s+)?al?\s+{DET}$"
    rf"|\b(?:deben?|tienen? que)\s+(?:aceptar|aprobar|confirmar|autorizar|decir que s[ií]|estar de acuerdo)\s+"
    rf"(?:primero\s+)?{DET}$"
    rf"|\b(?:approved|confirmed|allowed|cleared|authori[sz]ed|okayed)\s+by\s+{DET}$"
    rf"|(?P<put>\b(?:puts?|poses?)\s+(?:the|an?|one|this|that)\s+question|\bha(?:z|ga) una pregunta)\s+(?:to|al?)\s+{DET}$",
    CASE,
)
AGREES: Final = re.compile(
    rf"[\s),]*(?:there\s+|allí\s+)?{AUX}(?:{SAYS}|(?:is|are|must be)\s+asked\b)|'s\s+{YES}\b", CASE
)
_BOUNDARY: Final = re.compile(r"[.;:](?!\d)")


def clause_of(text: str, at: int) -> int:
    """Return where the clause begins in which something stands."""
    return max((match.end() for match in _BOUNDARY.finditer(text, 0, at)), default=0)
