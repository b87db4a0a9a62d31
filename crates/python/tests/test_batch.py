"""Many records."""

import os
import signal

import pytest

import sindyscope


def test_each_record_is_a_row_and_a_failure_its_sentence(samples, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("t,x\n0,1\n0.1,oops\n")
    files = [samples / "duffing.csv", bad, samples / "overfit.csv"]
    told = []
    rows = sindyscope.batch(
        files, terms="x, v, u, x^3", window=31, order=5, threshold=0.02, progress=lambda *at: told.append(at)
    )
    assert [row["status"] for row in rows] == ["ok", "failed", "ok"]
    assert "line 3" in rows.failed[0]["error"]
    assert told == [(1, 3), (2, 3), (3, 3)]
    alone = sindyscope.identify(files[0], terms="x, v, u, x^3", window=31, order=5, threshold=0.02)
    assert rows[0]["v: x^3"] == alone.equations["v"]["x^3"] and rows[0]["train_rmse"] == alone.train["rmse"]


@pytest.fixture
def slow(tmp_path):
    """Records that take a while each, as nothing of their settings is said."""
    files = []
    for k in range(12):
        files.append(tmp_path / f"run{k:02d}.csv")
        sindyscope.generate("friction-decay", files[-1], set={"k": 250 + 20 * k}, seed=k, noise="0.1%")
    files.append(tmp_path / "gone.csv")
    return files


def test_a_cluster_does_the_same_though_a_worker_is_killed(slow):
    distributed = pytest.importorskip("distributed")
    here = sindyscope.batch(slow)
    killed = []

    def kill(done, count):
        # In the middle, without a word.
        if done == 3 and not killed:
            workers = client.run(os.getpid)
            killed.append(workers.popitem()[1])
            os.kill(killed[0], signal.SIGKILL)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            there = sindyscope.batch(slow, client, progress=kill)
    assert killed
    assert list(there) == list(here) and [row["status"] for row in here] == ["ok"] * 12 + ["failed"]


SETTINGS = {"terms": "x, v, sgn(v)", "window": 15, "order": 5, "threshold": 0}


class Stopped(Exception):
    pass


@pytest.mark.parametrize("table", ["table.csv", "table.parquet"])
def test_a_batch_that_was_stopped_goes_on_and_its_table_is_that_of_an_undisturbed_one(slow, tmp_path, table):
    import numpy as np

    # Records that are no files are known by what they hold.
    [own] = sindyscope.generate("friction-decay", seed=99, noise="0.1%", duration=2)
    records = [*slow, own, (own.t, own["x"] + 1e-4)]
    whole = tmp_path / "whole" / table
    whole.parent.mkdir()
    told = []
    rows = sindyscope.batch(records, out=whole, progress=lambda *at: told.append(at), **SETTINGS)
    assert told[-1] == (15, 15) and [row["status"] for row in rows] == ["ok"] * 12 + ["failed"] + ["ok"] * 2

    stops = {5, 10}

    def stop(done, count):
        if done in stops:
            stops.remove(done)
            raise Stopped

    again = tmp_path / "again" / table
    again.parent.mkdir()
    for _ in range(2):
        with pytest.raises(Stopped):
            sindyscope.batch(records, out=again, progress=stop, **SETTINGS)
        assert not again.exists()
    told.clear()
    resumed = sindyscope.batch(records, out=again, progress=lambda *at: told.append(at), **SETTINGS)
    assert told == [(done, 15) for done in range(10, 16)]
    assert list(resumed) == list(rows) and again.read_bytes() == whole.read_bytes()
    # Again: nothing is done. A record that changed is done anew, and other settings are another batch.
    told.clear()
    sindyscope.batch(records, out=again, progress=lambda *at: told.append(at), **SETTINGS)
    assert told == [(15, 15)]
    changed = [*records[:-1], (own.t, own["x"] + 2e-4)]
    sindyscope.batch(changed, out=again, progress=lambda *at: told.append(at), **SETTINGS)
    assert told[1:] == [(14, 15), (15, 15)]
    with pytest.raises(sindyscope.Error, match="begun with other settings"):
        sindyscope.batch(records, out=again, terms="x, v")
    assert np.isfinite(rows[13]["v: x"])


def test_a_table_as_parquet_keeps_its_types(slow, tmp_path):
    import polars

    rows = sindyscope.batch(slow[:2] + slow[-1:], out=tmp_path / "table.parquet", **SETTINGS)
    frame = polars.read_parquet(tmp_path / "table.parquet")
    assert frame.columns == rows.columns()
    types = dict(frame.schema)
    assert (types["record"], types["status"], types["error"]) == (polars.String,) * 3
    assert types["v: x"] == types["train_rmse"] == types["test_rmse"] == polars.Float64
    assert frame["v: x"].to_list() == [rows[0]["v: x"], rows[1]["v: x"], None]
    assert "gone.csv" in frame["error"][2] and frame["error"][0] is None


def test_many_records_are_searched_for_what_is_missing(samples, tmp_path):
    from sindyscope import Error

    bad = tmp_path / "bad.csv"
    bad.write_text("t,x\n0,1\n0.1,oops\n")
    rows = sindyscope.batch([samples / "friction_noisy.csv", bad], out=tmp_path / "table.csv", diagnose=True, crop=(0, 20))
    alone = sindyscope.diagnose(samples / "friction_noisy.csv", crop=(0, 20))
    assert rows[0]["verdict"] == alone.verdict and rows[0]["effects"] == ", ".join(alone.effects)
    [parameter] = alone.steps[0]["parameters"]
    assert rows[0][f"{alone.effects[0]}: {parameter['name']}"] == parameter["value"]
    assert rows[0]["train_rmse"] < 0.1 * rows[0]["base_train_rmse"]
    assert rows[1]["status"] == "failed" and "line 3" in rows[1]["error"]
    with pytest.raises(Error, match="`window` says how an equation is identified"):
        sindyscope.batch([bad], diagnose=True, window=31)


@pytest.mark.parametrize("table", ["table.csv", "table.parquet"])
def test_a_cluster_writes_the_same_table_though_a_worker_and_then_the_batch_itself_end(slow, tmp_path, table):
    distributed = pytest.importorskip("distributed")
    whole = tmp_path / "whole" / table
    whole.parent.mkdir()
    sindyscope.batch(slow, out=whole)
    there = tmp_path / "there" / table
    there.parent.mkdir()
    killed = []

    def disturb(done, count):
        if done >= 3 and not killed:
            killed.append(client.run(os.getpid).popitem()[1])
            os.kill(killed[0], signal.SIGKILL)
        elif done >= 7:
            raise Stopped

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            with pytest.raises(Stopped):
                sindyscope.batch(slow, client, out=there, progress=disturb)
            assert killed and not there.exists()
            told = []
            sindyscope.batch(slow, client, out=there, progress=lambda *at: told.append(at))
    assert told[0][0] >= 7 and told[-1] == (13, 13)
    assert there.read_bytes() == whole.read_bytes()
