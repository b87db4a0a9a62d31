"""Many records, one after the other or over a cluster."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

from . import _native
from ._error import Error
from ._records import sources
from ._settings import texts
from ._study import diagnose as _diagnose
from ._study import identify

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._settings import Settings


class Batch(list[dict[str, Any]]):
    """One row a record: ``record``, ``status`` (``ok``, ``diverged`` or ``failed``), ``error`` (the sentence of a failure), errors
    and one column a coefficient (``v: x``) or parameter. In the order in which the records were given."""

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The rows of records that could not be identified."""
        return [row for row in self if row["status"] == "failed"]

    def columns(self) -> list[str]:
        """The names of all columns, those that come first in any row first."""
        return list(dict.fromkeys(name for row in self for name in row))

    def to_pandas(self) -> Any:
        """The table as a frame; needs ``pandas``."""
        import pandas

        return pandas.DataFrame(list(self), columns=self.columns())


def _title(record: Any, place: int) -> str:
    if isinstance(record, (str, os.PathLike)):
        return os.fspath(record)
    return str(getattr(record, "name", None) or f"record {place + 1}")


def _key(title: str, record: Any, told: list[tuple[str, str]]) -> str:
    """What tells a record from another one, or from what it was before: a file by its size and time, others by what they hold."""
    if isinstance(record, (str, os.PathLike)):
        return _native.NativeJournal.key(title, record)
    digest = hashlib.sha256()
    try:
        natives = [one for of in sources(record, None, None, told, v=None, a=None, name=None, units=None) for one in of]
    except Error as error:
        return f"{title}: {error.reason}"
    for native in natives:
        channels = native.channels()
        digest.update(repr((native.name, native.start, native.interval, channels)).encode())
        for place in range(len(channels)):
            digest.update(native.values(place).tobytes())
    return f"{title}: {digest.hexdigest()}"


def _row(record: Any, settings: dict[str, Any], missing: int | None) -> str:
    """The row of one record, as JSON; a failure is a row as well."""
    try:
        if missing is None:
            return json.dumps(identify(record, **settings).to_row())
        return json.dumps(_diagnose(record, max_effects=missing, **settings).to_row())
    except Error as error:
        return _native.NativeJournal.failed(error.reason)


def _done_here(records: list[Any], settings: dict[str, Any], missing: int | None) -> Iterator[tuple[int, str]]:
    """The row of each record, one after the other, with its place."""
    for place, record in enumerate(records):
        yield place, _row(record, settings, missing)


def _done_there(
    client: Any, records: list[Any], settings: dict[str, Any], missing: int | None
) -> Iterator[tuple[int, str]]:
    """The row of each record as the workers of a cluster are done with it, with its place."""
    from distributed import as_completed

    # Each is pure: a worker that dies loses nothing, its records are given to another. Not told apart by what they are given: the same
    # record may stand in a list twice.
    futures = [client.submit(_row, record, settings, missing, retries=3, pure=False) for record in records]
    places = {future.key: place for place, future in enumerate(futures)}
    try:
        for future in as_completed(futures):
            yield places[future.key], future.result()
    finally:
        # What nobody waits for any more is not worked on.
        client.cancel([future for future in futures if not future.done()])


def batch(
    records: Iterable[Any],
    client: Any = None,
    *,
    out: str | os.PathLike[str] | None = None,
    diagnose: bool = False,
    max_effects: int = 3,
    progress: Callable[[int, int], object] | None = None,
    **settings: Unpack[Settings],
) -> Batch:
    """Identifies many records with the same settings, one row each.

    Args:
        records: Files, records, frames or tuples ``(t, x, u)``; a file is read where it is worked on.
        client: A ``dask.distributed.Client``: the records are worked on by its workers, and those of a worker that dies by
            another; left out: here, one after the other, each on all cores.
        out: A table to write, ``.parquet`` or CSV. What is done is kept beside it (``TABLE.journal``) as it comes and is not done again,
            whenever the process ends; a record that has changed since is. The table is there in whole or not at all.
        diagnose: Whether missing effects are searched for, as :func:`sindyscope.diagnose` does: the row has the verdict, the effects with
            their parameters, and the errors without and with them.
        max_effects: At most so many effects are added.
        progress: Called as ``progress(done, all)``.
        settings: As for :func:`sindyscope.identify`; of a search ``terms`` (the base model), ``lock``, ``initial`` and how records are read.

    A record that cannot be identified is a row with the sentence that says why.

    Raises:
        Error: the journal is of other settings or another process works on it; the table cannot be written; settings that a search does
            not take.
    """
    given = list(records)
    chosen: dict[str, Any] = dict(settings)
    told = texts(chosen)
    missing = max_effects if diagnose else None
    titles = [_title(record, k) for k, record in enumerate(given)]
    rows: dict[int, str] = {}
    keys: list[str] = []
    journal = None
    if out is not None:
        journal, kept = _native.NativeJournal.open(out, told, missing)
        keys, known = [_key(title, record, told) for title, record in zip(titles, given)], dict(kept)
        rows = {place: known[key] for place, key in enumerate(keys) if key in known}
    elif missing is not None:
        _native.NativeJournal.check(told, missing)
    left = [place for place in range(len(given)) if place not in rows]
    wanted = [given[place] for place in left]
    if progress is not None and rows:
        progress(len(rows), len(given))
    done = _done_here(wanted, chosen, missing) if client is None else _done_there(client, wanted, chosen, missing)
    for at, row in done:
        rows[left[at]] = row
        if journal is not None:
            journal.keep(keys[left[at]], row)
        if progress is not None:
            progress(len(rows), len(given))
    listed = [(title, rows[place]) for place, title in enumerate(titles)]
    if out is not None:
        _native.write_table(out, listed)
    return Batch({"record": title, **json.loads(row)} for title, row in listed)
