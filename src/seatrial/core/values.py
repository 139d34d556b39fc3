"""Frozen values at a low price: `dataclass` as the standard library's, whose methods are made when they are needed.

The standard decorator writes and compiles six functions for each class, half a millisecond; the 160 classes that one
`simulate` imports were a third of it.  Here the fields are found by the standard library, comparison, hash, text and
the refusal of changes are the same few functions for all classes, and the constructor is compiled at its first call.
What `dataclasses` says of a class (`fields`, `replace`, `asdict`, `is_dataclass`) holds.  Variables that only the
constructor takes, slots and order are not known here: for those there is the standard one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, asdict, field, fields, is_dataclass, replace
from dataclasses import dataclass as _standard
from functools import partial
from operator import attrgetter
from reprlib import recursive_repr
from types import MethodType
from typing import TYPE_CHECKING, Any

__all__ = ["MISSING", "Field", "asdict", "dataclass", "field", "fields", "is_dataclass", "replace"]


class _Constructor:
    """The `__init__` of a class until it is asked for."""

    def __init__(self, of: type, frozen: bool) -> None:
        self.of, self.frozen = of, frozen

    def __get__(self, one: object, owner: object = None) -> Any:
        made = _constructor(self.of, self.frozen)
        type.__setattr__(self.of, "__init__", made)
        return made if one is None else MethodType(made, one)


def _constructor(of: type, frozen: bool) -> Callable[..., None]:
    """Compile the constructor: fields in their order, those by name last, then `__post_init__`."""
    taken = sorted((one for one in fields(of) if one.init), key=lambda one: bool(one.kw_only))
    first = next((k for k, one in enumerate(taken) if one.kw_only), len(taken))
    words = ["_self_", *map(_parameter, taken)]
    words[first + 1 : first + 1] = ["*"] if first < len(taken) else []
    lines = [_assigned(one, frozen) for one in fields(of) if one.init or one.default_factory is not MISSING]
    lines += ["_self_.__post_init__()"] if hasattr(of, "__post_init__") else []
    body = "".join(f"  {line}\n" for line in lines or ["pass"])
    source = f"def made(_set_, _fields_, _anew_):\n def __init__({', '.join(words)}):\n{body} return __init__"
    found: dict[str, Any] = {}
    exec(source, vars(sys.modules[of.__module__]) if of.__module__ in sys.modules else {}, found)
    made = found["made"](object.__setattr__, {one.name: one for one in taken} | _factories(of), MISSING)
    made.__qualname__ = f"{of.__qualname__}.__init__"
    made.__module__ = of.__module__
    made.__annotations__ = {one.name: one.type for one in taken} | {"return": None}
    return made


def _factories(of: type) -> dict[str, Field[Any]]:
    return {one.name: one for one in fields(of) if one.default_factory is not MISSING}


def _parameter(one: Field[Any]) -> str:
    if one.default_factory is not MISSING:
        return f"{one.name}=_anew_"
    return one.name if one.default is MISSING else f"{one.name}=_fields_[{one.name!r}].default"


def _assigned(one: Field[Any], frozen: bool) -> str:
    value, anew = one.name, f"_fields_[{one.name!r}].default_factory()"
    if one.default_factory is not MISSING:
        value = f"{anew} if {one.name} is _anew_ else {one.name}" if one.init else anew
    return f"_set_(_self_, {one.name!r}, {value})" if frozen else f"_self_.{one.name} = {value}"


def _contents(of: type) -> Callable[[Any], tuple[Any, ...]]:
    """What two values of a class are compared by."""
    names = [one.name for one in fields(of) if one.compare]
    if len(names) > 1:
        return attrgetter(*names)
    return (lambda one: (getattr(one, names[0]),)) if names else (lambda _: ())


def _compared(of: type, hashed: bool) -> dict[str, Any]:
    contents = _contents(of)

    def equal(self: Any, other: Any) -> Any:
        return contents(self) == contents(other) if other.__class__ is self.__class__ else NotImplemented

    def summed(self: Any) -> int:
        return hash(contents(self))

    return {"__eq__": equal, "__hash__": summed if hashed else None}


@recursive_repr()
def _text(self: Any) -> str:
    shown = ", ".join(f"{one.name}={getattr(self, one.name)!r}" for one in fields(self) if one.repr)
    return f"{type(self).__qualname__}({shown})"


def _refused(self: Any, name: str, *value: object) -> None:
    """No field is set, nor anything else in a value of the class itself; a plain class below it keeps its own."""
    if "__dataclass_fields__" in vars(type(self)) or name in {one.name for one in fields(self)}:
        raise FrozenInstanceError(f"cannot {'assign to' if value else 'delete'} field {name!r}")
    (object.__setattr__ if value else object.__delattr__)(self, name, *value)


def _made(of: Any, *, init: bool, repr: bool, eq: bool, frozen: bool, kw_only: bool) -> Any:
    own = vars(of)
    hashable = "__hash__" in own and not (own["__hash__"] is None and "__eq__" in own)
    of.__doc__ = of.__doc__ or f"{of.__name__}({', '.join(own.get('__annotations__', ()))})"  # else by its signature
    # below another class the standard one compares what is frozen, and brings the refusals itself
    below = any(hasattr(base, "__dataclass_fields__") for base in of.__mro__[1:])
    _standard(init=False, repr=False, eq=False, frozen=frozen and below, kw_only=kw_only)(of)
    methods: dict[str, Any] = {"__init__": _Constructor(of, frozen)} if init else {}
    methods |= {"__repr__": _text} if repr else {}
    methods |= _compared(of, frozen) if eq else {}
    if hashable:
        methods.pop("__hash__", None)
    if frozen and not below:
        methods |= {"__setattr__": _refused, "__delattr__": _refused}
        of.__dataclass_params__.frozen = True
    for name, method in methods.items():
        if name not in own or name == "__hash__":
            setattr(of, name, method)
    return of


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(of=None, /, *, init=True, repr=True, eq=True, frozen=False, kw_only=False):
        """A class of fields, as `dataclasses.dataclass` makes it of the same words."""
        made = partial(_made, init=init, repr=repr, eq=eq, frozen=frozen, kw_only=kw_only)
        return made if of is None else made(of)
