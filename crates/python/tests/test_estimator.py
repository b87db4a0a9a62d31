"""The estimator among scikit-learn's tools."""

import numpy as np
import pytest

import sindyscope

SETTINGS = {"terms": "x, v, u, x^3", "window": 31, "order": 5, "threshold": 0.02}


def test_it_fits_predicts_and_scores(arrays):
    t, x, u = arrays
    drive = np.column_stack([t, u])
    regressor = sindyscope.SindyRegressor(**SETTINGS).fit(drive, x)
    assert regressor.score(drive, x) > 0.999
    start = [x[0], float(np.gradient(x[:9], t[:9])[0])]
    assert np.sqrt(np.mean((regressor.predict(drive, initial=start) - x) ** 2)) < 0.05 * np.std(x)
    assert dict(zip(regressor.terms_, regressor.coef_)) == regressor.result_.equations["v"]
    shuffled = np.random.default_rng(0).permutation(len(t))
    again = sindyscope.SindyRegressor(**SETTINGS).fit(drive[shuffled], x[shuffled])
    assert np.array_equal(again.coef_, regressor.coef_)


def test_scikit_learn_clones_searches_and_pipes_it(arrays):
    pytest.importorskip("sklearn")
    from sklearn.base import clone
    from sklearn.model_selection import GridSearchCV, TimeSeriesSplit
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import FunctionTransformer

    t, x, u = arrays
    drive = np.column_stack([t, u])
    regressor = sindyscope.SindyRegressor(**SETTINGS)
    copy = clone(regressor)
    assert copy.get_params() == regressor.get_params() and copy is not regressor
    search = GridSearchCV(regressor, {"threshold": [0.02, 10.0]}, cv=TimeSeriesSplit(2)).fit(drive, x)
    assert search.best_params_ == {"threshold": 0.02}
    # Folds that cut a hole into the record are two records.
    search = GridSearchCV(regressor, {"window": [15, 31]}, cv=3, error_score="raise").fit(drive, x)
    assert search.best_score_ > 0.99
    piped = make_pipeline(FunctionTransformer(), regressor).fit(drive, x)
    assert piped.score(drive, x) > 0.999


def test_unknown_parameters_are_refused():
    with pytest.raises(ValueError):
        sindyscope.SindyRegressor().set_params(no_such=1)
    with pytest.raises(sindyscope.Error, match="fit first|nothing is fitted"):
        sindyscope.SindyRegressor().predict(np.zeros((5, 1)))
