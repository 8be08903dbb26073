"""`transports:` and `accept_missing:` of a site file: which wires, and what mode real does without."""

from collections.abc import Mapping

from formiga_bt.base.errors import FormigaError
from formiga_bt.base.wires import GUARANTEES, ZENOH, WireKind, unaccepted, wire_kind, wire_names
from formiga_bt.lang.keyed import Keys, read_inside
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.text.document import Entry
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_words,
    shorten,
)
from formiga_bt.lang.text.synonyms import surely

Options = Mapping[str, str | bool]


def read_transports(keys: Keys, problems: Problems, mode: str) -> tuple[dict[str, Options], dict[str, tuple[str, ...]]]:
    """Return the wires of a site with their options, and what it accepts that each lacks.

    Args:
        keys: of the site file.
        problems: where to report.
        mode: of the site.
    """
    accepted = {entry.key.text: _accepted(entry, problems) for entry in keys.entries("accept_missing")}
    table = [Option(name, "map", "", required=False) for name in wire_names()]
    found: dict[str, Options] = {}
    kinds: dict[str, WireKind] = {}
    for name, entry in keys.inside("transports", table, "transports").items():
        try:
            kinds[name] = kind = wire_kind(name)
        except FormigaError as error:
            problems.add("E140", entry.key.mark, error.text, error.help)
            continue
        found[name] = _options(entry, kind, mode, problems)
        lacks = unaccepted(kind.lacks, accepted.get(name, ())) if mode == "real" else ()
        if lacks:
            what = f"the wire '{name}' does not guarantee {', '.join(lacks)}, which mode real demands"
            help_ = f"where your machines are safe without: accept_missing: {{{name}: [{', '.join(lacks)}]}}"
            problems.add("E140", entry.key.mark, what, help_)
    for entry in keys.entries("accept_missing"):
        _check_accepted(entry, kinds or {ZENOH.name: ZENOH}, accepted[entry.key.text], problems)
    return found, accepted


def _options(entry: Entry, kind: WireKind, mode: str, problems: Problems) -> Options:
    table = [Option(one.name, one.form, one.help) for one in kind.options]
    keys = read_inside(entry.value, table, problems, kind.name, kind.name)
    found: dict[str, str | bool] = {}
    for option in kind.options:
        at = keys.text(option.name) if option.form == "text" else None
        if at is not None:
            found[option.name] = at.text
        elif option.form == "flag" and option.name in keys:
            found[option.name] = keys.flag(option.name)
    for name, what, help_ in kind.check(found, mode) if kind.check is not None else ():
        wrong = keys.get(name, entry)
        problems.add("E008", wrong.key.mark if found.get(name, True) is True else wrong.value.mark, what, help_)
    return found


def _accepted(entry: Entry, problems: Problems) -> tuple[str, ...]:
    found = []
    for at in read_words(entry.value, problems, entry.key.text):
        if at.text in GUARANTEES:
            found.append(at.text)
            continue
        what = f"no guarantee is called '{shorten(at.text)}'{did_you_mean(at.text, GUARANTEES)}"
        fix = fix_word(at, surely(at.text, GUARANTEES))
        problems.add("E140", at.mark, what, f"guarantees: {quoted_list(GUARANTEES)}", fix)
    return tuple(found)


def _check_accepted(entry: Entry, kinds: Mapping[str, WireKind], words: tuple[str, ...], problems: Problems) -> None:
    kind = kinds.get(entry.key.text)
    if kind is None:
        what = f"accept_missing names '{shorten(entry.key.text)}', which is no wire of this site"
        problems.add("E140", entry.key.mark, what, f"wires: {quoted_list(kinds)}; name it under transports:")
        return
    given = [word for word in words if word not in kind.lacks]
    if given:
        what = f"the wire '{kind.name}' guarantees {', '.join(given)}: there is nothing to accept"
        problems.add("E140", entry.value.mark, what, "take it out")
