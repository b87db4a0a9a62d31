"""Models of PySINDy, taken over and given back."""

import numpy as np
import pytest

import sindyscope

pysindy = pytest.importorskip("pysindy")


def test_a_first_order_model_comes_over_and_goes_back():
    record = sindyscope.generate("lorenz", seed=1, duration=5)[0]
    states = np.column_stack([record[name] for name in ("x1", "x2", "x3")])
    theirs = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.1), feature_library=pysindy.PolynomialLibrary(2))
    theirs.fit(states, t=record.dt)
    ours = sindyscope.from_pysindy(theirs)
    assert ours.kind == "first-order" and ours.states == ("x1", "x2", "x3")
    assert ours.equations["x1"]["x2"] == pytest.approx(10, rel=0.02)
    back = sindyscope.to_pysindy(ours)
    point = states[100:101]
    assert np.allclose(back.predict(point), theirs.predict(point), rtol=1e-12)
    assert sindyscope.from_pysindy(back).equations == ours.equations


def test_a_second_order_model_is_known_by_its_rates():
    t = np.arange(0, 20, 0.01)
    model = sindyscope.Model.of([{"x": -4.0, "v": -0.2, "x^3": -0.5, "u": 1.0}], inputs=1)
    drive = np.sin(1.3 * t)
    response = model.simulate(drive, dt=0.01, initial=[0.3])
    theirs = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.05), feature_library=pysindy.PolynomialLibrary(3))
    theirs.fit(response.states, t=0.01, u=drive)
    ours = sindyscope.from_pysindy(theirs)
    assert ours.kind == "second-order"
    assert ours.equations["v"]["x^3"] == pytest.approx(-0.5, rel=0.05)
    back = sindyscope.to_pysindy(ours)
    assert np.allclose(back.predict(response.states[:5], u=drive[:5]), theirs.predict(response.states[:5], u=drive[:5]), rtol=0.01)


def test_what_the_other_cannot_hold_is_refused():
    with pytest.raises(sindyscope.Error, match="sgn"):
        sindyscope.to_pysindy(sindyscope.Model.of([{"x": -1.0, "sgn(v)": -0.1}]))
