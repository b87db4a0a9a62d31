"""Records from arrays, frames and files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._error import Error
from ._settings import of_reading, texts

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

    from ._settings import Reading

    Array = npt.NDArray[np.float64]

#: Headings that name the record of a row.
_LABELS = ("record", "run", "trial", "id")


class Record:
    """One trajectory: evenly sampled channels of one length. Made by :func:`records`, :func:`read` and :func:`generate`.

    ``record["x"]`` is a channel's values (``x`` is short for ``x1``), ``record.t`` the time of each sample in s.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _native.NativeRecord) -> None:
        self._native = native

    @property
    def name(self) -> str:
        """Short name."""
        return self._native.name

    @property
    def t(self) -> Array:
        """Time of each sample, s."""
        return self._native.time()

    @property
    def dt(self) -> float:
        """Sampling interval, s."""
        return self._native.interval

    @property
    def channels(self) -> list[str]:
        """Short names of what was measured: ``x1``, ``u1``, …; what was only estimated is left out."""
        return [role for role, _, _, estimated in self._native.channels() if not estimated]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each channel; empty where it is SI and was not said."""
        return {role: unit for role, _, unit, estimated in self._native.channels() if not estimated}

    @property
    def notices(self) -> list[str]:
        """What was found and done while reading, one sentence each."""
        return self._native.notices

    @property
    def source(self) -> str | None:
        """The file it was read from."""
        source = self._native.source
        return None if source is None else os.fspath(source)

    def __getitem__(self, channel: str) -> Array:
        """The values of a channel in its unit, shape ``(n,)``."""
        wanted = channel if channel[-1:].isdigit() else f"{channel}1"
        for place, (role, *_) in enumerate(self._native.channels()):
            if role == wanted:
                return self._native.values(place)
        raise KeyError(channel)

    def __len__(self) -> int:
        return self._native.samples

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def keys(self) -> list[str]:
        return self.channels

    def __repr__(self) -> str:
        return f"<Record {self.name!r}: {', '.join(self.channels)}, {len(self)} samples at {1 / self.dt:.6g} Hz>"

    def __reduce__(self) -> tuple[Any, ...]:
        native = self._native
        channels = [
            (role, name, unit, native.values(k).tolist(), estimated)
            for k, (role, name, unit, estimated) in enumerate(native.channels())
        ]
        return _restored, (native.name, native.start, native.interval, channels, native.notices, native.source)


def _restored(*parts: Any) -> Record:
    return Record(_native.NativeRecord.of(*parts))


def _array(values: Any, what: str) -> Array:
    """Values as numbers, missing ones as NaN; NumPy's own arrays of floats are not copied."""
    if isinstance(values, np.ma.MaskedArray):
        values = values.filled(np.nan)
    values = np.asarray(values)
    if values.dtype.kind in "mM":
        # Stamps or durations, as seconds from the first.
        first = values[0]
        return np.asarray((values - first) / np.timedelta64(1, "ns") * 1e-9, dtype=np.float64)
    if values.dtype.kind == "c":
        raise Error(f"`{what}` holds complex numbers; records are real", "give its real part")
    try:
        return np.asarray(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise Error(f"`{what}` holds something that is not a number", "give an array of numbers") from None


def _headed(name: str, units: Mapping[str, str]) -> str:
    unit = units.get(name)
    return name if not unit else f"{name} [{unit}]"


def _columns(symbol: str, values: Any, rows: int | None, units: Mapping[str, str]) -> list[tuple[str, Array]]:
    """One column, or one for each column of a matrix ``(samples, channels)``."""
    array = _array(values, symbol)
    if array.ndim == 1 or (array.ndim == 2 and array.shape[1] == 1):
        return [(_headed(symbol, units), array.reshape(-1))]
    if array.ndim != 2:
        raise Error(f"`{symbol}` has {array.ndim} dimensions", "give one (samples) or two (samples, channels)")
    if rows is not None and array.shape[0] != rows:
        shape = f"{array.shape[0]} rows and {array.shape[1]} columns"
        raise Error(f"`{symbol}` has {shape}, and there are {rows} times", "a row is a sample: transpose it")
    fallback = units.get(symbol, "")
    return [
        (_headed(name, {name: units.get(name, fallback)}), np.ascontiguousarray(array[:, k]))
        for k, name in enumerate(f"{symbol}{k + 1}" for k in range(array.shape[1]))
    ]


def _of_arrays(
    t: Any, x: Any, u: Any, v: Any, a: Any, name: str, units: Mapping[str, str], told: list[tuple[str, str]]
) -> list[_native.NativeRecord]:
    given = [(symbol, values) for symbol, values in (("x", x), ("v", v), ("a", a), ("u", u)) if values is not None]
    if not any(symbol != "u" for symbol, _ in given):
        raise Error("no motion is given", "give `x`, `v` or `a` beside the time")
    time = _array(t, "t")
    if time.ndim == 0:
        # A sampling interval.
        rows = np.shape(given[0][1])[0]
        time = float(time) * np.arange(rows)
    elif time.ndim != 1:
        raise Error(f"`t` has {time.ndim} dimensions", "give one time a sample, in seconds, or the interval alone")
    columns = [(_headed("t", units), time)]
    for symbol, values in given:
        columns += _columns(symbol, values, len(time), units)
    for heading, values in columns[1:]:
        if len(values) != len(time):
            raise Error(f"`{heading}` has {len(values)} values, and there are {len(time)} times")
    return _native.records(name, columns, told)


def _is_frame(data: Any) -> bool:
    return hasattr(data, "columns") and hasattr(data, "__getitem__") and not isinstance(data, np.ndarray)


def _of_frame(
    frame: Any, name: str, units: Mapping[str, str], told: list[tuple[str, str]]
) -> list[list[_native.NativeRecord]]:
    names = [str(c) for c in (frame.columns if _is_frame(frame) else frame)]
    keys = list(frame.columns if _is_frame(frame) else frame)
    columns: list[tuple[str, Array]] = []
    labels: Any = None
    label_name = ""
    for text, key in zip(names, keys):
        values = np.asarray(frame[key])
        if values.dtype.kind in "OUS" and text.strip().lower() in _LABELS:
            labels, label_name = values.astype(str), text
        elif values.dtype.kind in "fiubmM" or (values.dtype.kind == "O" and _numbers(values) is not None):
            columns.append((_headed(text, units), _array(_numbers(values), text)))
    index = getattr(frame, "index", None)
    index_name = getattr(index, "name", None)
    if index_name and not any(text == str(index_name) for text in names):
        columns.insert(0, (_headed(str(index_name), units), _array(np.asarray(index), str(index_name))))
    if labels is None:
        return [_native.records(name, columns, told)]
    sources = []
    for label in dict.fromkeys(labels.tolist()):
        rows = labels == label
        of_label = [(heading, np.ascontiguousarray(values[rows])) for heading, values in columns]
        sources.append(_native.records(str(label) if label_name else name, of_label, told))
    return sources


def _numbers(values: Any) -> Any:
    if values.dtype.kind != "O":
        return values
    try:
        return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
    except (TypeError, ValueError):
        return None


def sources(
    data: Any,
    x: Any,
    u: Any,
    told: list[tuple[str, str]],
    *,
    v: Any = None,
    a: Any = None,
    name: str | None = None,
    units: Mapping[str, str] | None = None,
) -> list[list[_native.NativeRecord]]:
    """The records of what a person gave, those of each source by themselves."""
    told = of_reading(told)
    units = units or {}
    known = name or "record"
    if any(given is not None for given in (x, v, a)):
        several = isinstance(x, (list, tuple)) and len(x) > 0 and np.ndim(x[0]) > 0
        if not several:
            return [_of_arrays(data, x, u, v, a, known, units, told)]
        count = len(x)

        def each(given: Any) -> Any:
            return given if isinstance(given, (list, tuple)) else [given] * count

        parts = list(zip(each(data), x, each(u), each(v), each(a)))
        named = [known if count == 1 else f"{known} {k + 1}" for k in range(count)]
        return [_of_arrays(*part, title, units, told) for title, part in zip(named, parts)]
    if isinstance(data, Record):
        return [[data._native]]
    if isinstance(data, (str, os.PathLike)):
        return [_native.read(data, told)]
    if _is_frame(data) or isinstance(data, Mapping):
        return _of_frame(data, known, units, told)
    if isinstance(data, (list, tuple)):
        whole = (str, os.PathLike, Record, Mapping, tuple)
        parts_of_one = isinstance(data, tuple) and not any(isinstance(p, whole) or _is_frame(p) for p in data)
        if len(data) in (2, 3) and (parts_of_one or all(isinstance(part, np.ndarray) for part in data)):
            # One record as (t, x) or (t, x, u).
            t, motion, *force = data
            return [_of_arrays(t, motion, force[0] if force else None, None, None, known, units, told)]
        found: list[list[_native.NativeRecord]] = []
        for part in data:
            found += sources(part, None, None, told, name=name, units=units)
        return found
    raise Error(
        f"no record can be made of a {type(data).__name__}",
        "give arrays as `t, x, u`, a frame, a file, a record, or a list of these",
    )


def records(
    t: Any,
    x: Any = None,
    u: Any = None,
    *,
    v: Any = None,
    a: Any = None,
    name: str | None = None,
    units: Mapping[str, str] | None = None,
    **settings: Unpack[Reading],
) -> list[Record]:
    """Records of arrays, a frame, a file or a list of these, read as a file of the same numbers would be.

    Args:
        t: Time of each sample in s, shape ``(n,)``, or the sampling interval; or a frame, a mapping of names to arrays, a file,
            a record, or a list of these.
        x, v, a: Displacement, velocity, acceleration, shape ``(n,)`` or ``(n, masses)``; any one is enough. NaN is missing.
        u: Input (force or base displacement), shape ``(n,)`` or ``(n, inputs)``.
        name: The record's name.
        units: Units by name: ``{"x": "mm", "u": "N"}``; SI where nothing is said.
        settings: How it is read: ``columns``, ``only_named``, ``rate``, ``kind``, ``bridge``.

    Raises:
        Error: the samples cannot be used, with the place and the reason.
    """
    found = sources(t, x, u, texts(settings), v=v, a=a, name=name, units=units)
    return [Record(native) for of_source in found for native in of_source]
