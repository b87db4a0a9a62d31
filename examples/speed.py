#!/usr/bin/env python3
"""How fast Sindyscope is beside the Python package PySINDy, in one table.

    pip install -r examples/requirements.txt
    python3 examples/speed.py [REPEATS]

The program is `sindyscope`, or what the environment's SINDYSCOPE names: an optimised build. Each figure is the fastest of the
repeats (5 unless told). A fit is what both do: smooth, differentiate, evaluate the library, regress sparsely. Sindyscope's standard
errors and the bias of smoothing and noise are found beside and after the response, PySINDy has none. A whole command is from start to end of the program,
reading, simulating and writing included; PySINDy's counterpart is fit and simulation, without starting Python.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = os.environ.get("SINDYSCOPE", "sindyscope")
REPEATS = int(sys.argv[1]) if len(sys.argv) > 1 else 5
# Samples of the Duffing record, at 100 Hz; all terms of both to the third power.
SAMPLES = [7000, 70_000, 700_000]
SEGMENT, THRESHOLD, POWERS = 81, 0.1, (1, 2, 3)

try:
    import numpy as np
    import pysindy
except ImportError as error:
    pysindy = None
    print(f"({error}: pip install -r examples/requirements.txt gives PySINDy's columns)\n")


def command(*words):
    began = time.perf_counter()
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    return 1e3 * (time.perf_counter() - began), done.stdout


def fastest(measure):
    return min(measure() for _ in range(REPEATS))


def ours(file):
    terms = ", ".join(f"{q}^{p}" if p > 1 else q for q in "xvu" for p in POWERS)
    options = ["identify", file, "--terms", terms, "--window", SEGMENT, "--order", 3, "--form", "derivative", "--scaling", "raw",
               "--threshold", THRESHOLD, "--refine=no", "--json", "-"]
    fits, wholes = [], []
    for _ in range(REPEATS):
        whole, text = command(*options)
        wholes.append(whole)
        fits.append(json.loads(text)["elapsed_ms"])
    return min(f["fit"] for f in fits), min(f["simulate"] for f in fits), min(wholes)


def theirs(file):
    t, x, u = np.loadtxt((line for line in open(file) if line[0].isdigit()), delimiter=",", unpack=True)
    smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": SEGMENT, "polyorder": 3})
    powers = [lambda q: q, lambda q: q**2, lambda q: q**3]
    models = []

    def fit():
        began = time.perf_counter()
        v = smooth._differentiate(x[:, None], t)
        library = pysindy.CustomLibrary(powers, [lambda q: q, lambda q: q + "^2", lambda q: q + "^3"])
        model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=THRESHOLD), feature_library=library, differentiation_method=smooth)
        model.fit(np.hstack([x[:, None], v]), t=t, u=u[:, None])
        models.append((model, np.array([x[0], v[0, 0]])))
        return 1e3 * (time.perf_counter() - began)

    fitted = fastest(fit)
    if len(t) > SAMPLES[0]:
        return fitted, None
    # Once: it takes seconds.
    model, start = models[0]
    began = time.perf_counter()
    model.simulate(start, t, u=u[:, None])
    return fitted, 1e3 * (time.perf_counter() - began)


def milliseconds(value):
    return "" if value is None else f"{value:.3g} ms" if value < 1e4 else f"{value / 1e3:.3g} s"


def times(slow, fast):
    return "" if slow is None else f"{slow / fast:.0f} ×"


def main():
    rows = [["", "PySINDy", "Sindyscope", "faster"]]
    with tempfile.TemporaryDirectory() as folder:
        for samples in SAMPLES:
            file = Path(folder) / f"{samples}.csv"
            command("generate", "duffing-noisy", "--seed", 1, "--duration", samples / 100, "--out", file)
            fit, simulate, whole = ours(file)
            their_fit, their_simulation = theirs(file) if pysindy else (None, None)
            said = f"{samples:,} samples".replace(",", " ")
            rows.append([f"{said}: fit", milliseconds(their_fit), milliseconds(fit), times(their_fit, fit)])
            rows.append([f"{said}: simulation", milliseconds(their_simulation), milliseconds(simulate), times(their_simulation, simulate)])
            rows.append([f"{said}: the whole command", "", milliseconds(whole), ""])
        choose = fastest(lambda: command("identify", Path(folder) / f"{SAMPLES[0]}.csv", "--format", "text")[0])
        rows.append([f"{SAMPLES[0]} samples: every setting chosen", "", milliseconds(choose), ""])
        start = fastest(lambda: command("--version")[0])
        rows.append(["start of the program", "", milliseconds(start), ""])
    widths = [max(len(r[k]) for r in rows) for k in range(4)]
    for row in [rows[0], ["-" * w for w in widths], *rows[1:]]:
        print("| " + " | ".join(c.ljust(w) for c, w in zip(row, widths)) + " |")


if __name__ == "__main__":
    main()
