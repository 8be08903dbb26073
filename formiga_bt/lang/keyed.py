"""Mappings read by their tables of options (`lang.kinds.Option`): the one reader of the keys of every file of ours.

`read_keys` reports unknown and missing keys and returns `Keys`, whose values are read as the table says: words
that may stand there, units, limits, and what holds where nothing is written. `read_root` begins with a whole file.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.text.colons import in_text
from formiga_bt.lang.text.document import Entry, Mapping_, Node, Scalar, parse_file
from formiga_bt.lang.text.reading import (
    Problems,
    fix_word,
    quoted_list,
    read_flag,
    read_listing,
    read_mapping,
    read_name,
    read_number,
    read_quantity,
    read_text,
    read_word,
    read_words,
    shorten,
    why_unreadable,
)
from formiga_bt.lang.text.synonyms import ADVICE, BY_HAND, KEY_SYNONYMS, is_sure, key_for

_MOST_WHOLE = 1e9


class Keys(dict[str, Entry]):
    """The entries of a mapping by their keys. What a method reads and finds wrong is reported, and counts as not written."""

    def __init__(self, options: Iterable[Option], problems: Problems) -> None:
        super().__init__()
        self.options = {option.name: option for option in options}
        self.problems = problems

    def mark(self, key: str) -> Mark:
        """Return where the value of a key that is there stands."""
        return self[key].value.mark

    def wrong(self, key: str, code: str, message: str, help: str = "") -> None:
        """Report a problem at the value of a key that is there."""
        self.problems.add(code, self.mark(key), message, help)

    def text(self, key: str) -> Scalar | None:
        """Return a text, or None."""
        return read_text(self[key].value, self.problems, key) if key in self else None

    def name(self, key: str) -> Scalar | None:
        """Return an identifier, or None."""
        return read_name(self[key].value, self.problems, key) if key in self else None

    def word(self, key: str) -> str:
        """Return one of the words of the table, or, where it has none, a name or a text."""
        option = self.options[key]
        default = str(option.default or "")
        if key not in self:
            return default
        if option.values:
            return read_word(self[key].value, self.problems, key, option.values) or default
        at = self.name(key) if option.form == "name" else self.text(key)
        return at.text if at is not None else default

    def flag(self, key: str) -> bool:
        """Return whether it says true."""
        return key in self and read_flag(self[key].value, self.problems, key)

    def number(self, key: str) -> float:
        """Return a number, SI if the table gives a type (percent 0..100), within the limits of the table."""
        option = self.options[key]
        default = float(option.default or 0.0)
        if key not in self:
            return default
        node = self[key].value
        unit = option.type not in ("", "number", "int")
        value = read_quantity(node, self.problems, key, option.type) if unit else read_number(node, self.problems, key)
        beyond = _beyond(option, value) if value is not None else ""
        if beyond:
            self.wrong(key, "E062", f"'{key}' {beyond}")
        return default if value is None or beyond else value

    def whole(self, key: str) -> int:
        """Return a whole number."""
        return int(self.number(key))

    def value(self, key: str) -> str | float | int:
        """Return a value by the form in the table: a number, or one word or text."""
        option = self.options[key]
        if option.form != "value":
            return self.word(key)
        return self.whole(key) if option.type == "int" else self.number(key)

    def listed(self, key: str, *, such_as: str | None = None) -> Sequence[Node]:
        """Return the items of a list, none if there is no such key.

        Args:
            key: of the list.
            such_as: an example, or ""; then an empty list is E044.
        """
        found = read_listing(self[key].value, self.problems, key) if key in self else ()
        if such_as is not None and key in self and found is not None and not found:
            self.wrong(key, "E044", f"'{key}' is an empty list", such_as)
        return found or ()

    def words(self, key: str) -> list[str]:
        """Return the words of a list, none if there is no such key."""
        return [at.text for at in read_words(self[key].value, self.problems, key)] if key in self else []

    def mappings(self, key: str, what: str, *, such_as: str | None = None) -> Iterator[Mapping_]:
        """Iterate over the items of a list of mappings; `what` is how messages call an item, `such_as` as for `listed`."""
        for item in self.listed(key, such_as=such_as):
            mapping = read_mapping(item, self.problems, what)
            if mapping is not None:
                yield mapping

    def entries(self, key: str) -> Sequence[Entry]:
        """Return the entries of a mapping with free keys, none if there is no such key."""
        mapping = read_mapping(self[key].value, self.problems, key) if key in self else None
        return mapping.entries if mapping is not None else ()

    def inside(self, key: str, options: Iterable[Option], owner: str) -> "Keys":
        """Return the keys of a mapping with a table of its own, none if there is no such key; `owner` as for `read_keys`."""
        if key not in self:
            return Keys(options, self.problems)
        return read_inside(self[key].value, options, self.problems, key, owner)


def read_root(
    text: str, file: str, options: Sequence[Option], problems: Problems, *, what: str, owner: str, begin: str
) -> Keys | None:
    """Return the keys of a whole file, or None if it has none (reported).

    Args:
        text: of the file.
        file: its name in marks.
        options: what it may hold.
        problems: where to report.
        what: how a message calls it: `site`.
        owner: the same with its article, as for `read_keys`.
        begin: how such a file begins: `formiga_site: 1`.
    """
    node, found = parse_file(text, file)
    problems.extend(found)
    if node is None:
        if not found:
            problems.add("E008", Mark(file, 1, 1), "the file is empty", f"begin with: {begin}")
        return None
    root = read_mapping(node, problems, what)
    return read_keys(root, options, problems, owner) if root is not None else None


def text_of(path: Path, problems: Problems) -> str | None:
    """Return the text of a file, or None if it cannot be read (reported)."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        problems.add("E008", Mark(str(path), 1, 1), f"the file cannot be read: {why_unreadable(error)}")
        return None


