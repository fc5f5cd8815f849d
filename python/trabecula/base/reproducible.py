"""What never changes, and what solids make of themselves: how that is copied and pickled."""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, ClassVar, TypeVar

    from .resolution import Resolution

    Own = TypeVar("Own", bound="Unchanging")
    Self = TypeVar("Self", bound="Reproducible")

__all__ = ["Reproducible", "Unchanging"]


class Unchanging:
    """What never changes: a copy is itself."""

    def __copy__(self: Own) -> Own:
        return self

    def __deepcopy__(self: Own, memo: dict) -> Own:
        return self


class Reproducible(Unchanging):
    """What a solid, or its beams, make by a plan. Pickled it is the solid's design and the plan, and is made again where that
    is read: the same in every bit.
    """

    #: What makes it, of the core's part of the solid and the plan.
    _make: ClassVar[Callable[..., Any]]
    _core: Any

    def __init__(self, solid: Resolution | Reproducible, plan: dict[str, Any], **how: Any):
        self._solid, self._plan = solid, plan
        self._core = self._make(solid._core, **plan, **how)

    def _like(self: Self, core: Any, **more: Any) -> Self:
        """Another of its kind, which is made already, by its plan and what is new in that."""
        made = object.__new__(type(self))
        made._solid, made._plan, made._core = self._solid, self._plan | more, core
        return made

    def __reduce__(self) -> tuple:
        return type(self), (self._solid, self._plan)
