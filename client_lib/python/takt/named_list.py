"""Lists of elements with names."""

from __future__ import annotations

from typing import Generic, Sequence, SupportsIndex, TypeVar, overload

Element = TypeVar("Element")


class NamedList(list, Generic[Element]):
    """A list whose elements have names: parts[0] and parts["P"]; "P" in parts asks for a name."""

    names: list[str]
    """Names of the elements, in their order."""

    def __init__(self, elements: Sequence[Element], names: Sequence[str]) -> None:
        """As many names as elements."""
        super().__init__(elements)
        self.names = list(names)

    @overload
    def __getitem__(self, key: str | SupportsIndex) -> Element: ...
    @overload
    def __getitem__(self, key: slice) -> list[Element]: ...
    def __getitem__(self, key):
        if not isinstance(key, str):
            return super().__getitem__(key)
        if key not in self.names:
            raise KeyError(f"There is no '{key}'; there are {', '.join(self.names) or 'none'}.")
        return super().__getitem__(self.names.index(key))

    def __contains__(self, key: object) -> bool:
        return key in self.names if isinstance(key, str) else super().__contains__(key)


def text_of(message: object) -> str:
    """Class and plain fields of a message, e.g. for a debugger; lists and arrays are left out."""
    kind = type(message)
    values = {name: getattr(message, name) for name in dir(kind)
              if not name.startswith("_") and isinstance(getattr(kind, name), property)}
    plain = ", ".join(f"{name}={value!r}" for name, value in values.items() if isinstance(value, (bool, int, float, str)))
    return f"<takt.{kind.__name__} {plain}>"
