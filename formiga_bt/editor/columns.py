"""Columns as an editor counts them (UTF-16 code units, unless it agreed on another) and as we do: characters."""


def from_client(text: str, column: int, encoding: str) -> int:
    """Return the character of a line at an editor's column; the line's length beyond its end."""
    if encoding == "utf-32" or text.isascii():
        return min(column, len(text))
    units = 0
    for index, char in enumerate(text):
        if units >= column:
            return index
        units += _units(char, encoding)
    return len(text)


def to_client(text: str, column: int, encoding: str) -> int:
    """Return the editor's column of a character of a line."""
    if encoding == "utf-32" or text.isascii():
        return column
    return sum(_units(char, encoding) for char in text[:column])


def _units(char: str, encoding: str) -> int:
    return len(char.encode("utf-8", "surrogatepass")) if encoding == "utf-8" else 1 + (ord(char) > 0xFFFF)
