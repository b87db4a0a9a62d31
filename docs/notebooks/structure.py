# %% [markdown]
# # A structure
#
# Three floors, an accelerometer on each, a shaker at the first: more than one mode, and sensors that stand for no single mass. `sindyscope.modes` finds as many modes as the data bear.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.linalg import eigh, expm

import sindyscope

# %% [markdown]
# ## The measurement
#
# In place of this stands yours. Here three equal masses stand on three springs; a random force acts on the first, and the accelerations come with one per cent of noise, sampled at 256 Hz for a minute.

# %%
masses, springs, losses = 3, 4000.0, 1e-4
K = springs * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
C = losses * K + 0.3 * np.eye(masses)
dt, samples = 1 / 256, 60 * 256
A = np.block([[np.zeros((3, 3)), np.eye(3)], [-K, -C]])
B = np.zeros((6, 1))
B[3] = 1.0
# Exact for a force that goes straight from sample to sample.
held = expm(dt * np.block([[A, B, np.zeros((6, 1))], [np.zeros((1, 7)), np.ones((1, 1)) / dt], [np.zeros((1, 8))]]))
random = np.random.default_rng(5)
force = np.convolve(random.normal(size=samples), np.hanning(9), "same")
state, states = np.zeros(6), []
for k in range(samples - 1):
    states.append(state)
    state = held[:6, :6] @ state + held[:6, 6] * force[k] + held[:6, 7] * (force[k + 1] - force[k])
states = np.array([*states, state])
acceleration = states @ A[3:].T + force[:, None] * B[3:].T
acceleration += 0.01 * acceleration.std(0) * random.normal(size=acceleration.shape)
t = dt * np.arange(samples)

# %% [markdown]
# ## Its modes
#
# The sensors are the columns of `a`. The last part is held out.

# %%
found = sindyscope.modes(t, a=acceleration, u=force, hold_out=0.25)
print(found)

# %% [markdown]
# Beside what the matrices say:

# %%
squares, vectors = eigh(K)
frequencies = np.sqrt(squares) / (2 * np.pi)
damping = (losses * squares + 0.3) / (2 * np.sqrt(squares))
table = pd.DataFrame({"true, Hz": frequencies, "found, Hz": found.frequencies, "± Hz": [m["std_error"] for m in found.modes],
                      "true damping, %": 100 * damping, "found damping, %": 100 * found.damping})
assert len(found.frequencies) == 3 and np.allclose(found.frequencies, frequencies, rtol=0.005), table
table.round(4)

# %%
figure, axes = plt.subplots(1, 3, figsize=(7, 2.4), sharey=True)
for k, axis in enumerate(axes):
    true = vectors[:, k] / vectors[np.argmax(abs(vectors[:, k])), k]
    axis.plot([0, *true], range(4), "o-", color="lightgray", linewidth=5, label="true")
    axis.plot([0, *found.shapes[k]], range(4), "o-", label="found")
    axis.set(title=f"{found.frequencies[k]:.2f} Hz", xlabel="shape", xlim=(-1.2, 1.2))
axes[0].set(ylabel="floor")
axes[0].legend();

# %% [markdown]
# ## How well they explain the records
#
# The free response of the modes along each record, sensor by sensor: the error as a share of the motion.

# %%
pd.DataFrame([{"record": r["name"], "use": r["usage"], **{c["name"]: f"{100 * c['nrmse']:.2f} %" for c in r["channels"]}} for r in found.records])

# %% [markdown]
# The noise is one per cent, and no more is left. Where more is left, `sindyscope.modes(…, missing=True)` looks for the force that the modes lack, and where it acts ([how](../methods/modes.md)).
