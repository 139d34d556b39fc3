"""The decorator of frozen values beside the standard one, on the same classes."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from typing import Any, ClassVar, get_type_hints

import pytest

from seatrial.core.values import dataclass


def classes(made: Callable[..., Any]) -> dict[str, Any]:
    """Some classes by one decorator."""

    @made(frozen=True)
    class Plain:
        """Said."""

        x: float
        y: float = 2.0
        kind: ClassVar[str] = "plain"

    @made(frozen=True, kw_only=True)
    class Below(Plain):
        z: tuple[float, ...] = ()

        def __post_init__(self) -> None:
            if self.z == (0.0,):
                raise ValueError("zero")

    @made(frozen=True)
    class Made:
        a: int
        many: list[int] = field(default_factory=lambda: [1, 2])
        hidden: int = field(default=3, repr=False, compare=False)
        fixed: int = field(default=4, init=False)
        grown: list[int] = field(default_factory=list, init=False, compare=False)
        named: str = field(default="n", kw_only=True)
        needed: str = field(kw_only=True)

    @made
    class Open:
        x: int = 1

    @made(frozen=True)
    class Empty:
        pass

    @made(frozen=True, eq=False, repr=False)
    class Same:
        x: int = 1

    @made(frozen=True)
    class Own:
        x: int = 1

        def __eq__(self, other: object) -> bool:
            return True

        def __hash__(self) -> int:
            return 7

        def __repr__(self) -> str:
            return "own"

    @made(frozen=True)
    class Equal:
        x: int = 1

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Equal)

    @made(frozen=True)
    class Mixed:
        named: int = field(default=0, kw_only=True)
        x: int
        y: int = 2

    @made(frozen=True, init=False)
    class Started:
        x: int = 1

        def __init__(self, twice: int) -> None:
            object.__setattr__(self, "x", 2 * twice)

    return {name: one for name, one in locals().items() if isinstance(one, type)}


OURS, THEIRS = classes(dataclass), classes(dataclasses.dataclass)
CALLS: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    ("Plain", (1.0,), {}), ("Plain", (1.0, 3.0), {}), ("Plain", (), {"y": 1.0, "x": 5.0}),
    ("Plain", (float("inf"),), {}), ("Below", (1.0,), {"z": (1.0, 2.0)}), ("Below", (1.0, 2.0), {}),
    ("Made", (1,), {"needed": "w"}), ("Made", (2, [5], 9), {"needed": "w", "named": "v"}),
    ("Open", (), {}), ("Open", (2,), {}), ("Empty", (), {}), ("Same", (), {}), ("Own", (4,), {}), ("Equal", (), {}),
    ("Started", (4,), {}), ("Mixed", (1,), {}), ("Mixed", (1, 3), {"named": 4}),
]  # fmt: skip
WRONG: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    ("Plain", (), {}), ("Plain", (1, 2, 3), {}), ("Plain", (1.0,), {"w": 1}), ("Below", (1.0, 2.0, ()), {}),
    ("Made", (1,), {}), ("Made", (1,), {"needed": "w", "fixed": 1}), ("Empty", (1,), {}),
]  # fmt: skip


def pair(name: str, args: tuple[Any, ...], named: dict[str, Any]) -> tuple[Any, Any]:
    return OURS[name](*args, **named), THEIRS[name](*args, **named)


@pytest.mark.parametrize(("name", "args", "named"), CALLS)
def test_a_value_is_that_of_the_standard_decorator(name: str, args: tuple[Any, ...], named: dict[str, Any]) -> None:
    ours, theirs = pair(name, args, named)
    assert vars(ours) == vars(theirs)
    if name != "Same":  # whose text has an address
        assert repr(ours) == repr(theirs)
    assert dataclasses.is_dataclass(ours)
    assert [(one.name, one.type, one.kw_only) for one in dataclasses.fields(ours)] == [
        (one.name, one.type, one.kw_only) for one in dataclasses.fields(theirs)]  # fmt: skip
    assert inspect.signature(OURS[name]).parameters.keys() == inspect.signature(THEIRS[name]).parameters.keys()
    assert OURS[name].__match_args__ == THEIRS[name].__match_args__


@pytest.mark.parametrize(("name", "args", "named"), WRONG)
def test_wrong_calls_are_refused_in_the_same_words(name: str, args: tuple[Any, ...], named: dict[str, Any]) -> None:
    said = []
    for some in (OURS, THEIRS):
        with pytest.raises(TypeError) as refused:
            some[name](*args, **named)
        said.append(str(refused.value))
    assert said[0] == said[1]


@pytest.mark.parametrize("name", OURS)
def test_equality_and_hash_are_the_same(name: str) -> None:
    values = [pair(*call) for call in CALLS] + [pair(*call) for call in CALLS]
    for mine, its in ((a, b) for a, b in values if type(a).__name__ == name):
        assert [mine == other for other, _ in values] == [its == other for _, other in values]
        for one in (mine, its):
            assert (one != one) is False
        assert (type(mine).__hash__ is None) == (type(its).__hash__ is None)
    if name in ("Plain", "Below", "Own"):
        some = [(a, b) for a, b in values if type(a).__name__ == name]
        assert [hash(a) for a, _ in some] == [hash(b) for _, b in some]


def test_a_value_beside_nan_is_itself() -> None:
    nan = float("nan")
    assert OURS["Plain"](nan) == OURS["Plain"](nan)


def test_a_field_that_is_not_compared_does_not_count() -> None:
    mine, other = (OURS["Made"](1, [2], hidden, needed="w") for hidden in (1, 2))
    assert mine == other


def test_nothing_is_set_or_deleted() -> None:
    for name, args in (("Plain", (1.0,)), ("Below", (1.0,)), ("Empty", ())):
        for some in (OURS, THEIRS):
            one = some[name](*args)
            for key in ("x", "other"):
                with pytest.raises(FrozenInstanceError, match=f"cannot assign to field '{key}'"):
                    setattr(one, key, 1)
                with pytest.raises(FrozenInstanceError, match=f"cannot delete field '{key}'"):
                    delattr(one, key)


def test_a_plain_class_below_keeps_what_is_its_own() -> None:
    for some in (OURS, THEIRS):
        below = type("Sub", (some["Plain"],), {})
        one = below(1.0)
        one.note = "mine"
        assert one.note == "mine"
        del one.note
        assert not hasattr(one, "note")
        with pytest.raises(FrozenInstanceError):
            one.x = 3.0


def test_values_that_are_not_frozen_are_set_and_have_no_hash() -> None:
    one = OURS["Open"]()
    one.x = 5
    assert one == OURS["Open"](5)
    assert OURS["Open"].__hash__ is None


def test_a_list_is_made_anew_for_each() -> None:
    first, second = (OURS["Made"](1, needed="w") for _ in range(2))
    assert first.many == second.many
    assert first.many is not second.many
    assert first.grown is not second.grown


def test_what_stands_after_the_constructor_is_done() -> None:
    with pytest.raises(ValueError, match="zero"):
        OURS["Below"](1.0, z=(0.0,))


def test_replace_and_asdict_are_the_library_s() -> None:
    one = OURS["Below"](1.0, z=(3.0,))
    assert dataclasses.replace(one, y=9.0) == OURS["Below"](1.0, 9.0, z=(3.0,))
    assert dataclasses.asdict(one) == {"x": 1.0, "y": 2.0, "z": (3.0,)}


def test_classes_of_the_standard_decorator_stand_below_ours_and_above() -> None:
    @dataclasses.dataclass(frozen=True)
    class Under(OURS["Plain"]):
        w: int = 0

    @dataclass(frozen=True)
    class Over(THEIRS["Plain"]):
        w: int = 0

    for one in (Under(1.0, 2.0, 3), Over(1.0, 2.0, 3)):
        assert (one.x, one.y, one.w) == (1.0, 2.0, 3)
        with pytest.raises(FrozenInstanceError):
            one.w = 1
    with pytest.raises(TypeError, match="non-frozen"):

        @dataclass
        class Loose(OURS["Plain"]):
            w: int = 0


def test_texts_of_a_circle_end() -> None:
    one = OURS["Open"]()
    one.x = one
    assert repr(one).endswith("Open(x=...)")


@dataclass(frozen=True)
class Sent:
    x: int = 1


def test_a_value_is_pickled() -> None:
    assert pickle.loads(pickle.dumps(Sent(5))) == Sent(5)
    assert Sent.__doc__ == "Sent(x)"
    assert Sent.__init__.__qualname__ == "Sent.__init__"


@pytest.mark.parametrize("name", ["Plain", "Below", "Made"])
def test_a_constructor_knows_the_names_of_its_module(name: str) -> None:
    """So that what stands in its annotations as text can be found."""
    hints = [get_type_hints(one[name].__init__) for one in (OURS, THEIRS)]
    assert hints[0] == hints[1]
