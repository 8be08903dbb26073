"""Explain YAML syntax errors (E001): one probe per trap that authors fall into, with the mended line.

Called by `document` when the YAML parser refuses a text. A probe looks at the line of the error and the line before it;
the first that recognises its trap answers, otherwise the parser's own words are shown.
"""

import re
from collections.abc import Callable
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, Fix, Mark

_FORBIDDEN = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x85-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]|(?<!^)\ufeff"
)
_KEY_VALUE = re.compile(r"^(\s*(?:- +)*)([A-Za-z_][\w-]*): +(\S.*?)\s*$")

_BREAK = re.compile(r"\r\n|\r|\n")

Probe = Callable[[str], tuple[int, int, str, str] | None]
"""Line -> (first column, column after the last, message, mended line), 0-based; None if its trap is not there."""


def lines_of(source: str) -> list[str]:
    """Return the lines of a text as YAML counts them."""
    return _BREAK.split(source)


def forbidden_characters(text: str, file: str) -> Diagnostic | None:
    """Return E001 for the first character that no file should hold: control characters, line ends, turns of direction."""
    found = _FORBIDDEN.search(text)
    if found is None:
        return None
    before = lines_of(text[: found.start()])
    line, col = len(before), len(before[-1]) + 1
    what = f"the invisible character U+{ord(found[0]):04X} is not allowed in a task file"
    return Diagnostic("E001", Mark(file, line, col, line, col + 1), what, "remove it")


def explain(source: str, file: str, line: int, col: int, said: str) -> Diagnostic:
    """Return the diagnostic of a YAML syntax error.

    Args:
        source: the whole text.
        file: its name in marks.
        line: of the parser's error, 1-based.
        col: of the parser's error, 1-based.
        said: the parser's words.
    """
    lines = lines_of(source)
    for number in (line, line - 1):
        if not 1 <= number <= len(lines):
            continue
        text = lines[number - 1]
        for probe in PROBES:
            hit = probe(text)
            if hit is not None:
                return _found(hit, file, number, text)
    line = min(line, max(1, len(lines)))
    col = min(col, len(lines[line - 1]) + 1)
    return Diagnostic("E001", Mark(file, line, col, line, col + 1), f"this is not YAML: {said}", _hint(said))


def explain_tag(source: str, file: str, line: int) -> Diagnostic | None:
    """Return the diagnostic of a `!` that was meant as "not", if the line of a YAML tag looks like that."""
    lines = lines_of(source)
    text = lines[min(line, len(lines)) - 1]
    hit = _bang(text)
    return None if hit is None else _found(hit, file, line, text)


def hidden_text(line: str, end: int, file: str, number: int) -> Diagnostic | None:
    """Return E001 where a plain text, which ends at column `end`, goes on after ` #` and a digit: `Row #3`."""
    if not line.startswith(" #", end) or not re.match(r" #\d", line[end : end + 3]):
        return None
    return _found((end + 1, len(line), _HIDDEN, _mend_hash(line)), file, number, line)


def _found(hit: tuple[int, int, str, str], file: str, number: int, text: str) -> Diagnostic:
    start, end, what, mended = hit
    mark = Mark(file, number, start + 1, number, end + 1)
    whole = Mark(file, number, 1, number, len(text) + 1)
    return Diagnostic("E001", mark, what, f"write: {mended.strip()}", fix=Fix(whole, mended))


def _hint(said: str) -> str:
    if "tab" in said or "\\t" in said:
        return "indent with spaces"
    if "block" in said or "mapping" in said:
        return "check the indentation: keys of one mapping start in one column"
    return "check quotes, brackets and indentation around here"


def _tab(line: str) -> tuple[int, int, str, str] | None:
    found = re.match(r"[ -]*\t[\t -]*", line)
    if found is None:
        return None
    at = line.index("\t")
    return at, found.end(), "a tab in the indentation", line.replace("\t", "  ")


def _dollar_in_flow(line: str) -> tuple[int, int, str, str] | None:
    """`{to: ${target}}`: inside flow style the braces of `${}` are YAML's own."""
    opened = re.search(r"[:\[,] *(\$\{[^{}\"']*\})", _without_quoted(line))
    if opened is None or not re.search(r"[\[{].*\$\{", line):
        return None
    start, end = opened.span(1)
    expr = line[start:end]
    flow = re.sub(r"(?<![\"'\w])\$\{[^{}\"']*\}", lambda m: f'"{m[0]}"', line)
    return start, end, f'inside {{ }} write "{expr}" in quotes', flow