def check_version(keys: Keys, key: str, needs: str) -> None:
    """Report E007 for a file of another version than 1; `needs` begins the message: `this site needs`."""
    at = keys.text(key)
    if at is not None and at.text != "1":
        keys.wrong(key, "E007", f"{needs} version {shorten(at.text)}, this program knows 1", f"write {key}: 1")


def read_inside(node: Node, options: Iterable[Option], problems: Problems, what: str, owner: str) -> Keys:
    """Return the keys of a node that must be a mapping; none if it is not (reported, and called `what`)."""
    mapping = read_mapping(node, problems, what)
    return read_keys(mapping, options, problems, owner) if mapping is not None else Keys(options, problems)


def _beyond(option: Option, value: float) -> str:
    """Return which limit of an option a value breaks, in words; "" = none."""
    least, most, kind = option.least, option.most, option.type
    if option.type == "int":
        fits = value == int(value) and (least is None or value >= least) and value <= _MOST_WHOLE
        return "" if fits else f"must be a whole number from {least:g} on"
    if option.above is not None:
        return "" if value > option.above else f"must be above {format_quantity(kind, option.above)}"
    if least is not None and most is not None:
        both = f"must lie between {format_quantity(kind, least)} and {format_quantity(kind, most)}"
        return "" if least <= value <= most else both
    return "must not be negative" if least is not None and value < least else ""


def read_keys(mapping: Mapping_, options: Iterable[Option], problems: Problems, owner: str) -> Keys:
    """Return the entries of a mapping by key, having reported unknown and missing keys.

    A misspelt key counts as the one that was meant, so that one mistake is one diagnostic.

    Args:
        mapping: the mapping.
        options: what it may hold.
        problems: where to report.
        owner: how a message calls it, for example `a param`.
    """
    options = list(options)
    found = Keys(options, problems)
    known = found.options
    for entry in mapping.entries:
        key = entry.key.text
        option = known.get(key)
        if option is None:
            meant = unknown_key(entry.key, known, problems, owner, taken=[e.key.text for e in mapping.entries])
            if meant:
                found.setdefault(meant, entry)
        elif key not in found:
            found[key] = entry
    for option in known.values():
        if option.required and option.name not in found:
            problems.add(
                "E008", mapping.mark, f"{owner} needs '{option.name}'", f"add {option.name}: {option.like}".rstrip()
            )
    return found


def unknown_key(key: Scalar, known: Iterable[str], problems: Problems, owner: str, taken: Sequence[str] = ()) -> str:
    """Report E004 for a key that a mapping does not have; return the key that was meant, or ""."""
    names = [name for name in known if name not in taken]
    meant = key_for(key.text, names)
    guess = f"; did you mean '{meant}'?" if meant else ""
    help_ = ADVICE.get(key.text, "" if meant else f"options: {quoted_list(names)}" if names else "take it out")
    sure = meant and (KEY_SYNONYMS.get(key.text) == meant or is_sure(key.text, meant, names))
    fix = fix_word(key, meant) if sure and key.text not in BY_HAND else None
    missing, mended = in_text(key.text) if not key.quoted else ("", "")
    guess, help_ = (f"; {missing}", f"write: {mended}") if missing else (guess, help_)
    problems.add("E004", key.mark, f"{owner} has no option '{shorten(key.text)}'{guess}", help_, fix)
    return meant
