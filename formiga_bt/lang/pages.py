"""The pages of `docs/errors.md`, `docs/messages.md` and `docs/reasons.md`, which ship with formiga: what a code means and says.

Called by `formiga explain`, `formiga check --sarif` and the tests that run every example through the checker.
"""

import re
from dataclasses import dataclass, field
from functools import cache
from typing import Final

from formiga_bt.base.packaged import folder

_ROW: Final = re.compile(r"^\| ([EW]\d{3}) \| (.*?) \| ?(.*?) ?\|$", re.MULTILINE)
_SECTION: Final = re.compile(r"^## ([EW]\d{3})\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_FENCE: Final = re.compile(r"^```yaml (wrong|right)(?: (\w+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_GROUP: Final = re.compile(r"^(In [^\n]*):\n\n```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_MESSAGE: Final = re.compile(r"^(\S.*)\n(?:    (.*)\n)?", re.MULTILINE)
_ROLE: Final = re.compile(r"`(\w+)` [^`,]*\(`(\w+)`\)")
_TABLE_ROW: Final = re.compile(r"^\| (`[^|]+`(?:, `[^|]+`)*) \| (.*) \|$")


@dataclass(frozen=True, slots=True)
class PageExample:
    """A piece of a file; `of` says of which: a task (""), a site; or a catalogue, or a library, with a task after `---`."""

    text: str
    of: str = ""


@dataclass(frozen=True, slots=True)
class CodePage:
    """What a code of the checker means."""

    code: str
    wrong_is: str
    """What is wrong, in a line."""
    helps: str
    """What helps, in a line; may be empty."""
    text: str
    """The section of the code, Markdown; empty if there is none."""
    wrong: PageExample | None = None
    right: PageExample | None = None


@dataclass(frozen=True, slots=True)
class CodeMessage:
    """What the checker says in a certain case."""

    where: str
    """In which files: `In a task`."""
    text: str
    """With the names of an example."""
    helps: str = ""


@dataclass(frozen=True, slots=True)
class Reason:
    """What a reason code means: `group` is the question that its table answers."""

    codes: tuple[str, ...]
    group: str
    cells: tuple[str, ...] = field(default_factory=tuple)


@cache
def pages() -> dict[str, CodePage]:
    """Return the pages of the checker's codes, in the order of the table."""
    text = (folder("docs") / "errors.md").read_text(encoding="utf-8")
    sections = {code: body.strip() for code, body in _SECTION.findall(text)}
    found = {}
    for code, wrong_is, helps in _ROW.findall(text):
        body = sections.get(code, "")
        examples = {which: PageExample(inside, of) for which, of, inside in _FENCE.findall(body)}
        found[code] = CodePage(code, wrong_is, helps, body, examples.get("wrong"), examples.get("right"))
    return found


@cache
def messages() -> dict[str, tuple[CodeMessage, ...]]:
    """Return what the checker says under each code, each once."""
    text = (folder("docs") / "messages.md").read_text(encoding="utf-8")
    return {
        code: tuple(
            CodeMessage(where, *said) for where, lines in _GROUP.findall(body) for said in _MESSAGE.findall(lines)
        )
        for code, body in _SECTION.findall(text)
    }


def summaries() -> dict[str, str]:
    """Return what is wrong, in a line of plain text, by code."""
    return {code: page.wrong_is.replace("`", "") for code, page in pages().items()}


@cache
def reasons() -> tuple[Reason, ...]:
    """Return the rows of the tables of reason codes."""
    found: list[Reason] = []
    group = ""
    for line in (folder("docs") / "reasons.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            group = line[3:]
        row = _TABLE_ROW.match(line)
        if row is not None:
            codes = tuple(re.findall(r"`([^`]+)`", row[1]))
            cells = tuple(cell.strip() for cell in row[2].split("|") if cell.strip())
            found.append(Reason(codes, group, cells))
    return tuple(found)


def reasons_of(word: str) -> tuple[Reason, ...]:
    """Return what a reason code means, once for each table that has it; `failed:blocked` is found as `failed:<code>`."""
    exact = tuple(reason for reason in reasons() if word in reason.codes)
    if exact or not re.search(r"[:.]", word):
        return exact
    start = re.split(r"[:.]", word, maxsplit=1)[0]
    return tuple(r for r in reasons() if any(re.match(rf"{re.escape(start)}[:.]<", code) for code in r.codes))


@cache
def _roles() -> dict[str, str]:
    """Return the roles that examples need not declare, and their types: as the head of docs/errors.md says."""
    head = (folder("docs") / "errors.md").read_text(encoding="utf-8").partition("\n| code |")[0]
    return dict(_ROLE.findall(head))


def whole(example: PageExample) -> str:
    """Return the file of which an example is a piece: what the examples leave out is said at the head of docs/errors.md."""
    text = example.text.rpartition("---\n")[2]
    if example.of == "site":
        return f"formiga_site: 1\nname: here\nbase: {{lat: 66.5, lng: 25.7, ground_msl: 120 m}}\n{text}"
    if text.startswith("formiga:"):
        return text
    head = "formiga: 1\ntask: Example\n"
    if re.search(r"call: (ReturnHome|FlyTo|FlyAndLand)\b", text) and "imports:" not in text:
        head += "imports: [lib/flying.yaml]\n"
    if re.search(r"\btarget\b", text) and "params:" not in text.partition("subtrees:")[0]:
        head += "params:\n  target: place\n"
    elif re.search(r"\btarget\b", text):
        text = text.replace("params:\n", "params:\n  target: place\n", 1)
    if not re.search(r"^agents:", text, re.MULTILINE):
        main = text.partition("subtrees:")[0]
        head += "agents:\n" if any(re.search(rf"\b{role}\b", main) for role in _roles()) else ""
        roles = [one for one in _roles() if re.search(rf"(?<!: \$\{{)\b{one}\b[^:]|{one}\}}", main)]
        near = ', near: "${target}"' if re.search(r"\btarget\b", main) else ""
        head += "".join(f"  {role}: {{type: {_roles()[role]}{near}}}\n" for role in roles)
    return head + text