def _colon_in_text(line: str) -> tuple[int, int, str, str] | None:
    """`notify: Alarm: come here`: a second `: ` begins a mapping."""
    found = _KEY_VALUE.match(line)
    if found is None or found[3][0] in "\"'[{|>&*!%@`" or not re.search(r":( |$)", found[3]):
        return None
    value = found[3]
    if " ? " in value:
        mended = f"{found[1]}{found[2]}: {_python_if(value)}"
        return found.start(3), found.end(3), "'a ? b : c' is not part of the language", mended
    at = found.start(3) + value.index(":")
    return at, at + 1, "': ' inside a text begins a new key", f"{found[1]}{found[2]}: {_quote(value)}"


def _python_if(value: str) -> str:
    cond, _, rest = value.partition(" ? ")
    yes, _, no = rest.partition(" : ")
    inner = cond.strip().removeprefix("${"), yes.strip(), no.strip().removesuffix("}")
    text = f"{inner[1]} if {inner[0]} else {inner[2]}"
    return "${" + text + "}" if value.startswith("${") else text


def _bang(line: str) -> tuple[int, int, str, str] | None:
    """`when: !drone.airborne`: YAML takes it as a tag."""
    found = re.search(r"(?:^|[:\[,{-]) *(!)(?=[A-Za-z_(])", _without_quoted(line))
    if found is None:
        return None
    at = found.start(1)
    return at, at + 1, "'!' begins a YAML tag; the language says 'not'", f"{line[:at]}not {line[at + 1 :]}"


def _leading_quote(line: str) -> tuple[int, int, str, str] | None:
    """`ask: "Alarm" is it the picker?`: text after the closing quote."""
    found = re.match(r"^(\s*(?:- +)*[\w-]+: +|\s*(?:- +)+)(([\"'])(?:(?!\3).)*\3)(\s*[^\s#,\]}:].*)$", line)
    if found is None:
        return None
    return (
        found.start(4),
        found.end(4),
        "text goes on after the closing quote",
        f"{found[1]}{_quote(found[2] + found[4])}",
    )


def _hash(line: str) -> tuple[int, int, str, str] | None:
    """`ask: "Row #3` or `expect: [a, #b]`: ` #` begins a comment and hides the rest."""
    bare = _without_quoted(line)
    at = re.search(r"(?<=\s)#", bare)
    if at is None or not re.search(r"[\[{\"']", bare[: at.start()]):
        return None
    return at.start(), len(line), _HIDDEN, _mend_hash(line)


_HIDDEN: Final = "' #' begins a comment, the rest of the line is not read"


def _mend_hash(line: str) -> str:
    found = _KEY_VALUE.match(line)
    if found is None or found[3][0] in "[{":
        return line.replace(" #", " ", 1)
    return f"{found[1]}{found[2]}: {_quote(found[3].strip(chr(34) + chr(39)))}"


def _open_quote(line: str) -> tuple[int, int, str, str] | None:
    found = re.match(r"^(\s*(?:- +)*(?:[\w-]+: +)?)([\"'])((?:(?!\2).)*)$", line)
    if found is None:
        return None
    return found.start(2), found.end(2), "this quote is never closed", f"{found[1]}{_quote(found[3])}"


def _percent_or_at(line: str) -> tuple[int, int, str, str] | None:
    found = re.match(r"^(\s*(?:- +)*[\w-]+: +|\s*(?:- +)+)([@`%*&])(.*)$", line)
    if found is None:
        return None
    what = f"a text cannot begin with '{found[2]}' unless it stands in quotes"
    return found.start(2), found.end(2), what, f"{found[1]}{_quote(found[2] + found[3])}"


def _quote(text: str) -> str:
    return "'" + text.strip().replace("'", "''") + "'" if '"' in text or "\\" in text else f'"{text.strip()}"'


def _without_quoted(line: str) -> str:
    """Blank out quoted spans, keeping columns."""
    return re.sub(r"\"[^\"]*\"|'[^']*'", lambda m: "_" * len(m[0]), line)


PROBES: Final[tuple[Probe, ...]] = (
    _tab,
    _dollar_in_flow,
    _bang,
    _leading_quote,
    _hash,
    _open_quote,
    _colon_in_text,
    _percent_or_at,
)
