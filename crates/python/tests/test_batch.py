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
