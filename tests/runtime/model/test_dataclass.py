"""The decorator `dataclass` of the grader makes classes that behave as those of the standard library."""

import copy
import dataclasses
import inspect
import operator
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from functools import partial
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.runtime.model.dataclass import dataclass

Decorator = Callable[..., Any]


def plain(dataclass: Decorator) -> type:
    @dataclass
    class Made:
        a: int
        b: str = "b"
        c: list[int] = field(default_factory=list)
        known: ClassVar[int] = 3

    return Made


def empty(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True)
    class Made:
        """No fields."""

    return Made


def frozen(dataclass: Decorator) -> type:
    @dataclass(frozen=True)
    class Made:
        a: int
        b: int = 2

    return Made


def slotted(dataclass: Decorator) -> type:
    @dataclass(slots=True)
    class Made:
        a: Any
        b: Any = None

    return Made


def frozen_slotted(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True)
    class Made:
        a: Any
        b: tuple[int, ...] = ()
        c: dict[str, int] = field(default_factory=dict, compare=False)
        d: int = field(default=5, repr=False, hash=False)

    return Made


def one_field(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True)
    class Made:
        a: Any

    return Made


def ordered(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True, order=True)
    class Made:
        a: Any
        b: int = 0

    return Made


def by_identity(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True, eq=False)
    class Made:
        a: Any

    return Made


def by_keyword(dataclass: Decorator) -> type:
    @dataclass(kw_only=True)
    class Made:
        a: int = 1
        b: int

    return Made


def partly_by_keyword(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True)
    class Made:
        a: int = field(kw_only=True)
        b: int
        c: int = field(default=3, kw_only=True)

    return Made


def computed(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True)
    class Made:
        a: int
        doubled: int = field(init=False)
        listed: list[int] = field(init=False, default_factory=list)
        constant: int = field(init=False, default=7)

        def __post_init__(self) -> None:
            object.__setattr__(self, "doubled", self.a * 2)

    return Made


def with_own_methods(dataclass: Decorator) -> type:
    @dataclass(frozen=True)
    class Made:
        a: Any

        def __init__(self, a: Any, more: int = 1) -> None:
            object.__setattr__(self, "a", (a, more))

        def __repr__(self) -> str:
            return "mine"

        def __eq__(self, other: object) -> bool:
            return isinstance(other, type(self))

        def __hash__(self) -> int:
            return 11

        def __getstate__(self) -> Any:
            return self.a

        def __setstate__(self, state: Any) -> None:
            object.__setattr__(self, "a", state)

    return Made


def with_own_equality(dataclass: Decorator) -> type:
    @dataclass(frozen=True)
    class Made:  # noqa: PLW1641 - the decorator adds __hash__
        a: Any

        def __eq__(self, other: object) -> bool:
            return True

    return Made


def mutable_with_own_hash(dataclass: Decorator) -> type:
    @dataclass
    class Made:
        a: Any

        def __hash__(self) -> int:
            return 12

    return Made


def derived(dataclass: Decorator) -> type:
    @dataclass(frozen=True, slots=True)
    class Above:
        a: int
        b: int = 2

    @dataclass(frozen=True, slots=True)
    class Made(Above):
        b: int = 3
        c: int = 4

    return Made


def derived_mutable(dataclass: Decorator) -> type:
    @dataclass
    class Above:
        a: int

        def __hash__(self) -> int:
            return 13

    @dataclass
    class Made(Above):
        b: int = 3

    return Made


def derived_undecorated(dataclass: Decorator) -> type:
    @dataclass(frozen=True)
    class Above:
        a: int

    class Made(Above):
        def __init__(self, a: int, *, more: int = 1) -> None:
            super().__init__(a + more)

    return Made


KINDS: tuple[Callable[[Decorator], type], ...] = (
    plain,
    empty,
    frozen,
    slotted,
    frozen_slotted,
    one_field,
    ordered,
    by_identity,
    by_keyword,
    partly_by_keyword,
    computed,
    with_own_methods,
    with_own_equality,
    mutable_with_own_hash,
    derived,
    derived_mutable,
    derived_undecorated,
)
VALUES = st.one_of(st.integers(-2, 2), st.text(max_size=2), st.just(()), st.lists(st.integers(0, 1), max_size=1))
ARGUMENTS = st.tuples(
    st.lists(VALUES, max_size=3), st.dictionaries(st.sampled_from(["a", "b", "c", "doubled", "more"]), VALUES)
)
COMPARISONS = (operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge)


def outcome(work: Callable[[], Any]) -> Any:
    """Do something, and return its result or what it raises, in a form that does not depend on the class."""
    try:
        return work()
    except (TypeError, AttributeError, ValueError) as error:
        return type(error), str(error)


def values(instance: Any) -> Any:
    return [(f.name, getattr(instance, f.name, "absent")) for f in dataclasses.fields(instance) if f.name != "a"]


def both(kind: Callable[[Decorator], type]) -> tuple[type, type]:
    return kind(dataclass), kind(dataclasses.dataclass)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@given(one=ARGUMENTS, other=ARGUMENTS)
