# %% [markdown]
# # Beside PySINDy
#
# The same records in Sindyscope and in the Python package [PySINDy](https://pysindy.readthedocs.io): what each finds, how far its response lies from a record that was not fitted, how long it takes, and in how many lines.
# First the five systems of the report that this program began with, then the oscillators that PySINDy itself brings, then the speed over the length of the record.

# %%
import inspect
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pysindy
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import sindyscope

warnings.filterwarnings("ignore")  # of PySINDy's, about thresholds that drop every term
DATA = Path("sample_data")

# %% [markdown]
# ## The report's systems
#
# Both get the report's segment length, threshold and library; the fitted records and the one that is held out are files.

# %%
POWERS, SIGNS = ["{}", "{}^2", "{}^3"], ["{}", "sgn({})"]
SYSTEMS = {
    # name: files, segment (samples), threshold, functions of every variable, variables
    "Duffing": ("duffing", "duffing_test", 11, 0.15, POWERS, ["x", "v", "u"]),
    "Duffing, noise 0.01 m": ("duffing_noisy", "duffing_test", 81, 0.1, POWERS, ["x", "v", "u"]),
    "friction": ("friction", "friction_test", 11, 1e-3, SIGNS, ["x", "v", "u", "du"]),
    "friction, noise 1e-5 m": ("friction_noisy", "friction_noisy_test", 31, 1e-3, SIGNS, ["x", "v", "u", "du"]),
    "friction, steady state": ("friction_steady", "friction_steady_test", 31, 1e-3, SIGNS, ["x", "v", "u", "du"]),
}

# %% [markdown]
# In Sindyscope this is one call. `form`, `scaling` and `order` are the report's too; without them the program chooses, and does better.

# %%
def with_sindyscope(records, segment, threshold, functions, variables, **more):
    terms = [f.format(v) for v in variables for f in functions]
    return sindyscope.identify(records, terms=terms, window=segment, order=3, threshold=threshold,
                               form="derivative", scaling="raw", **more).model

# %% [markdown]
# In PySINDy the displacement is smoothed and differentiated first, and the library is put together from functions.

# %%
def with_pysindy(records, segment, threshold, functions, variables):
    made = {"{}": lambda q: q, "{}^2": lambda q: q**2, "{}^3": lambda q: q**3, "sgn({})": lambda q: np.sign(q)}
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": segment, "polyorder": 3})
    rate = lambda values, t: smooth._differentiate(values[:, None], t)
    states, inputs = [], []
    for r in records:
        states.append(np.hstack([r["x"][:, None], rate(r["x"], r.t)]))
        inputs.append(np.hstack([r["u"][:, None]] + [rate(r["u"], r.t)] * ("du" in variables)))
    library = pysindy.CustomLibrary([made[f] for f in functions], [f.format for f in functions])
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=threshold, alpha=0.05), feature_library=library,
                          differentiation_method=smooth)
    model.fit(states, t=[r.t for r in records], u=inputs, feature_names=variables)
    acceleration = zip(model.get_feature_names(), model.coefficients()[1])
    return sindyscope.Model.of([{name: c for name, c in acceleration if c != 0}], inputs=1)

# %% [markdown]
# Both equations are simulated alike along the held-out record, from the initial state that fits it best, so that nothing but the equation differs.

# %%
def held_out_error(model, record):
    x, u, dt = record["x"], record["u"], record.t[1] - record.t[0]
    size = np.array([np.std(x), np.std(np.gradient(x, dt))])

    def residual(start):
        return np.nan_to_num(model.simulate(u, dt=dt, initial=start * size).x - x, nan=1e6)

    fitted = least_squares(residual, np.array([x[0], (x[1] - x[0]) / dt]) / size, diff_step=1e-4, max_nfev=6)
    return np.sqrt(np.mean(fitted.fun**2))


def fastest(work, repeats=3):
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - began)
    return result, 1e3 * min(seconds)


rows = []
for name, (fit, test, *settings) in SYSTEMS.items():
    records, [held_out, *_] = sindyscope.read(DATA / f"{fit}.csv"), sindyscope.read(DATA / f"{test}.csv")
    ours, our_ms = fastest(lambda: with_sindyscope(records, *settings))
    refined, _ = fastest(lambda: with_sindyscope(records, *settings, refine=True), 1)
    theirs, their_ms = fastest(lambda: with_pysindy(records, *settings))
    errors = [held_out_error(model, held_out) for model in (theirs, ours, refined)]
    rows.append([*errors, their_ms, our_ms])
table = pd.DataFrame(rows, index=SYSTEMS, columns=["PySINDy, m", "Sindyscope, m", "refined, m", "PySINDy, ms", "Sindyscope, ms"])
table.style.format("{:.2e}", subset=table.columns[:3]).format("{:.1f}", subset=table.columns[3:])

# %% [markdown]
# The errors are of the displacement on data that were not fitted. The milliseconds are those of a whole call: of `identify` with the standard errors and the simulated response, which PySINDy's `fit` does not have.

# %%
assert (table["Sindyscope, m"] < table["PySINDy, m"]).all(), table
lines = {f.__name__: len(inspect.getsource(f).splitlines()) - 1 for f in (with_sindyscope, with_pysindy)}
lines

