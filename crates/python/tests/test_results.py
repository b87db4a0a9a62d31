"""What results do: print, pickle, simulate, become something else."""

import pickle

import numpy as np
import pytest

import sindyscope


@pytest.fixture(scope="module")
def found(samples):
    return sindyscope.identify(
        samples / "duffing.csv", test=samples / "duffing_test.csv", terms="x, v, u, x^3", window=31, order=5, threshold=0.02
    )


def test_a_notebook_shows_equation_errors_and_figure(found):
    shown = found._repr_html_()
    assert "x^3" in shown or "x³" in shown
    assert "<svg" in shown and f"{found.test['rmse']:.4g}" in shown
    assert len(shown) < 400_000


def test_a_result_pickles(found):
    back = pickle.loads(pickle.dumps(found))
    assert back.to_json() == found.to_json() and back.model == found.model
    assert back._repr_html_() == found._repr_html_()
    drive = np.sin(np.arange(500) * 0.05)
    assert np.array_equal(back.simulate(drive).x, found.simulate(drive).x)
    missing = sindyscope.diagnose(sindyscope.generate("friction", seed=1), max_effects=0)
    assert pickle.loads(pickle.dumps(missing)).to_json() == missing.to_json()


def test_a_response_solves_the_equation():
    # x'' = -400 x - 2 v + u, from the displacement 1 at rest: the textbook's decay.
    model = sindyscope.Model.of([{"x": -400.0, "v": -2.0, "u": 1.0}], inputs=1)
    response = model.simulate(np.zeros(2000), dt=1e-3, initial=[1.0])
    omega = np.sqrt(400 - 1)
    exact = np.exp(-response.t) * (np.cos(omega * response.t) + np.sin(omega * response.t) / omega)
    # The integrator's own tolerance is 1e-9 of the range.
    assert np.max(np.abs(response.x - exact)) < 1e-8
    assert response.diverged_at is None and response.names == ("x", "v") and response["v"].shape == (2000,)


def test_dry_friction_holds():
    model = sindyscope.Model.of([{"x": -100.0, "sgn(v)": -1.0}])
    response = model.simulate(dt=1e-3, samples=4000, initial=[0.05])
    # 5 N/kg of spring against 1 of friction: it stops within three half periods, where the spring is weaker than friction.
    assert abs(response.v[-1]) == 0.0 and abs(response.x[-1]) <= 0.01 + 1e-6


def test_wrong_uses_of_simulate_are_told(found):
    for how, said in [
        ({}, "none was given"),
        ({"u": np.zeros((5, 2))}, "1 inputs, and 2"),
        ({"u": np.zeros(5), "dt": 0.0}, "above zero"),
        ({"u": np.array([0.0, np.nan])}, "not a number"),
        ({"u": np.zeros(5), "initial": [1, 2, 3]}, "3 values"),
    ]:
        with pytest.raises(sindyscope.Error, match=said):
            found.simulate(**how)


def test_sympy_has_the_same_right_hand_side():
    sympy = pytest.importorskip("sympy")
    terms = {"x": -2.0, "x^3": 0.5, "v*|v|": -0.25, "sgn(v)": 3.0, "sin(x)": 1.5, "x^2*v": -1.0, "u": 1.0, "1": 0.125}
    model = sindyscope.Model.of([terms], inputs=1)
    x, v, u = (sympy.Symbol(name, real=True) for name in ("x", "v", "u"))
    right = model.to_sympy()[v]
    at = {x: 0.7, v: -1.3, u: 0.4}
    expected = -2 * 0.7 + 0.5 * 0.7**3 - 0.25 * -1.3 * 1.3 - 3 + 1.5 * np.sin(0.7) - 0.49 * -1.3 + 0.4 + 0.125
    assert float(right.subs(at)) == pytest.approx(expected, rel=1e-12)
    assert model.to_sympy()[x] == v or float((model.to_sympy()[x] - v).subs(at)) == 0.0


def test_plot_draws_both(found):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    upper, lower = found.plot(record=1)
    assert len(upper.lines) == 2 and len(lower.lines) == 1


def test_progress_is_told_and_an_exception_in_it_stops_the_work(samples):
    told = []
    sindyscope.identify(samples / "friction_noisy.csv", progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told if share is not None]
    assert shares and all(0 <= s <= 1 for s in shares) and any(share is None for _, share in told)

    class Enough(Exception):
        pass

    def enough(what, share):
        raise Enough

    with pytest.raises(Enough):
        sindyscope.identify(samples / "friction_noisy.csv", progress=enough)


def test_a_wrong_setting_is_told_with_the_nearest(samples):
    with pytest.raises(TypeError, match="did you mean `threshold`"):
        sindyscope.identify(samples / "duffing.csv", treshold=1)
    with pytest.raises(sindyscope.Error, match="window"):
        sindyscope.identify(samples / "duffing.csv", window=30)


def test_the_settings_of_the_signature_are_those_of_the_commands():
    from sindyscope import _settings

    assert {name.replace("-", "_") for name in _settings.FORMS} == set(_settings.Settings.__annotations__)


def test_advice_is_in_python_words(tmp_path):
    file = tmp_path / "names.csv"
    file.write_text("Zeit,Weg,Kraft\n" + "\n".join(f"{k / 100},{np.sin(k / 9)},{np.cos(k / 7)}" for k in range(300)))
    with pytest.raises(sindyscope.Error) as caught:
        sindyscope.identify(file)
    assert "columns={" in caught.value.args[1]
