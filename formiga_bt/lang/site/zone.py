"""Time zones by their IANA names."""

from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.text.reading import did_you_mean, fix_word, shorten
from formiga_bt.lang.text.synonyms import nearest


def read_timezone(keys: Keys, default: str = "UTC") -> str:
    """Return the time zone of the key `timezone`; `default` if there is none, or it is none (reported)."""
    at = keys.text("timezone")
    if at is None:
        return default
    from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones  # slow, and few files need it

    try:
        return ZoneInfo(at.text).key
    except (ZoneInfoNotFoundError, ValueError, OSError):
        known = sorted(available_timezones())
        meant = nearest(at.text, known)
        what = f"there is no time zone '{shorten(at.text)}'{did_you_mean(at.text, known)}"
        keys.problems.add("E008", at.mark, what, "an IANA name, such as Europe/Helsinki", fix_word(at, meant))
        return default
