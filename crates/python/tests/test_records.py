"""Records from arrays, frames and files."""

import pickle

import numpy as np
import pytest

import sindyscope

#: A sentence of at least four words.
SENTENCE = r"\w+ .*\w+ .*\w+ .*\w+"
SETTINGS = {"terms": "x, v, u, x^3", "window": 31, "order": 5, "threshold": 0.02}


def coefficients(found):
    return found.equations["v"]


def test_every_way_to_give_a_record_gives_the_same_equation(arrays, samples):
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    t, x, u = arrays
    expected = coefficients(sindyscope.identify(t, x, u, **SETTINGS))
    columns = {"t": t, "x": x, "u": u}
    ways = [
        columns,
        pandas.DataFrame(columns),
        pandas.DataFrame({"x": x, "u": u}, index=pandas.Index(t, name="t")),
        polars.DataFrame(columns),
        [(t, x, u)],
        (t.tolist(), x.tolist(), u.tolist()),
        sindyscope.records(t, x, u),
        samples / "duffing.csv",
        str(samples / "duffing.csv"),
    ]
    for way in ways:
        assert coefficients(sindyscope.identify(way, **SETTINGS)) == expected
    assert coefficients(sindyscope.identify([t], [x], [u], **SETTINGS)) == expected
    assert coefficients(sindyscope.identify(t[1] - t[0], x, u, **SETTINGS)) == pytest.approx(expected, rel=1e-9)


def test_stamps_count_as_seconds(arrays):
    pandas = pytest.importorskip("pandas")
    t, x, u = arrays
    stamps = pandas.Timestamp("2026-01-01") + pandas.to_timedelta(np.round(t * 1e9), unit="ns")
    found = sindyscope.identify(pandas.DataFrame({"t": stamps, "x": x, "u": u}), **SETTINGS)
    assert coefficients(found) == pytest.approx(coefficients(sindyscope.identify(t, x, u, **SETTINGS)), rel=1e-9)


def test_labels_separate_records(arrays):
    pandas = pytest.importorskip("pandas")
    t, x, u = arrays
    half = len(t) // 2
    frame = pandas.DataFrame({"run": ["a"] * half + ["b"] * (len(t) - half), "t": t, "x": x, "u": u})
    assert [r.name for r in sindyscope.records(frame)] == ["a", "b"]


def test_units_and_matrices_are_channels():
    two = sindyscope.generate("two-masses", seed=1, duration=3)[0]
    motion = np.column_stack([two["x1"], two["x2"]])
    made = sindyscope.records(two.t, motion, two["u"], units={"x": "mm", "u": "N"})[0]
    assert made.channels == ["x1", "x2", "u1"] and made.units == {"x1": "mm", "x2": "mm", "u1": "N"}
    assert np.array_equal(made["x2"], two["x2"]) and made.dt == two.dt
    with pytest.raises(sindyscope.Error, match="transpose"):
        sindyscope.records(two.t, motion.T)


def test_a_gap_splits_a_record_and_missing_samples_can_be_bridged(arrays):
    t, x, u = arrays
    gone = x.copy()
    gone[500:503] = np.nan
    assert len(sindyscope.records(t, gone, u)) == 2
    bridged = sindyscope.records(t, gone, u, bridge=5)
    assert len(bridged) == 1 and np.all(np.isfinite(bridged[0]["x"]))


def test_a_record_pickles(samples):
    record = sindyscope.read(samples / "friction_noisy.csv")[0]
    back = pickle.loads(pickle.dumps(record))
    assert repr(back) == repr(record) and np.array_equal(back["x"], record["x"]) and back.units == record.units


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((np.arange(10.0), np.arange(9.0)), "9 values"),
        ((np.arange(9.0), np.zeros((9, 2, 2))), "dimensions"),
        ((np.arange(9.0), np.arange(9.0) * 1j), "complex"),
        ((np.arange(9.0), ["a"] * 9), "not a number"),
        ((3.0,), "no record can be made"),
        ((np.arange(900.0), np.full(900, np.nan)), SENTENCE),
        ((np.zeros(900), np.sin(np.arange(900.0))), SENTENCE),
        (([],), SENTENCE),
        ((np.array([]), np.array([])), SENTENCE),
    ],
)
def test_what_is_no_record_is_refused_with_a_sentence(given, said):
    with pytest.raises(sindyscope.Error, match=said):
        sindyscope.identify(*given)
