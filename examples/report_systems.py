#!/usr/bin/env python3
"""The report's systems, identified by Sindyscope and by the Python package PySINDy from the same files, in one table.

Run it as a program, or cell by cell (`# %%`) in an editor that knows such cells:

    pip install -r examples/requirements.txt
    python3 examples/report_systems.py [WORD]        (only systems whose name holds the word)

The program is `sindyscope`, or what the environment's SINDYSCOPE names. Without PySINDY its columns stay empty. Both get the
report's segment length, threshold and library; the last column is Sindyscope with its coefficients refined. Each error is that of
the simulated displacement on a record that was not fitted (another forcing, another tone), the initial state fitted to it.
"""

# %% The systems: files, segment length (samples), threshold, and functions that are applied to every variable
import csv
import json
import os
import subprocess
import sys
import time
from pathlib import Path

PROGRAM = os.environ.get("SINDYSCOPE", "sindyscope")
DATA = Path(__file__).resolve().parent.parent / "sample_data"
POWERS = ["{}", "{}^2", "{}^3"]
SIGNS = ["{}", "sgn({})"]
SYSTEMS = [
    # name, fitted, held out, segment, threshold, functions, variables
    ("Duffing", "duffing", "duffing_test", 11, 0.15, POWERS, ["x", "v", "u"]),
    ("Duffing, noise 0.01 m", "duffing_noisy", "duffing_test", 81, 0.1, POWERS, ["x", "v", "u"]),
    ("friction", "friction", "friction_test", 11, 1e-3, SIGNS, ["x", "v", "u", "du"]),
    ("friction, noise 1e-5 m", "friction_noisy", "friction_noisy_test", 31, 1e-3, SIGNS, ["x", "v", "u", "du"]),
    ("friction, steady state", "friction_steady", "friction_steady_test", 31, 1e-3, SIGNS, ["x", "v", "u", "du"]),
]


# %% Sindyscope: a command that answers in JSON
def sindyscope(system, *more):
    name, fitted, held_out, segment, threshold, functions, variables = system
    terms = ", ".join(f.format(v) for v in variables for f in functions)
    command = [PROGRAM, "identify", DATA / f"{fitted}.csv", "--test", DATA / f"{held_out}.csv", "--terms", terms, "--window", str(segment),
               "--order", "3", "--form", "derivative", "--scaling", "raw", "--threshold", str(threshold), *more, "--json", "-"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{name}: {done.stderr.strip()}")
    result = json.loads(done.stdout)
    [equation] = [e for e in result["equations"] if e["state"] == "v"]
    return {
        "equation": {t["term"]: t["coefficient"] for t in equation["terms"]},
        "error": result["test"]["rmse"] if result["test"] else None,
        "milliseconds": result["elapsed_ms"]["fit"],
    }


# %% PySINDy: smoothed finite differences, a custom library, thresholded least squares
try:
    import numpy as np
    import pysindy
    from scipy.interpolate import CubicSpline
    from scipy.optimize import least_squares
except ImportError as error:
    pysindy = None
    print(f"({error}: pip install -r examples/requirements.txt gives PySINDy's columns)\n")


def records(name):
    """The records of a sample: times, displacements, inputs."""
    with open(DATA / f"{name}.csv", newline="") as file:
        rows = csv.reader(line for line in file if not line.startswith("#"))
        head = [cell.split()[0] for cell in next(rows)]
        found = {}
        for row in rows:
            cells = dict(zip(head, row))
            found.setdefault(cells.get("record"), []).append([float(cells[k]) for k in "txu"])
    return [np.array(r).T for r in found.values()]


def features(functions):
    made = {"{}": lambda q: q, "{}^2": lambda q: q**2, "{}^3": lambda q: q**3, "sgn({})": lambda q: np.sign(q)}
    return [made[f] for f in functions]


def package(system):
    name, fitted, held_out, segment, threshold, functions, variables = system
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": segment, "polyorder": 3})

    def states(record):
        t, x, u = record
        v = smooth._differentiate(x[:, None], t)[:, 0]
        inputs = [u] if "du" not in variables else [u, smooth._differentiate(u[:, None], t)[:, 0]]
        return t, np.stack([x, v], 1), np.stack(inputs, 1)

    runs = [states(r) for r in records(fitted)]
    library = pysindy.CustomLibrary(features(functions), [f.format for f in functions])
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=threshold, alpha=0.05), feature_library=library, differentiation_method=smooth)
    began = time.perf_counter()
    model.fit([x for _, x, _ in runs], t=[t for t, _, _ in runs], u=[u for _, _, u in runs], feature_names=variables)
    milliseconds = 1e3 * (time.perf_counter() - began)
    names, coefficients = model.get_feature_names(), model.coefficients()[1]
    equation = {n: float(c) for n, c in zip(names, coefficients) if c != 0.0}
    return {"equation": equation, "error": held_out_error(equation, functions, variables, states(records(held_out)[0])), "milliseconds": milliseconds}