# %% [markdown]
# ## PySINDy's own oscillators
#
# The second-order systems among the examples that PySINDy brings in `pysindy.utils`, with its own numbers: van der Pol's and Duffing's oscillator, and its two damped oscillators, whose two states are both measured. A thousandth of noise is added.
# PySINDy is given both states, all products to the third degree and a threshold between the smallest coefficient and the noise's. Sindyscope gets the position alone of the first two and no setting at all, and of the other two the same library.

# %%
EXAMPLES = {
    # name: rates, initial state, duration (s), degree, threshold, and whether it is a position and its velocity
    "van der Pol": (pysindy.utils.van_der_pol, [2.0, 0.0], 30.0, 3, 0.05, True),
    "Duffing": (pysindy.utils.duffing, [2.0, 0.0], 30.0, 3, 0.03, True),
    "linear damped oscillator": (pysindy.utils.linear_damped_SHO, [2.0, 0.0], 25.0, 3, 0.05, False),
    "cubic damped oscillator": (pysindy.utils.cubic_damped_SHO, [2.0, 0.0], 25.0, 3, 0.05, False),
}
random = np.random.default_rng(1)


def motion(rates, start, duration):
    t = np.arange(0.0, duration, 0.01)
    clean = solve_ivp(rates, (0.0, duration), start, t_eval=t, rtol=1e-10, atol=1e-10).y.T
    return t, clean + 1e-3 * np.std(clean, axis=0) * random.normal(size=clean.shape), clean


def theirs_of(t, states, degree, threshold):
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": 31, "polyorder": 3})
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=threshold), differentiation_method=smooth,
                          feature_library=pysindy.PolynomialLibrary(degree=degree))
    model.fit(states, t=t)
    return sindyscope.from_pysindy(model)


def ours_of(t, states, second_order):
    if second_order:
        return sindyscope.identify(t, states[:, 0]).model
    return sindyscope.identify(t, states, kind="first-order",
                               terms="x1, x2, x1^2, x1*x2, x2^2, x1^3, x1^2*x2, x1*x2^2, x2^3").model


def response_error(model, t, clean):
    """RMS error over the motion's standard deviation, from the true initial state."""
    x = model.simulate(dt=t[1] - t[0], samples=len(t), initial=clean[0]).states[:, 0]
    return np.sqrt(np.mean((x - clean[:, 0]) ** 2)) / np.std(clean[:, 0]) if np.isfinite(x).all() else np.inf


rows, equations = [], []
for name, (rates, start, duration, degree, threshold, second_order) in EXAMPLES.items():
    t, measured, clean = motion(rates, start, duration)
    theirs, their_ms = fastest(lambda: theirs_of(t, measured, degree, threshold))
    ours, our_ms = fastest(lambda: ours_of(t, measured, second_order), 1)
    count = [sum(map(len, model.equations.values())) for model in (theirs, ours)]
    rows.append([response_error(theirs, t, clean), response_error(ours, t, clean), *count, their_ms, our_ms])
    equations.append(f"{name}\n  PySINDy\n{theirs}\n  Sindyscope\n{ours}\n")
examples = pd.DataFrame(rows, index=EXAMPLES, columns=["PySINDy", "Sindyscope", "PySINDy, terms", "Sindyscope, terms", "PySINDy, ms", "Sindyscope, ms"])
examples.style.format("{:.2e}", subset=examples.columns[:2]).format("{:.0f}", subset=examples.columns[2:])

# %%
print("\n".join(equations))

# %% [markdown]
# Here Sindyscope's milliseconds are those of *choosing* segment, order, threshold and library from the data, with a response simulated for each; PySINDy's are those of one fit with settings that were given.

# %%
for name in ("van der Pol", "Duffing"):
    assert examples.loc[name, "Sindyscope"] < 0.02, examples.loc[name]

# %% [markdown]
# ## Speed
#
# One noisy Duffing record of growing length, nine terms. What both do is a fit: smooth, differentiate, evaluate the library, regress. Of Sindyscope the time to bring the arrays over is counted besides; its standard errors and the response come after the fit and are in the last column.

# %%
def their_fit(t, x, u):
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": 81, "polyorder": 3})
    library = pysindy.CustomLibrary([lambda q: q, lambda q: q**2, lambda q: q**3],
                                    [lambda q: q, lambda q: q + "^2", lambda q: q + "^3"])
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.1), feature_library=library, differentiation_method=smooth)
    model.fit(np.hstack([x[:, None], smooth._differentiate(x[:, None], t)]), t=t, u=u[:, None])


SPEED = dict(terms=[f.format(q) for q in "xvu" for f in POWERS], window=81, order=3, threshold=0.1,
             form="derivative", scaling="raw", refine=False)
rows = []
for samples in (7_000, 70_000, 700_000):
    [record] = sindyscope.generate("duffing-noisy", seed=1, duration=samples / 100)
    t, x, u = record.t, record["x"], record["u"]
    _, theirs = fastest(lambda: their_fit(t, x, u))
    _, brought = fastest(lambda: sindyscope.records(t, x, u))
    calls = [fastest(lambda: sindyscope.identify(t, x, u, **SPEED), 1) for _ in range(5 if samples < 100_000 else 2)]
    fit = min(found.to_dict()["elapsed_ms"]["fit"] for found, _ in calls)
    rows.append([samples, theirs, brought, fit, theirs / (brought + fit), min(ms for _, ms in calls)])
pd.DataFrame(rows, columns=["samples", "PySINDy, ms", "arrays, ms", "fit, ms", "times faster", "whole call, ms"]).round(2)
