#!/usr/bin/env python3
"""One row of a table for each record in a folder: the identified coefficients with their errors, or why it failed.

    python3 examples/folder_to_table.py FOLDER TABLE.csv [--jobs N] [--part I/N] [-- OPTIONS OF identify]

As many records as there are processors are identified at once. What is done lies in TABLE.csv.parts and is not done again
when the same is run again; other options, or a file that has changed, are done anew. Of a cluster's job array each task does
its share (here ten tasks), and a last run without an array writes the whole table:

    sbatch --array=0-9 --wrap 'python3 examples/folder_to_table.py FOLDER TABLE.csv --jobs 1'

Elsewhere `--part I/N` says which share, counted from 0:

    seq 0 9 | xargs -P 4 -I {} python3 examples/folder_to_table.py FOLDER TABLE.csv --jobs 1 --part {}/10

The program is `sindyscope`, or what the environment's SINDYSCOPE names. Needs Python 3.9 or later and nothing else.
"""

import argparse
import csv
import hashlib
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

PROGRAM = os.environ.get("SINDYSCOPE", "sindyscope")
ENDINGS = set(".csv .tsv .txt .dat .asc .mat .h5 .hdf5 .npy .npz .xlsx .xlsm .xlsb .xls .ods .lvm .tdms .uff .unv .ufb .wav .mf4 .mdf".split())


def part(text):
    """`3/10` as (3, 10)."""
    index, _, count = text.partition("/")
    if not (index.isdigit() and count.isdigit() and int(index) < int(count)):
        raise argparse.ArgumentTypeError(f"{text!r} is no share: write 0/10 to 9/10")
    return int(index), int(count)


def arguments():
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("table", type=Path)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--part", type=part)
    given = parser.parse_args(words[:at])
    if given.part is None and "SLURM_ARRAY_TASK_ID" in os.environ:
        first = int(os.environ.get("SLURM_ARRAY_TASK_MIN", 0))
        given.part = int(os.environ["SLURM_ARRAY_TASK_ID"]) - first, int(os.environ["SLURM_ARRAY_TASK_COUNT"])
    return given, words[at + 1 :]


def result_file(parts, file, options):
    """Where a record's result lies: its name changes with the file's path, size and time, and with the options."""
    stat = file.stat()
    key = json.dumps([str(file), stat.st_size, stat.st_mtime_ns, options])
    return parts / f"{file.name}-{hashlib.sha256(key.encode()).hexdigest()[:12]}.json"


def identify(file, result, options):
    """Writes the program's JSON, or {"failed": reason}, whole or not at all."""
    done = subprocess.run([PROGRAM, "identify", str(file), *options, "--json", "-"], capture_output=True, text=True)
    if done.returncode == 2:
        # The options are wrong for every record alike: nothing is to be kept of that.
        sys.exit(done.stderr.strip())
    if done.returncode == 0:
        text = done.stdout
    else:
        said = done.stderr.strip().splitlines() or [f"ended with status {done.returncode}"]
        text = json.dumps({"failed": said[0].removeprefix("sindyscope: ")})
    new = result.with_suffix(f".{os.getpid()}.new")
    new.write_text(text, "utf-8")
    new.replace(result)


def row(file, result):
    """A record's row; its columns are the terms that were found in it."""
    found = json.loads(result.read_text("utf-8"))
    if "failed" in found:
        return {"file": str(file), "status": "failed", "reason": found["failed"]}
    cells = {"file": str(file), "status": found["status"], "noise_floor": found["noise_floor"]}
    for of, score in (("train", found["train"]), ("test", found["test"])):
        if score and score["rmse"] is not None:
            cells[f"{of} rmse"], cells[f"{of} nrmse"] = score["rmse"], score["nrmse"]
    for equation in found["equations"]:
        for term in equation["terms"]:
            name = f"d{equation['state']}/dt: {term['term']}"
            cells[name], cells[f"± {name}"] = term["coefficient"], term["std_error"]
    return cells


def main():
    given, options = arguments()
    files = sorted(p for p in given.folder.rglob("*") if p.suffix.lower() in ENDINGS and p.is_file())
    if not files:
        sys.exit(f"{given.folder} holds no file of measurements: give the folder that the records are in")
    parts = given.table.with_name(given.table.name + ".parts")
    parts.mkdir(parents=True, exist_ok=True)
    results = {file: result_file(parts, file, options) for file in files}
    index, count = given.part or (0, 1)
    work = [f for f in files[index::count] if not results[f].exists()]
    with ThreadPoolExecutor(max(given.jobs, 1)) as together:
        list(together.map(lambda f: identify(f, results[f], options), work))
    rows = [row(file, result) for file, result in results.items() if result.exists()]
    missing = len(files) - len(rows)
    if missing == 0:
        names = dict.fromkeys(name for cells in rows for name in cells if name != "reason")
        with open(given.table, "w", newline="", encoding="utf-8") as out:
            writer = csv.DictWriter(out, [*names, "reason"], restval="")
            writer.writeheader()
            writer.writerows(rows)
    failed = sum(cells["status"] == "failed" for cells in rows)
    print(f"{len(work)} identified now, {len(rows) - len(work)} before, {failed} failed" + (f"; {missing} left, no table yet" if missing else f"; wrote {given.table}"))


if __name__ == "__main__":
    main()
