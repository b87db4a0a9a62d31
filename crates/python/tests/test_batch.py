"""Many records."""

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
