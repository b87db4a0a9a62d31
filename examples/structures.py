#!/usr/bin/env python3
"""Structures of the virtual rig: Sindyscope's modes beside those of the Python package pyOMA2, in one table.

    pip install -r examples/requirements-structures.txt
    python3 examples/structures.py [SEEDS [PART OF A NAME]]

The program is `sindyscope`, or what the environment's SINDYSCOPE names: an optimised build. Each structure is a scenario of the rig
(`sindyscope generate list`) with 1 % of noise; both get the same record. A mode is found where a frequency within 1 % of the true one
is told; its errors are those of frequency and damping ratio. Sindyscope chooses the number of modes by itself; where a force is hidden
its modes are those of `diagnose`, of the structure without the force. pyOMA2 is run as
covariance-driven subspace identification of the sensors alone (SSI-cov) and with the measured input (IOcov); its user picks poles in
the stabilization diagram, so it is given the true frequencies and takes the stable pole next to each at the lowest order
(`find_min`), and of three numbers of block rows the one with which it comes nearest to the truth. Its seconds are those of one run.

A nonlinear force and its place are asked of `diagnose` alone: pyOMA2 and PySINDy have no means for it with fewer sensors than modes.
"""

import contextlib
import io
import json
import logging
import os
import re
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

PROGRAM = os.environ.get("SINDYSCOPE", "sindyscope")
os.environ["TQDM_DISABLE"] = "1"  # no bars of progress in the table
STRUCTURES = {
    "chain, 5 accelerometers": ["chain"],
    "chain, 2 accelerometers": ["chain", "--measure", "a2,a5"],
    "chain, 1 displacement": ["chain", "--measure", "x4"],
    "beam, 3 accelerometers": ["beam"],
    "chain, friction at 3": ["chain", "--set", "friction=2", "--amplitude", "10"],
    "chain, cubic spring at 3": ["chain", "--set", "cubic=3e7", "--amplitude", "10"],
}
# What hides where, as `diagnose` is to tell it.
HIDDEN = {"chain, friction at 3": "coulomb_friction at ground-3", "chain, cubic spring at 3": "cubic_stiffness at ground-3"}
BLOCK_ROWS = (20, 40, 80)
ORDERS = 40

try:
    import numpy as np
    from pyoma2.algorithms import SSI
    from pyoma2.setup import SingleSetup
except ImportError as error:
    SSI = None
    print(f"({error}: pip install -r examples/requirements-structures.txt gives pyOMA2's columns)\n")


def command(*words):
    began = time.perf_counter()
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().splitlines()[0])
    return time.perf_counter() - began, done.stdout


def truth(path, highest):
    """Frequencies (Hz) and damping ratios of the structure's modes in the driven band."""
    line = next(l for l in path.read_text().splitlines() if l.startswith("# truth: modes"))
    modes = [(float(f), float(z)) for f, z in re.findall(r"([\d.]+) Hz \(([\d.]+)\)", line)]
    return [mode for mode in modes if mode[0] < highest]


def compared(wanted, found):
    """Modes found, worst errors of frequency and damping ratio among them (%)."""
    worst_f = worst_z = count = 0
    for f, z in wanted:
        near = [m for m in found if abs(m[0] / f - 1) < 0.01]
        if near:
            count += 1
            best = min(near, key=lambda m: abs(m[0] / f - 1))
            worst_f, worst_z = max(worst_f, abs(best[0] / f - 1)), max(worst_z, abs(best[1] / z - 1))
    return count, 100 * worst_f, 100 * worst_z


def subspace(path, wanted, method):
    """The best of several block rows: modes found, worst errors, seconds of that run."""
    rows = [l for l in path.read_text().splitlines() if not l.startswith("#")]
    names = rows[0].split(",")
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows[1:]])
    sensors = [k for k, name in enumerate(names) if re.match(r"[xva]\d* ", name)]
    force = [k for k, name in enumerate(names) if name.startswith("u")]
    rate = (len(table) - 1) / (table[-1, names.index(next(n for n in names if n.startswith("t")))] - table[0, 0])
    best = None
    for block in BLOCK_ROWS:
        more = {"U": table[:, force]} if method == "IOcov" else {}
        if len(sensors) == 1:
            # One sensor has no phase to be complex in: pyOMA2's criteria of mode complexity would drop every pole.
            more["hc"] = {"xi_max": 0.2, "mpc_lim": None, "mpd_lim": None, "CoV_max": 0.2}
        began = time.perf_counter()
        try:
            setup = SingleSetup(table[:, sensors], fs=rate)
            algorithm = SSI(name="ssi", method=method, br=block, ordmax=ORDERS, **more)
            setup.add_algorithms(algorithm)
            setup.run_by_name("ssi")
            seconds = time.perf_counter() - began
            found = []
            for f, _ in wanted:
                # One after the other: a frequency without a stable pole must not lose the rest.
                try:
                    setup.mpe("ssi", sel_freq=[f], order_in="find_min")
                    found.append((float(algorithm.result.Fn[0]), float(algorithm.result.Xi[0])))
                except Exception:
                    continue
        except Exception as error:
            print(f"  pyOMA2 {method}, {block} block rows: {error}", file=sys.stderr)
            continue
        result = (*compared(wanted, found), seconds)
        if best is None or (-result[0], result[1]) < (-best[0], best[1]):
            best = result
    return best


def cells(result):
    if result is None:
        return "- | - | - | -"
    count, frequency, damping, seconds = result
    return f"{count} | {frequency:.3f} | {damping:.1f} | {seconds:.2f}"


def main():
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    print("| structure | modes | Sindyscope: found | f, % | damping, % | s | SSI-cov: found | f, % | damping, % | s "
          "| IOcov: found | f, % | damping, % | s | diagnose | s |")
    print("| --- |" + " --- |" * 15)
    with tempfile.TemporaryDirectory() as folder:
        wanted_names = sys.argv[2] if len(sys.argv) > 2 else ""
        for name, words in ((n, w) for n, w in STRUCTURES.items() if wanted_names in n):
            for seed in range(1, seeds + 1):
                path = Path(folder) / "train.csv"
                command("generate", *words, "--seed", seed, "--out", path)
                wanted = truth(path, 18 if words[0] == "chain" else 120)
                seconds, text = command("identify", path, "--base", "modes", "--json", "-")
                modes = [(m["frequency"], m["damping"]) for m in json.loads(text)["modes"]]
                others = [None, None]
                if SSI is not None:
                    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
                        warnings.simplefilter("ignore")
                        logging.disable(logging.CRITICAL)
                        others = [subspace(path, wanted, method) for method in ("cov", "IOcov")]
                searched, text = command("diagnose", path, "--base", "modes", "--json", "-")
                found = json.loads(text)
                if name in HIDDEN:
                    # Beside a force the modes are those of the structure without it.
                    modes, seconds = [(m["frequency"], m["damping"]) for m in found["modes"]], searched
                own = (*compared(wanted, modes), seconds)
                step = next((f"{s['effect']} at {s['place']}" for s in found["steps"]), "nothing")
                told = f"{found['verdict']}: {step}"
                told += "" if step == HIDDEN.get(name, "nothing") and found["verdict"] != "unexplained" else " (wrong)"
                print(f"| {name} | {len(wanted)} | {cells(own)} | {cells(others[0])} | {cells(others[1])} | {told} | {searched:.1f} |",
                      flush=True)


if __name__ == "__main__":
    main()
