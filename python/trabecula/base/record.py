"""The base of all reports: figures as attributes with types and units, as a dictionary, and in words."""

from __future__ import annotations

from typing import Any, ClassVar, NoReturn

__all__ = ["Report"]


class Report(dict):
    """Figures that never change: ``report.volume`` or ``report["volume"]``; ``str(report)`` in words.

    A figure that the report does not have is no key of it, and None as an attribute.
    """

    #: The class of the figures that are reports themselves, or lists or dictionaries of them.
    _parts: ClassVar[dict[str, str]] = {}
    #: The figures that are dictionaries of reports by name.
    _by_name: ClassVar[frozenset[str]] = frozenset()
    #: All classes of reports by their names.
    _classes: ClassVar[dict[str, type[Report]]] = {}

    def __init_subclass__(cls) -> None:
        Report._classes.setdefault(cls.__name__, cls)

    def __init__(self, data: dict[str, Any]):
        super().__init__({key: self._part(key, value) for key, value in data.items()})

    def _part(self, key: str, value: Any) -> Any:
        name = self._parts.get(key)
        if name is None or value is None:
            return value
        made = self._classes[name]
        if isinstance(value, list):
            return [made(item) for item in value]
        return {k: made(item) for k, item in value.items()} if key in self._by_name else made(value)

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        if name in type(self).__annotations__:
            return None
        raise AttributeError(f"{type(self).__name__} has no {name}")

    def _fixed(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a report never changes; to_dict() gives a dictionary that may")

    __setattr__ = __setitem__ = __delattr__ = __delitem__ = __ior__ = _fixed
    clear = pop = popitem = setdefault = update = _fixed

    def __reduce__(self) -> tuple:
        return type(self), (self.to_dict(),)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({super().__repr__()})"

    def __str__(self) -> str:
        from .texts import text

        return text(self)

    def to_dict(self) -> dict[str, Any]:
        """The figures as plain dictionaries, lists, numbers and texts."""
        return _plain(self)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list) else value
