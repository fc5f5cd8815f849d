"""The base of all reports: figures as attributes with types and units, as a mapping, as plain data, and in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

__all__ = ["Report"]


class Report(Mapping):
    """Figures that never change: ``report.volume`` or ``report["volume"]``; ``to_dict()`` for JSON, ``str(report)`` in words.

    An attribute that the report does not have is None; it is then no key of the mapping either.
    """

    #: The class of the attributes that are reports themselves, or lists or dictionaries of them.
    _parts: ClassVar[dict[str, str]] = {}

    def __init__(self, data: Mapping[str, Any]):
        object.__setattr__(self, "_data", {key: self._part(key, value) for key, value in data.items()})

    def _part(self, key: str, value: Any) -> Any:
        name = self._parts.get(key)
        if name is None or value is None:
            return value
        from . import reports

        made = getattr(reports, name)
        if isinstance(value, list):
            return [made(item) for item in value]
        if isinstance(value, dict) and key in self._by_name:
            return {k: made(item) for k, item in value.items()}
        return made(value)

    #: The attributes that are dictionaries of reports by name.
    _by_name: ClassVar[frozenset[str]] = frozenset()

    def __getattr__(self, name: str) -> Any:
        data = self.__dict__.get("_data", {})
        if name in data:
            return data[name]
        if name in type(self).__annotations__:
            return None
        raise AttributeError(f"{type(self).__name__} has no {name}")

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a report never changes; {name} cannot be set")

    def __getitem__(self, key: str) -> Any:
        return self._data[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def __len__(self) -> int:
        return len(self._data)

    def __reduce__(self) -> tuple:
        return type(self), (self.to_dict(),)

    def __repr__(self) -> str:
        inner = ", ".join(f"{key}={value!r}" for key, value in self._data.items())
        return f"{type(self).__name__}({inner})"

    def __str__(self) -> str:
        from .texts import text

        return text(self)

    def to_dict(self) -> dict[str, Any]:
        """The figures as plain data: dictionaries, lists, numbers, texts."""
        return _plain(self)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value
