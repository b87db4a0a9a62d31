# %% [markdown]
# # What is missing
#
# A linear model of a mass on a moving base, measured with noise. Where the response and the measurement part, `diagnose` names the effect that the model lacks.

# %%
import matplotlib.pyplot as plt
import pandas as pd

import sindyscope

FIT, TEST = "sample_data/friction_noisy.csv", "sample_data/friction_noisy_test.csv"

# %% [markdown]
# ## The linear model misses something
#
# Spring and damper to the base and to the ground, fitted: how far is its free response from a record that was not fitted?

# %%
linear = sindyscope.identify(FIT, test=TEST, terms="x, v, u, du")
print(linear)
print(f"held out: {100 * linear.test['nrmse']:.2f} % of the motion; noise {linear.to_dict()['noise_floor']:.1e} m")

# %% [markdown]
# ## Its name
#
# The search fits every effect of [the catalogue](../effects/index.md) that could be there, and compares them on data that were not fitted.

# %%
missing = sindyscope.diagnose(FIT, test=TEST)
print(missing.sentence)
assert missing.effects == ["coulomb_friction"], missing.effects

# %%
steps = missing.to_dict()["steps"]
pd.DataFrame([{"effect": s["title"], "where": s["where"], **{p["name"]: p["value"] for p in s["parameters"]}} for s in steps])

# %% [markdown]
# Why it is there: the evidence against the nearest rival, here against adding nothing, as the difference of the log predictive density on blocks that were not fitted, and how many of them it won.

# %%
evidence = steps[0]["evidence"]
print(f"{evidence['won']} of {evidence['blocks']} blocks won against `{evidence['against']}`, difference {evidence['difference']:.0f} ± {evidence['std_error']:.0f}")

# %% [markdown]
# ## What it buys
#
# The error on the held-out record before and after, and what these data could still hide.

# %%
result = missing.to_dict()
gaps = {"linear": result["base"]["gap"]["test_rmse"], "with friction": result["final"]["gap"]["test_rmse"]}
figure, axis = plt.subplots(figsize=(5, 2))
axis.barh(list(gaps), [1e6 * value for value in gaps.values()])
axis.axvline(1e6 * result["noise_floor"], linestyle="--", color="gray", label="noise")
axis.set(xlabel="held-out error, µm")
axis.legend()
assert gaps["with friction"] < 0.1 * gaps["linear"]
print(*result["remaining"]["note"].split(", ")[:6], "…", sep=", ")

# %% [markdown]
# The final equation is a model like any other: it simulates, with the mass sticking where friction holds it.

# %%
missing.model
