"""Settings as Python's values, handed on as the texts that the table of settings reads."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from . import _native

if TYPE_CHECKING:
    from typing import Union

    Number = Union[int, float]
    #: Terms as one text (``"x, v, sgn(v)"``), a list of them, or lists for single equations (``{"v1": ["x1"], "v2": "x2-x1"}``).
    Terms = Union[str, Sequence[str], Mapping[str, Union[str, Sequence[str]]]]


class Reading(TypedDict, total=False):
    """How records are read and prepared. The names are those of the commands' options, with ``_`` for ``-``."""

    columns: str | Mapping[str, str | int]
    only_named: bool
    rate: Number
    kind: str
    crop: str | tuple[Number | None, Number | None]
    prepare: str | Sequence[str]
    hold_out: Number
    bridge: int


class Settings(Reading, total=False):
    """Everything that may be said of a study; what is left out is chosen from the data. The names are those of the commands'
    options, with ``_`` for ``-``, as the book's reference describes them."""

    terms: Terms
    lock: Terms
    drop: Terms
    fix: str | Sequence[str] | Mapping[str, Number]
    constrain: str | Sequence[str]
    mass: Number
    differentiation: str
    window: int
    order: int
    unfiltered_library: bool
    form: str
    half_width: int
    regressor: str
    threshold: Number
    ridge: Number
    scaling: str
    fit_kinematics: bool
    refine: bool
    initial: int
    estimate: str | Sequence[str]


#: How each setting is given, by its name.
FORMS: dict[str, str] = {name: form for name, _, form in _native.settings()}


def _number(value: Any) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return str(value)


def _listed(value: Any) -> str:
    return value if isinstance(value, str) else ", ".join(_number(v) for v in value)


def _of(name: str, value: Any) -> list[str]:
    """The texts of one setting, one for each time that it is given."""
    if name == "columns" and isinstance(value, Mapping):
        return [",".join(f"{key}={column}" for key, column in value.items())]
    if name == "crop" and isinstance(value, tuple):
        return [":".join("" if end is None else _number(end) for end in value)]
    if name == "fix" and isinstance(value, Mapping):
        return [f"{term}={_number(v)}" for term, v in value.items()]
    if isinstance(value, Mapping):
        return ["; ".join(f"{equation}: {_listed(terms)}" for equation, terms in value.items())]
    if name == "fix" and not isinstance(value, str):
        return [str(v) for v in value]
    if isinstance(value, (list, tuple)):
        return [_listed(value)]
    return [_number(value)]


def texts(settings: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Settings with their texts, as the native half takes them. ``None`` leaves a setting open.

    Raises:
        TypeError: there is no setting of a name.
    """
    told: list[tuple[str, str]] = []
    for key, value in settings.items():
        name = key.replace("_", "-")
        form = FORMS.get(name)
        if form is None:
            near = difflib.get_close_matches(name, FORMS, 1)
            hint = f"; did you mean `{near[0].replace('-', '_')}`?" if near else ""
            raise TypeError(f"there is no setting `{key}`{hint}")
        if value is None or (form == "flag" and not value):
            continue
        if form == "flag":
            told.append((name, ""))
        else:
            told.extend((name, text) for text in _of(name, value))
    return told


#: The settings that say how a source is read.
READING = ("columns", "only-named", "rate", "kind", "bridge")


def of_reading(told: list[tuple[str, str]]) -> list[tuple[str, str]]:
    return [(name, text) for name, text in told if name in READING]