def held_out_error(equation, functions, variables, run):
    """RMS error of the simulated displacement, its initial state fitted; as many steps of Runge and Kutta as samples."""
    t, x, inputs = run
    step = float(t[1] - t[0])
    u = CubicSpline(t, inputs)
    halves = np.concatenate([t, [t[-1] + step]])[:, None] + np.array([0.0, 0.5 * step])
    driven = u(halves.ravel()[: 2 * len(t) - 1])
    plain = {"{}": "{}", "{}^2": "{}*{}", "{}^3": "{}*{}*{}", "sgn({})": "(({}>0)-({}<0))"}
    # Of the known `dx/dt = v` and the terms that were found, one Python function.
    sums = [f"({equation[f.format(q)]!r})*{plain[f].replace('{}', q)}" for q in variables for f in functions if f.format(q) in equation]
    rate = eval(f"lambda x, v, u, du=0.0: {' + '.join(sums) or '0.0'}")

    def simulate(start):
        a, b = map(float, start)
        out = [a]
        for k in range(len(t) - 1):
            here, half, there = map(tuple, driven[2 * k : 2 * k + 3].tolist())
            k1 = rate(a, b, *here)
            k2 = rate(a + 0.5 * step * b, b + 0.5 * step * k1, *half)
            k3 = rate(a + 0.5 * step * (b + 0.5 * step * k1), b + 0.5 * step * k2, *half)
            k4 = rate(a + step * (b + 0.5 * step * k2), b + step * k3, *there)
            a, b = a + step * b + step * step / 6.0 * (k1 + k2 + k3), b + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            if not abs(a) < 1e3:
                return np.full(len(t), np.inf)
            out.append(a)
        return np.array(out)

    def residual(start):
        return np.nan_to_num(simulate(start) - x[:, 0], posinf=1e6)

    scale = np.maximum(np.abs(x).max(0), 1e-12)
    fitted = least_squares(residual, x[0], x_scale=scale, diff_step=1e-4, max_nfev=4)
    error = float(np.sqrt(np.mean(fitted.fun**2)))
    return error if error < 1e3 else None


# %% One table
def number(value, form=".2e"):
    return "diverged" if value is None else format(value, form)


def main():
    empty = {"equation": {}, "error": None, "milliseconds": None}
    rows, equations = [], []
    word = sys.argv[1] if __name__ == "__main__" and len(sys.argv) > 1 else ""
    for system in [s for s in SYSTEMS if word in s[0]]:
        ours, refined = sindyscope(system), sindyscope(system, "--refine")
        theirs = package(system) if pysindy else empty
        cell = (lambda v, f=".2e": number(v, f)) if pysindy else (lambda *_: "")
        rows.append([system[0], cell(theirs["error"]), number(ours["error"]), number(refined["error"]),
                     cell(theirs["milliseconds"], ".1f"), number(ours["milliseconds"], ".1f")])
        equations.append((system[0], [("PySINDy", theirs), ("Sindyscope", ours), ("refined", refined)]))
    head = ["RMSE of x on data not fitted, m", "PySINDy", "Sindyscope", "refined", "fit, ms: PySINDy", "Sindyscope"]
    widths = [max(len(r[k]) for r in [head, *rows]) for k in range(len(head))]
    for row in [head, ["-" * w for w in widths], *rows]:
        print("| " + " | ".join(c.ljust(w) for c, w in zip(row, widths)) + " |")
    print("\nThe acceleration, as each found it:")
    for name, found in equations:
        print(f"\n{name}")
        for who, result in found:
            if result["equation"]:
                print(f"  {who:<11}", " ".join(f"{c:+.4g} {t}" for t, c in result["equation"].items()))


if __name__ == "__main__":
    main()