def test_instances_of_both_decorators_behave_the_same(kind: Callable[[Decorator], type], one: Any, other: Any) -> None:
    """What can be done with instances has the same results and the same errors as in the standard library."""

    def operations(cls: type) -> list[Any]:
        made = [outcome(partial(cls, *arguments[0], **arguments[1])) for arguments in (one, other)]
        if not all(isinstance(instance, cls) for instance in made):
            return [instance if isinstance(instance, tuple) else "made" for instance in made]
        first, second = made
        # Of a frozen class with slots, older standard libraries raise a TypeError for a name that is no field
        names = {"a", "b", "unknown"} if hasattr(first, "__dict__") else {f.name for f in dataclasses.fields(first)}
        return [
            values(first),
            repr(first),
            [outcome(partial(compare, first, second)) for compare in COMPARISONS],
            first == copy.copy(first),
            first == "another",
            outcome(partial(hash, first)) if cls.__hash__ is not object.__hash__ else "by identity",
            [outcome(partial(setattr, first, name, 1)) for name in sorted(names)],
            [outcome(partial(delattr, second, name)) for name in sorted(names)],
            repr(copy.copy(first)) if kind is not derived_undecorated else "",
        ]

    ours, standard = both(kind)
    assert operations(ours) == operations(standard)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_classes_of_both_decorators_describe_themselves_the_same(kind: Callable[[Decorator], type]) -> None:
    """Signature, fields, slots, patterns and the parameters of the decorator are those of the standard library."""

    def described(cls: Any) -> list[Any]:
        parameters = inspect.signature(cls).parameters.values()
        return [
            [(each.name, each.kind, each.default is each.empty, each.annotation) for each in parameters],
            inspect.get_annotations(cls.__init__),
            cls.__init__.__qualname__,
            [(f.name, f.type, f.default, f.default_factory, f.init, f.compare) for f in dataclasses.fields(cls)],
            vars(cls).get("__slots__"),
            cls.__match_args__,
            {name: getattr(cls.__dataclass_params__, name) for name in ("init", "repr", "eq", "order", "frozen")},
            cls.__hash__ is None,
            hasattr(cls, "__dict__"),
        ]

    ours, standard = both(kind)
    assert described(ours) == described(standard)


@dataclass(frozen=True, slots=True)
class Kept:
    a: int
    b: list[int] = field(default_factory=list)


def test_an_instance_survives_pickling_and_replacing() -> None:
    """A frozen class with slots can be pickled, copied and changed by `dataclasses.replace`."""
    kept = Kept(1, [2])
    assert [pickle.loads(pickle.dumps(kept, protocol)) for protocol in range(2, 6)] == [kept] * 4
    assert copy.deepcopy(kept) == kept
    assert dataclasses.replace(kept, a=3) == Kept(3, [2])
    assert dataclasses.asdict(kept) == {"a": 1, "b": [2]}


def test_default_factories_make_a_value_for_each_instance() -> None:
    """Two instances do not share what a factory made."""
    assert Kept(1).b is not Kept(1).b


def test_init_is_compiled_once() -> None:
    """Nothing is compiled for a class that is not used, and `__init__` once for one that is, for those below it too."""
    used, unused = frozen(dataclass), frozen(dataclass)
    below = type("Below", (used,), {})
    assert not inspect.isfunction(vars(used)["__init__"])
    assert below(1).b == 2
    compiled = vars(used)["__init__"]
    assert inspect.isfunction(compiled)
    assert [used(1).b, below(1).b] == [2, 2]
    assert vars(used)["__init__"] is compiled
    assert "__init__" not in vars(below)
    assert not inspect.isfunction(vars(unused)["__init__"])


def test_a_class_without_a_docstring_is_not_compiled_for_one() -> None:
    """The docstring of a class without one is its name; a docstring that it has stays."""
    assert frozen(dataclass).__doc__ == "Made"
    assert empty(dataclass).__doc__ == "No fields."


@pytest.mark.parametrize("decorator", [dataclass, dataclasses.dataclass])
def test_frozen_classes_and_others_do_not_mix(decorator: Any) -> None:
    """The rules of inheritance hold, whichever of the two decorators the class below has."""
    for above, is_frozen in ((frozen(dataclass), False), (plain(dataclass), True)):
        with pytest.raises(TypeError, match="cannot inherit"):
            decorator(frozen=is_frozen)(type("Below", (above,), {}))


def test_a_standard_dataclass_can_be_derived() -> None:
    """The check of an author may derive from one of the grader's."""

    @dataclasses.dataclass(frozen=True)
    class Below(frozen(dataclass)):  # type: ignore[misc]
        c: int = 3

    made = Below(1)
    assert repr(made).endswith("Below(a=1, b=2, c=3)")
    assert made == Below(1, 2, 3)
    with pytest.raises(FrozenInstanceError):
        made.a = 2


def test_an_instance_that_holds_itself_can_be_shown() -> None:
    """The repr says `...` where the instance occurs in itself."""
    one = slotted(dataclass)(1)
    one.b = [one]
    assert repr(one).endswith("Made(a=1, b=[...])")


def test_a_field_without_annotation_is_refused() -> None:
    """What the standard library refuses, it refuses here."""
    with pytest.raises(TypeError, match="no type annotation"):
        dataclass(type("Made", (), {"a": field()}))
