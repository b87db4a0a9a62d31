# %% [markdown]
# # A record of your own
#
# From arrays or a frame to the equation, a plot, and files to take along.

# %%
import numpy as np
import pandas as pd

import sindyscope

# %% [markdown]
# In place of this cell stands yours: it reads what was measured. Here a mass of 2.5 kg on a spring that hardens is shaken with a random force, sampled at 200 Hz, and its displacement comes in millimetres with noise.

# %%
mass, damping, stiffness, hardening = 2.5, 4.0, 1200.0, 8.0e6
random = np.random.default_rng(7)
dt, samples = 1 / 200, 8000
t = dt * np.arange(samples)
force = sum(3.0 * np.cos(2 * np.pi * f * t + random.uniform(0, 2 * np.pi)) for f in np.arange(0.5, 7.0, 0.25))

truth = sindyscope.Model.of([{"x": -stiffness / mass, "x^3": -hardening / mass, "v": -damping / mass, "u": 1 / mass}], inputs=1)
x = truth.simulate(force, dt=dt).x
table = pd.DataFrame({"t [s]": t, "x [mm]": 1e3 * x + 0.02 * random.normal(size=samples), "F [N]": force})
table.head(3)

# %% [markdown]
# The headings say what each column is, and its unit. The last 30 % are held out: they are never fitted, only simulated and compared. All settings are chosen from the data.

# %%
found = sindyscope.identify(table, hold_out=0.3)
found

# %% [markdown]
# The coefficients are in the record's units (mm, N); the standard errors stand beside them. They agree with what was put in:

# %%
coefficients = found.equations["v"]
known = {"x": -stiffness / mass, "x^3": -hardening / mass * 1e-6, "v": -damping / mass, "u": 1e3 / mass}
comparison = pd.DataFrame({"found": coefficients, "put in": known}).reindex(list(known))
assert set(coefficients) == set(known), coefficients
assert (abs(comparison["found"] / comparison["put in"] - 1) < 0.05).all(), comparison
comparison

# %% [markdown]
# ## Look at it
#
# `plot` draws with matplotlib: the response and, beneath it, the error.

# %%
axes = found.plot()

# %% [markdown]
# ## Take it along
#
# The equation as LaTeX, as a SymPy expression, as a Python function for SciPy; the response to another input; the study as a report.

# %%
print(found.model.latex)
print(found.to_sympy())
print(found.model.python)

# %%
step = found.simulate(np.full(4000, 10.0), dt=dt)
print(f"under 10 N it comes to rest at {step.x[-1]:.3f} mm")
sindyscope.report(table, hold_out=0.3, out="own-record.html", title="My record")
sindyscope.report(table, hold_out=0.3, out="own-record.pdf", title="My record");

# %% [markdown]
# What cannot be done raises `sindyscope.Error` with a sentence and what to try (`error.reason`, `error.advice`):

# %%
try:
    sindyscope.identify(t, np.append(x[:-1], "oops"))
except (sindyscope.Error, ValueError, TypeError) as error:
    print(error)
try:
    sindyscope.identify(t[:5], x[:5], force[:5])
except sindyscope.Error as error:
    print(error)
