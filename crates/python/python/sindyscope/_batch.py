"""Many records, one after the other or over a cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from ._error import Error
from ._study import identify

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._settings import Settings


class Batch(list[dict[str, Any]]):
    """One row a record: ``record``, ``status`` (``ok``, ``diverged`` or ``failed``), ``error`` (the sentence of a failure), errors
    and one column a coefficient (``v: x``). In the order in which the records were given."""

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


def _row(title: str, record: Any, settings: dict[str, Any]) -> dict[str, Any]:
    """What is found of one record; a failure is a row as well."""
    try:
        found = identify(record, **settings)
    except Error as error:
        return {"record": title, "status": "failed", "error": error.reason}
    return {"record": title, **found.to_row()}


def batch(
    records: Iterable[Any],
    client: Any = None,
    *,
    progress: Callable[[int, int], object] | None = None,
    **settings: Unpack[Settings],
) -> Batch:
    """Identifies many records with the same settings, one row each.

    Args:
        records: Files, records, frames or tuples ``(t, x, u)``; a file is read where it is worked on.
        client: A ``dask.distributed.Client``: the records are worked on by its workers, and those of a worker that dies by
            another; left out: here, one after the other, each on all cores.
        progress: Called as ``progress(done, all)``.
        settings: As for :func:`sindyscope.identify`.

    A record that cannot be identified is a row with the sentence that says why.
    """
    given = list(records)
    told = dict(settings)
    titles = [_title(record, k) for k, record in enumerate(given)]
    rows = Batch()
    if client is None:
        for title, record in zip(titles, given):
            rows.append(_row(title, record, told))
            if progress is not None:
                progress(len(rows), len(given))
        return rows
    from distributed import as_completed

    # Each is pure: a worker that dies loses nothing, its records are given to another.
    futures = [client.submit(_row, title, record, told, retries=3) for title, record in zip(titles, given)]
    for done, _ in enumerate(as_completed(futures), 1):
        if progress is not None:
            progress(done, len(given))
    rows.extend(client.gather(futures))
    return rows
