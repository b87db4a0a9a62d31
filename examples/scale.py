#!/usr/bin/env python3
"""What a study of many hidden effects costs: a case, a worker's memory, and a hundred cores by what one and two processes measure.

    python3 examples/scale.py [CASES [FOLDER]]

The virtual rig draws CASES plants (300 unless told), each of which hides one effect of the catalogue, drawn blind, and records them with noise of
1 % of the RMS. `sindyscope batch --diagnose` names the effects: a part of the cases with one process on one core, then the same part and at last all
with two processes on a core each (`--part 1/2`, `--part 2/2`), as the tasks of a job array would. Both write into FOLDER (a temporary one unless told); run again, it goes on
where it was, but what was done before is not measured again, so the figures need a folder of their own.

The program is `sindyscope`, or what the environment's SINDYSCOPE names: an optimised build. Needs Linux, Python 3.9 or later and nothing else.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

PROGRAM = os.environ.get("SINDYSCOPE", "sindyscope")
NOISE = "1%"
# Of the cases that one process does alone: enough for a mean, little beside the whole.
ALONE = 0.25
# What the two extrapolations are made for.
STUDY, CORES = 10_000, 100


def draw(folder, seed):
    """The file of a case, and the effect that it hides, which the file itself does not tell."""
    file = folder / f"case{seed:05}.csv"
    drawn = [PROGRAM, "generate", "hidden", "--seed", str(seed), "--noise", NOISE, "--reveal", "--out", "-"]
    text = subprocess.run(drawn, capture_output=True, text=True, check=True).stdout
    head, rows = text[: text.index("t [s]")], text[text.index("t [s]") :]
    [effect] = [m[1] for m in re.finditer(r"^# (\w+): ", head, re.MULTILINE) if m[1] != "Hidden"][:1]
    file.write_text(rows)
    return file.name, effect


def run(cores, folder, records, out):
    """Runs a batch with one process on each of these cores; seconds from start to end, the seconds of processor of all, and the largest
    memory of one, bytes."""
    began, running = time.perf_counter(), []
    for k, core in enumerate(cores):
        command = [PROGRAM, "batch", "--quiet", str(records), "--diagnose", "--out", str(folder / out)]
        command += ["--part", f"{k + 1}/{len(cores)}"]
        # The pool of threads is as large as the process may have cores.
        running.append(subprocess.Popen(command, preexec_fn=lambda core=core: os.sched_setaffinity(0, {core}), stdout=subprocess.DEVNULL))
    used = [os.wait4(process.pid, 0) for process in running]
    if any(status for _, status, _ in used):
        sys.exit(f"a part ended with an error; the commands were those of `{PROGRAM} batch --diagnose`")
    seconds = time.perf_counter() - began
    usage = [of for *_, of in used]
    # Linux counts it in kB.
    return seconds, sum(of.ru_utime + of.ru_stime for of in usage), 1024 * max(of.ru_maxrss for of in usage)


def table(folder, records, out):
    """The table of parts that are all done."""
    subprocess.run([PROGRAM, "batch", "--quiet", str(records), "--diagnose", "--out", str(folder / out)], check=True, stdout=subprocess.DEVNULL)
    with open(folder / out, newline="") as file:
        return list(csv.DictReader(file))


def listed(folder, name, cases):
    with open(folder / name, "w", newline="") as file:
        csv.writer(file).writerows([("file", "hidden"), *cases])
    return folder / name


def study(folder, count):
    available = sorted(os.sched_getaffinity(0))
    if len(available) < 2:
        sys.exit("two cores are needed, to see what a second process costs")
    with ThreadPoolExecutor(len(available)) as together:
        cases = list(together.map(lambda seed: draw(folder, seed), range(1, count + 1)))
    few = cases[: max(2, round(ALONE * count))]
    of_few, of_all = listed(folder, "few.csv", few), listed(folder, "list.csv", cases)
    one = run(available[:1], folder, of_few, "one.csv")
    # Cases differ: what a second process costs shows where both did the same ones. Of all, these are done then.
    two = run(available[:2], folder, of_few, "two.csv")
    rest = run(available[:2], folder, of_all, "two.csv")
    rows = table(folder, of_all, "two.csv")
    # The same few, done once more by two: what one process alone found must stand there too.
    apart = table(folder, of_few, "one.csv")
    if [dict(row) for row in rows[: len(few)]] != [{name: row.get(name, "") for name in rows[0]} for row in apart]:
        sys.exit("one process and two found different things")
    seconds = [(cores * spent / cases, work / cases) for cores, cases, (spent, work, _) in ((1, len(few), one), (2, len(few), two))]
    seconds.append((2 * (two[0] + rest[0]) / count, (two[1] + rest[1]) / count))
    return rows, len(few), seconds, max(memory for *_, memory in (one, two, rest))


def extrapolated(seconds):
    """What a study costs if a case takes so long on a core."""
    return f"{STUDY * seconds / CORES / 60:.1f} min ({STUDY * seconds / 3600:.1f} core hours)"


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        rows, few, ((one, work_one), (same, work_same), (two, work_two)), memory = study(folder, count)
    first = [row["effects"].split(", ")[0] == row["hidden"] for row in rows]
    among = [row["hidden"] in f"{row['effects']}, {row['indistinguishable']}".split(", ") for row in rows]
    verdicts = sorted({row["verdict"] or row["status"] for row in rows})
    lines = [
        ("cases", str(count)),
        (f"one process on one core, a case of the first {few}", f"{one:.2f} s, of which {work_one:.2f} s of processor"),
        ("two processes on a core each, a case of these and core", f"{same:.2f} s, of which {work_same:.2f} s of processor"),
        ("the same, a case of all and core", f"{two:.2f} s, of which {work_two:.2f} s of processor"),
        ("memory of a worker, at most", f"{memory / 2**20:.0f} MB"),
        (f"{STUDY:,} cases on {CORES} cores, by two processes", extrapolated(two)),
        ("the same on cores that nothing else uses", extrapolated(work_two)),
        ("the hidden effect named first", f"{100 * sum(first) / count:.1f} %"),
        ("named, or among those that the data cannot tell from it", f"{100 * sum(among) / count:.1f} %"),
        ("verdicts", ", ".join(f"{v} {sum((row['verdict'] or row['status']) == v for row in rows)}" for v in verdicts)),
    ]
    width = max(len(name) for name, _ in lines)
    for name, value in lines:
        print(f"{name.ljust(width)}  {value}")


if __name__ == "__main__":
    main()
