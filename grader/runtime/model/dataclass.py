"""The decorator `dataclass` of the standard library, but a class compiles its `__init__` when that is first looked up.

The standard library compiles up to six methods for each class, while its module is imported; most classes are then not
used in one run. That takes 90 ms of processor time more, of the 350 ms of a short `grade`. Here every method but
`__init__` is a closure. Fields, slots, and what both say of inheritance are made by the standard library.
"""

from __future__ import annotations

import dataclasses
import operator
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

Fields = tuple[Field[Any], ...]

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls: type | None = None, /, **options: bool) -> Any:
        """Make a class a dataclass. `InitVar` and the options `init`, `repr` and `unsafe_hash` are not supported."""
        if cls is None:
            return lambda cls: _decorated(cls, **options)
        return _decorated(cls, **options)


def _decorated(cls: Any, *, eq: bool = True, order: bool = False, frozen: bool = False, **standard: bool) -> type:
    # For a class without a docstring, the standard library would write one from the signature of its __init__
    cls.__doc__ = cls.__doc__ or cls.__name__
    hashes = "__hash__" in vars(cls) and not (cls.__hash__ is None and "__eq__" in vars(cls))
    # The standard library refuses to mix frozen classes and others. It then makes __setattr__ of the few derived ones
    derived = dataclasses.is_dataclass(cls)
    cls = dataclasses.dataclass(init=False, repr=False, eq=False, frozen=frozen and derived, **standard)(cls)
    params = cls.__dataclass_params__
    params.init = params.repr = True
    params.eq, params.order, params.frozen = eq, order, frozen
    every = fields(cls)
    methods: dict[str, Any] = {"__init__": _Init(cls, frozen=frozen), "__repr__": _repr_of(cls)}
    if eq:
        methods |= _comparisons_of(every, ("__eq__", "__lt__", "__le__", "__gt__", "__ge__") if order else ("__eq__",))
    if frozen:
        methods |= _frozen_methods_of(cls, every)
    if frozen and standard.get("slots"):
        methods |= {"__getstate__": _get_state, "__setstate__": _set_state}
    for name, method in methods.items():
        if name not in vars(cls):
            setattr(cls, name, method)
    if eq and not hashes:
        cls.__hash__ = _hash_of(every) if frozen else None
    return cls  # type: ignore[no-any-return]


class _Init:
    """The `__init__` of a class until it is looked up, which replaces it with a compiled function."""

    def __init__(self, cls: Any, *, frozen: bool) -> None:
        self._cls = cls
        self._frozen = frozen

    def __get__(self, instance: Any, owner: type) -> Any:
        init: Any = _compiled_init(self._cls, frozen=self._frozen)
        self._cls.__init__ = init
        return init.__get__(instance, owner)


def _compiled_init(cls: type, *, frozen: bool) -> Callable[..., None]:
    """Compile the same function as the standard library does."""
    known: dict[str, Any] = {"_set": object.__setattr__, "_absent": MISSING}
    given = [field for field in fields(cls) if field.init]
    keywords = [_argument(field) for field in given if field.kw_only]
    arguments = ["self", *(_argument(field) for field in given if not field.kw_only), *(["*"] if keywords else [])]
    body = []
    for field in fields(cls):
        if field.default_factory is not MISSING:
            known[f"_new_{field.name}"] = field.default_factory
        elif field.default is not MISSING:
            known[f"_default_{field.name}"] = field.default
        elif not field.init:
            continue  # left to __post_init__
        value = _value(field)
        body.append(f"_set(self, {field.name!r}, {value})" if frozen else f"self.{field.name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    lines = "\n  ".join(body or ["pass"])
    text = (
        f"def make({', '.join(known)}):\n def __init__({', '.join(arguments + keywords)}):\n  {lines}\n return __init__"
    )
    made: dict[str, Any] = {}
    exec(text, vars(sys.modules[cls.__module__]), made)  # noqa: S102 - composed of nothing but names of fields
    init: Any = made["make"](**known)
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {field.name: field.type for field in given} | {"return": None}
    return init  # type: ignore[no-any-return]


def _argument(field: Field[Any]) -> str:
    if field.default_factory is not MISSING:
        return f"{field.name}=_absent"
    return field.name if field.default is MISSING else f"{field.name}=_default_{field.name}"


def _value(field: Field[Any]) -> str:
    if field.default_factory is MISSING:
        return field.name if field.init else f"_default_{field.name}"
    new = f"_new_{field.name}()"
    return f"{new} if {field.name} is _absent else {field.name}" if field.init else new


def _values_of(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Make a function that returns the values of an instance's attributes."""
    if len(names) > 1:
        return operator.attrgetter(*names)
    if not names:
        return lambda _: ()
    value = operator.attrgetter(*names)  # of one name, it makes no tuple
    return lambda instance: (value(instance),)


def _repr_of(cls: type) -> Callable[[Any], str]:
    @recursive_repr("...")
    def represent(self: Any) -> str:
        shown = [f"{field.name}={getattr(self, field.name)!r}" for field in fields(cls) if field.repr]
        return f"{type(self).__qualname__}({', '.join(shown)})"

    return represent


def _comparisons_of(every: Fields, methods: Iterable[str]) -> dict[str, Callable[[Any, Any], bool]]:
    values = _values_of([field.name for field in every if field.compare])

    def comparison(operation: Callable[[Any, Any], bool]) -> Callable[[Any, Any], bool]:
        def compare(self: Any, other: Any) -> bool:
            return operation(values(self), values(other)) if other.__class__ is self.__class__ else NotImplemented

        return compare

    return {name: comparison(getattr(operator, name)) for name in methods}


def _hash_of(every: Fields) -> Callable[[Any], int]:
    hashed = [field for field in every if (field.compare if field.hash is None else field.hash)]
    values = _values_of([field.name for field in hashed])
    return lambda self: hash(values(self))


def _frozen_methods_of(cls: Any, every: Fields) -> dict[str, Callable[..., None]]:
    names = {field.name for field in every}

    def set_attribute(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def delete_attribute(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": set_attribute, "__delattr__": delete_attribute}


def _get_state(self: Any) -> list[Any]:
    return [getattr(self, field.name) for field in fields(self)]


def _set_state(self: Any, state: Sequence[Any]) -> None:
    # Pickles of a version with other fields are not read; the standard library ends with the shorter of the two as well
    for field, value in zip(fields(self), state, strict=False):
        object.__setattr__(self, field.name, value)
