#!/usr/bin/env python3
"""The oscillators that courses begin with: Sindyscope beside the Python package PySINDy, in one table.

    pip install -r examples/requirements.txt
    python3 examples/classics.py [SEEDS [NAME ...]]

The program is `sindyscope`, or what the environment's SINDYSCOPE names: an optimised build. Each system is a scenario of the virtual
rig (`sindyscope generate list`) with noise of 0.5 % of the peak; one record is fitted, another with an input 0.85 times as large
and noise of its own is held out. Three ways: `identify` without an option, `diagnose` with a linear base, and PySINDy with all
products of x, v and u to degree 3, its velocity from a Savitzky-Golay filter. PySINDy is given the segment length and the threshold
that predict the held-out record best, of 3 x 10 tried; its seconds are those of one fit. The error is that of the displacement simulated
along the held-out record, over the noise; where the motion is chaotic, along the stretch that Sindyscope's equation predicts.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

PROGRAM = os.environ.get("SINDYSCOPE", "sindyscope")
NOISE = "0.5%"
# Each system: the terms of its acceleration (None: the force is none of products, a sine or a sign), the effect that a linear base
# lacks, the linear base, and the size of the input (or release) of the fitted record.
SYSTEMS = {
    "duffing": ({"x", "x^3", "v", "u"}, {"cubic_stiffness"}, "x, v, u", 1.0),
    "double-well": ({"x", "x^3", "v", "u"}, {"cubic_stiffness"}, "x, v, u", 0.4),
    "ueda": ({"x^3", "v", "u"}, {"cubic_stiffness"}, "x, v, u", 7.5),
    "van-der-pol": ({"x", "v", "x^2*v"}, {"displacement_dependent_damping"}, "x, v", 0.1),
    "van-der-pol-forced": ({"x", "v", "x^2*v", "u"}, {"displacement_dependent_damping"}, "x, v, u", 1.2),
    "rayleigh": ({"x", "v", "v^3", "u"}, {"cubic_damping"}, "x, v, u", 0.8),
    "pendulum": ({"sin(x)", "v", "u"}, {"pendulum_restoring"}, "x, v, u", 1.15),
    "friction-multisine": ({"x", "v", "sgn(v)", "u", "du"}, {"coulomb_friction"}, "x, v, u, du", 0.001),
    "mathieu": (None, {"parametric_stiffness", "cubic_stiffness"}, "x, v", 0.1),
    "parametric-pendulum": (None, {"parametric_stiffness", "pendulum_restoring"}, "x, v", 0.5),
    "upright-pendulum": ({"x", "sin(x)", "v", "u"}, {"pendulum_restoring"}, "x, v, u", 1.0),
    "coupled-pendula": (None, {"pendulum_restoring"}, "x1, x2, v1, v2, u", 0.5),
    "belt": (None, {"belt_friction"}, "x, v", 1.0),
    "hard-stop": (None, {"one_sided_stop"}, "x, v, u", 0.1),
    "freeplay": (None, {"clearance"}, "x, v, u", 0.15),
    "truss": (None, {"oblique_springs"}, "x, v, u", 0.3),
    "uneven-damper": (None, {"bilinear_damping"}, "x, v, u", 1.0),
    "electrostatic": (None, {"electrostatic_force"}, "x, v, u", 1.0),
    "absorber": (None, {"second_mode"}, "x, v, u", 4.0),
    "energy-sink": (None, {"cubic_stiffness"}, "x1, x2, v1, v2, u", 4.0),
    "bouc-wen": (None, {"bouc_wen_hysteresis"}, "x, v, u", 70.7107),
}
SEGMENTS, THRESHOLDS = (11, 31, 81), [10 ** (-2.5 + 0.35 * k) for k in range(10)]

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
        raise RuntimeError(done.stderr.strip().splitlines()[0])
    return time.perf_counter() - began, done.stdout


def table(file):
    rows = [line for line in open(file) if line[:1].isdigit() or line[:1] == "-"]
    return np.array([[float(v) for v in row.split(",")] for row in rows])


def known(file):
    """The acceleration's terms with their coefficients, which the rig writes into the file's head."""
    truth = next(line.split("dv/dt =")[1].split() for line in open(file) if line.startswith("# truth: dv/dt ="))
    sign, terms = 1.0, {}
    for word in truth:
        if word in "+-":
            sign = 1.0 if word == "+" else -1.0
            continue
        factor, _, rest = word.partition("*")
        plain = factor.replace(".", "").isdigit()
        terms[rest if plain else word] = sign * (float(factor) if plain else 1.0)
        sign = 1.0
    return terms


def furthest(found, truth):
    """The largest error of the coefficients of right terms, %; none where no term is right."""
    errors = [abs(found[t] / c - 1) for t, c in truth.items() if t in found]
    return f"{100 * max(errors):.2g} %" if errors else "–"


def ours(fit, test):
    """Terms with coefficients, error over noise and seconds of `identify`, and how long it predicts, s."""
    seconds, text = command("identify", fit, "--test", test, "--json", "-")
    found = json.loads(text)
    equations = [e for e in found["equations"] if e["state"].startswith("v")]
    # Of several masses the terms count in each equation.
    place = (lambda e: "") if len(equations) == 1 else (lambda e: e["state"] + ": ")
    terms = {place(e) + t["term"]: t["coefficient"] for e in equations for t in e["terms"]}
    score = found["test"]
    error = (score.get("rmse_at_horizon") or score["rmse"]) / found["noise_floor"]
    return terms, error, seconds, score.get("horizon")


def missing(fit, test, base):
    """Verdict, effects, error over noise and seconds of `diagnose`."""
    seconds, text = command("diagnose", fit, "--test", test, "--terms", base, "--json", "-")
    found = json.loads(text)
    gap = found["final"]["gap"]
    error = (gap.get("test_rmse_at_horizon") or gap["test_rmse"]) / found["noise_floor"]
    return found["verdict"], [s["effect"] for s in found["steps"]], error, seconds


def peak_noise(file):
    """0.5 % of the peak, the noise that was added."""
    return 0.005 * float(np.max(np.abs(table(file)[:, 1])))


def simulated(model, record, start, horizon):
    """The displacement along a record by the classical Runge-Kutta method, two steps a sample, and how many samples count."""
    t = record[:, 0] - record[0, 0]
    step = t[1] - t[0]
    count = len(t) if horizon is None else max(2, min(len(t), int(round(horizon / step))))
    powers = model.feature_library.powers_
    coefficients = model.coefficients()[: len(start)]
    used = np.any(coefficients != 0, axis=0)
    powers, coefficients = powers[used], coefficients[:, used]
    given = record[:, 1 + len(start) // 2 :]
    inputs = np.interp(np.arange(4 * count - 3) * step / 4, t, given[:, 0]) if given.shape[1] else None

    def rates(quarter, y):
        z = y if inputs is None else np.append(y, inputs[quarter])
        return coefficients @ np.prod(z**powers, axis=1)

    y, h = np.array(start, float), step / 2
    x = np.full(count, np.inf)
    x[0] = y[0]
    for k in range(1, 2 * count - 1):
        quarter = 2 * (k - 1)
        a = rates(quarter, y)
        b = rates(quarter + 1, y + h / 2 * a)
        c = rates(quarter + 1, y + h / 2 * b)
        d = rates(quarter + 2, y + h * c)
        y = y + h / 6 * (a + 2 * b + 2 * c + d)
        if not np.all(np.abs(y) < 1e6):
            break
        if k % 2 == 0:
            x[k // 2] = y[0]
    return x, count


def theirs(fit, test, horizon, noise):
    """The best of all segments and thresholds on the held-out record: terms with coefficients, error over noise, seconds of a fit."""
    train, held = table(fit), table(test)
    names = next(line for line in open(fit) if line.startswith("t")).split(",")
    masses = sum(name.startswith("x") for name in names)
    given = train[:, 1 + masses :]
    number = [""] if masses == 1 else [str(k + 1) for k in range(masses)]
    variables = [q + k for q in "xv" for k in number] + ["u"] * given.shape[1]
    best = None
    for segment in SEGMENTS:
        smooth = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": segment, "polyorder": 3})
        t, x = train[:, 0] - train[0, 0], train[:, 1 : 1 + masses]
        v = smooth._differentiate(x, t)
        rest = held[:, 1 : 1 + masses]
        start = np.hstack([rest[0], smooth._differentiate(rest, held[:, 0] - held[0, 0])[0]])
        seen = set()
        for threshold in THRESHOLDS:
            model = pysindy.SINDy(
                optimizer=pysindy.STLSQ(threshold=threshold),
                feature_library=pysindy.PolynomialLibrary(degree=3),
                differentiation_method=smooth,
            )
            began = time.perf_counter()
            model.fit(np.hstack([x, v]), t=t, u=given if given.shape[1] else None, feature_names=variables)
            seconds = time.perf_counter() - began
            rows = list(zip(number, model.coefficients()[masses:]))
            place = (lambda k: "") if masses == 1 else (lambda k: f"v{k}: ")
            kept = {place(k) + n: c for k, row in rows for n, c in zip(model.get_feature_names(), row) if c != 0}
            if frozenset(kept) in seen:
                continue
            seen.add(frozenset(kept))
            run, count = simulated(model, held, start, horizon)
            error = np.sqrt(np.mean((run - held[:count, 1]) ** 2)) / noise if np.all(np.isfinite(run)) else np.inf
            if best is None or error < best[1]:
                best = (kept, error, seconds)
    return ({n.replace(": ", ":").replace(" ", "*"): c for n, c in best[0].items()}, *best[1:])


def number(value):
    return "–" if value is None else "does not stay" if not value < 1e6 else f"{value:.3g}"


def terms_found(found, truth):
    if truth is None:
        return f"{len(found)} terms"
    if found == truth:
        return "exactly"
    return ", ".join(["without " + " ".join(sorted(truth - found))] * bool(truth - found) + ["and " + " ".join(sorted(found - truth))] * bool(found - truth))


def main():
    warnings.filterwarnings("ignore")
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    chosen = sys.argv[2:] or list(SYSTEMS)
    rows = [["system", "seed", "identify: terms", "coefficients within", "noises", "s", "diagnose with a linear base", "noises", "s"]]
    rows[0] += ["PySINDy: terms", "coefficients within", "noises", "s of a fit"]
    exact, of_products, theirs_exact = 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            truth, effects, base, size = SYSTEMS[name]
            for seed in range(1, seeds + 1):
                fit, test = Path(folder) / f"{name}-{seed}.csv", Path(folder) / f"{name}-{seed}-test.csv"
                command("generate", name, "--seed", seed, "--noise", NOISE, "--out", fit)
                command("generate", name, "--seed", seed + 100, "--noise", NOISE, "--amplitude", 0.85 * size, "--out", test)
                row, horizon = [name, str(seed)], None
                try:
                    found, error, seconds, horizon = ours(fit, test)
                    within = "–" if truth is None else furthest(found, known(fit))
                    row += [terms_found(set(found), truth), within, number(error), f"{seconds:.1f}"]
                    of_products += truth is not None
                    exact += set(found) == truth
                except RuntimeError as problem:
                    row += [str(problem), "–", "–", "–"]
                try:
                    verdict, named, error, seconds = missing(fit, test, base)
                    said = ", ".join(named) or "nothing"
                    row += [f"{said} ({verdict}{'' if set(named) == effects else '; expected ' + ', '.join(effects)})", number(error), f"{seconds:.1f}"]
                except RuntimeError as problem:
                    row += [str(problem), "–", "–"]
                if pysindy:
                    kept, error, seconds = theirs(fit, test, horizon, peak_noise(fit))
                    theirs_exact += set(kept) == truth
                    within = "–" if truth is None else furthest(kept, known(fit))
                    row += [terms_found(set(kept), truth), within, number(error), f"{seconds:.3f}"]
                else:
                    row += ["–"] * 4
                rows.append(row)
                print("| " + " | ".join(row) + " |", flush=True)
    print(f"\nForce of products, a sine or a sign: identify has exactly the terms in {exact} of {of_products} runs, PySINDy in {theirs_exact}.\n")
    for row in [rows[0], ["---"] * len(rows[0]), *rows[1:]]:
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
