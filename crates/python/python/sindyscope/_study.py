"""The studies: identify, diagnose, report; what they read, and what the virtual rig makes."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _native
from ._error import Error
from ._records import Record, sources
from ._results import Diagnosis, Identification, Structure
from ._settings import _number, of_reading, texts

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._settings import Reading, Settings, Terms

    #: Told what is being done, and the share of it that is done (0 to 1), or None where that is not known.
    Progress = Callable[[str, float | None], object]


def read(path: str | os.PathLike[str], **settings: Unpack[Reading]) -> list[Record]:
    """The records of a file: CSV, MATLAB, HDF5, NumPy, Excel, LabVIEW, TDMS, UFF, WAV, MDF.

    Args:
        path: The file.
        settings: What its header does not say: ``columns``, ``only_named``, ``rate`` (Hz), ``kind``, ``bridge``.

    Raises:
        Error: the file cannot be read, or its samples cannot be used, with the place and the reason.
    """
    return [Record(native) for native in _native.read(path, of_reading(texts(settings)))]


def _both(
    t: Any, x: Any, u: Any, test: Any, told: list[tuple[str, str]], given: dict[str, Any]
) -> tuple[list[list[_native.NativeRecord]], list[list[_native.NativeRecord]]]:
    fit = sources(t, x, u, told, **given)
    held_out = [] if test is None else sources(test, None, None, told, name="test", units=given["units"])
    return fit, held_out


def identify(
    t: Any,
    x: Any = None,
    u: Any = None,
    *,
    test: Any = None,
    v: Any = None,
    a: Any = None,
    name: str | None = None,
    units: Mapping[str, str] | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> Identification:
    """Identifies the equation of motion: smooth, differentiate, regress sparsely, simulate.

    The interpreter's lock is let go while it works; Ctrl+C stops it.

    Args:
        t: Time of each sample in s, shape ``(n,)``, or the sampling interval; or a frame, a mapping of names to arrays, a file,
            a record, or a list of these.
        x, v, a: Displacement, velocity, acceleration, shape ``(n,)`` or ``(n, masses)``, or a list of these, one a record.
        u: Input (force or base displacement), shape ``(n,)`` or ``(n, inputs)``, or a list.
        test: Held-out records, never fitted (only their initial state is): as ``t``, or a tuple ``(t, x, u)``.
        name: The record's name.
        units: Units by name: ``{"x": "mm", "u": "N"}``; SI where nothing is said.
        progress: Called as ``progress(what, share)``, share 0 to 1 or None; an exception in it stops the work.
        settings: As the command's options: ``terms``, ``lock``, ``window``, ``threshold``, ``kind``, ``hold_out``, …

    Raises:
        Error: the work could not be done; ``advice`` says what to try.
    """
    told = texts(settings)
    fit, held_out = _both(t, x, u, test, told, {"v": v, "a": a, "name": name, "units": units})
    return Identification(_native.identify(fit, held_out, told, progress))


def _listed(terms: Any) -> str | None:
    return None if terms is None else dict(texts({"terms": terms}))["terms"]


def diagnose(
    t: Any,
    x: Any = None,
    u: Any = None,
    *,
    test: Any = None,
    v: Any = None,
    a: Any = None,
    name: str | None = None,
    units: Mapping[str, str] | None = None,
    terms: Terms | None = None,
    lock: Terms | None = None,
    max_effects: int = 3,
    effects: str | os.PathLike[str] | None = None,
    initial: int | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Reading],
) -> Diagnosis:
    """Finds what a model lacks: where simulation and measurement disagree, which effect that is, and how the gap shrinks with it.

    Args:
        t, x, u, v, a, test, name, units, progress: As for :func:`identify`.
        terms: The base model's terms; left out: linear springs and dampers.
        lock: Known physics: terms that are in the base model besides.
        max_effects: At most so many effects are added, 0 to 20.
        effects: A TOML file of effects of one's own, looked for beside those of the catalogue.
        initial: The initial state of every held-out record is estimated from so many samples alone, which its score leaves out.
        settings: How records are read and prepared: ``columns``, ``crop``, ``prepare``, ``hold_out``, …

    Raises:
        Error: the search could not be made; ``advice`` says what to try.
    """
    told = texts({**settings, "initial": initial})
    if not 0 <= max_effects <= 20:
        raise Error(f"max_effects is {max_effects}: it lies between 0 and 20", "")
    fit, held_out = _both(t, x, u, test, told, {"v": v, "a": a, "name": name, "units": units})
    known = [] if lock is None else [text for _, text in texts({"lock": lock})]
    own = None if effects is None else os.fspath(effects)
    return Diagnosis(_native.diagnose(fit, held_out, told, (_listed(terms), known, max_effects, own), progress))


def modes(
    t: Any,
    x: Any = None,
    u: Any = None,
    *,
    test: Any = None,
    v: Any = None,
    a: Any = None,
    name: str | None = None,
    units: Mapping[str, str] | None = None,
    number: int | Literal["auto"] | None = None,
    poles: str | Iterable[tuple[float, float]] | None = None,
    missing: bool = False,
    progress: Progress | None = None,
    **settings: Unpack[Reading],
) -> Structure:
    """Finds the modes of a structure with any number of sensors, and the force that they lack: the commands' ``--base modes``.

    Args:
        t, x, u, v, a, test, name, units, progress: As for :func:`identify`; sensors in columns, shape ``(n, sensors)``.
        number: How many modes; left out or ``"auto"``: as many as the data bear.
        poles: Poles from which the modes are fitted, none is chosen: pairs of natural frequency (Hz) and damping ratio, or a text as
            the command's ``--poles`` has it, ``"3.47:0.004,5.19:0.006"``.
        missing: Whether the force is searched for that a linear structure lacks, and where it acts; it takes longer.
        settings: How records are read and prepared: ``columns``, ``crop``, ``prepare``, ``hold_out``, …

    Raises:
        Error: no modes can be found; ``advice`` says what to try.
    """
    told = texts(settings)
    base: list[tuple[str, str]] = []
    if number is not None and number != "auto":
        if isinstance(number, str):
            raise Error(f'number is "{number}": it is a whole number or "auto"', "leave it out, and the data say how many")
        if number < 1:
            raise Error(f"number is {number}: a structure has one mode at least", "leave it out, and the data say how many")
        base.append(("modes", str(operator.index(number))))
    if poles is not None:
        if base:
            raise Error("both `number` and `poles` are given: every pole stands for one mode", "leave out `number`")
        listed = poles if isinstance(poles, str) else ",".join(f"{float(f)!r}:{float(d)!r}" for f, d in poles)
        base.append(("poles", listed))
    fit, held_out = _both(t, x, u, test, told, {"v": v, "a": a, "name": name, "units": units})
    return Structure(*_native.modes(fit, held_out, told, (base, missing), progress))


def report(
    t: Any,
    x: Any = None,
    u: Any = None,
    *,
    out: str | os.PathLike[str],
    test: Any = None,
    v: Any = None,
    a: Any = None,
    name: str | None = None,
    units: Mapping[str, str] | None = None,
    title: str | None = None,
    sections: str | None = None,
    paper: str = "a4",
    diagnose: bool = False,
    base: Terms | None = None,
    max_effects: int = 3,
    effects: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> Identification:
    """Writes the study as a document, and returns what was identified.

    Args:
        out: The document: ``.html`` (self-contained), ``.pdf`` or ``.png`` by the ending.
        title: Its title; left out: the names of the records.
        sections: Its sections in their order, as ``"equation, response"``; left out: all.
        paper: ``"a4"`` or ``"letter"``, of a PDF.
        diagnose: Whether missing effects are searched too.
        base, max_effects, effects: The search's base model, most effects, and file of effects of one's own.

    The rest is as for :func:`identify`.
    """
    told = texts(settings)
    fit, held_out = _both(t, x, u, test, told, {"v": v, "a": a, "name": name, "units": units})
    if paper not in ("a4", "letter"):
        raise Error(f"there is no paper {paper!r}", "say a4 or letter")
    files = [t] if isinstance(t, (str, os.PathLike)) else []
    stems = [Path(f).stem for f in files] or [of[0].name for of in fit if of]
    usual = ", ".join(stems) if len(stems) <= 3 else f"{', '.join(stems[:2])} and {len(stems) - 2} more"
    document: dict[str, Any] = {
        "out": os.fspath(out),
        "title": title if title is not None else usual,
        "sections": sections,
        "letter": paper == "letter",
        "search": (_listed(base), [], max_effects, None if effects is None else os.fspath(effects)) if diagnose else None,
    }
    return Identification(_native.report(fit, held_out, told, document, progress))


def generate(scenario: str, out: str | os.PathLike[str] | None = None, **options: Any) -> list[Record]:
    """Records of the virtual test rig, whose equation of motion is known.

    Args:
        scenario: Its name; :func:`scenarios` lists them.
        out: A CSV file to write besides.
        options: As the command's: ``seed``, ``noise`` (``1e-5`` or ``"1%"``), ``rate``, ``duration``, ``amplitude``,
            ``frequencies``, ``initial``, ``set={"k": 358.7}``, …; of ``hidden``: ``effect``, ``excitation``, ``ratio``, …

    Raises:
        Error: there is no such scenario, or an option cannot be what it was said to be.
    """
    told: list[tuple[str, str]] = []
    for key, value in options.items():
        name = key.replace("_", "-")
        if value is None or value is False:
            continue
        if isinstance(value, Mapping):
            told += [(name, f"{k}={_number(v)}") for k, v in value.items()]
        elif isinstance(value, (list, tuple)):
            told.append((name, ",".join(_number(v) for v in value)))
        else:
            told.append((name, "" if value is True else _number(value)))
    made, comments = _native.generate(scenario, told)
    if out is not None:
        Path(out).write_bytes(_native.csv(made, comments))
    return [Record(native) for native in made]


def scenarios() -> dict[str, str]:
    """The scenarios of the virtual rig, each with what it is."""
    return dict(_native.scenario_names())


def effects(effect: str | None = None) -> dict[str, Any]:
    """The catalogue of effects that :func:`diagnose` looks for, as the JSON of the command ``effects``.

    Args:
        effect: One of them by its name; left out: all.
    """
    catalogue: dict[str, Any] = json.loads(_native.effects())
    if effect is not None:
        only = [entry for entry in catalogue["effects"] if entry["effect"] == effect]
        if not only:
            raise Error(f"there is no effect {effect!r}", "sindyscope.effects() has all")
        catalogue["effects"] = only
    return catalogue
