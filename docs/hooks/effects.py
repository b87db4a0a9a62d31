"""The catalogue of effects, one page each, made from the program's own entries (`sindyscope effects --json`)."""

import html
import json
import os
import subprocess

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

FOLDER = "effects"
entries = []


def on_config(config):
    binary = os.environ.get("SINDYSCOPE", "")
    try:
        done = subprocess.run([os.path.abspath(binary), "effects", "--json"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise PluginError(f"`{binary} effects --json` failed: {error}") from error
    entries[:] = json.loads(done.stdout)["effects"]
    for part in config["nav"]:
        if isinstance(part, dict) and "Effects" in part:
            part["Effects"] += [f"{FOLDER}/{e['effect']}.md" for e in entries]
    return config


def on_files(files, config):
    for entry in entries:
        files.append(File.generated(config, f"{FOLDER}/{entry['effect']}.md", content=page(entry)))
    return files


def on_page_markdown(markdown, page, config, files):
    return markdown.replace("{{ effects }}", table()) if page.file.src_uri == f"{FOLDER}/index.md" else markdown


def table():
    """Every effect with a line, family by family."""
    lines, family = [], None
    for entry in entries:
        if entry["family"] != family:
            family = entry["family"]
            lines += ["", f"## {family}", "", "| effect | what it is | told apart by |", "| --- | --- | --- |"]
        lines.append(f"| {link(entry['effect'])} | {entry['explanation']} | {entry['separates']} |")
    return "\n".join(lines)


def link(effect):
    title = next(e["title"] for e in entries if e["effect"] == effect)
    return f"[{title}]({effect}.md)"


def page(entry):
    lines = [f"# {entry['title']}", "", entry["explanation"], "", f"Name in commands and JSON: `{entry['effect']}`. Family: {entry['family'].lower()}.", ""]
    motion = entry["family"] != "Sensors" and "to" not in entry["formula"].split("\\")
    lines += ["## What it adds", "", f"$$ {entry['formula']} $$", ""]
    if " r" in entry["formula"] or "w" in entry["formula"] or ",r" in entry["formula"] or "|r|" in entry["formula"]:
        lines += ["This is an acceleration: a force per unit of the moving mass. Here $r$ and $w=\\dot r$ are the displacement and the velocity across the place where it acts: "
                  "$x$ and $v$ to the ground, $x-u$ and $v-\\dot u$ to a moving base, $x_i-x_j$ and $v_i-v_j$ between two masses.", ""]
    elif motion:
        lines += ["This is an acceleration: a force per unit of the moving mass.", ""]
    lines += terms(entry)
    lines += ["## Parameters", ""]
    if entry["parameters"]:
        lines += ["| symbol | unit (displacement in metres) | range | found by |", "| --- | --- | --- | --- |"]
        for p in entry["parameters"]:
            lines.append(f"| `{p['name']}` | {p['unit'] or '–'} | {'not negative' if p['positive'] else 'either sign'} | {'a search, then refinement' if p['inner'] else 'regression, then refinement'} |")
    else:
        lines.append("Nothing is shared between records: each record has its own value.")
    lines += ["", "## What it is confused with", ""]
    confused = []
    if entry["contains"]:
        confused.append("It contains as special or limiting cases: " + ", ".join(map(link, entry["contains"])) + ". Where one of these does as well, that one is named.")
    if entry["contained_in"]:
        confused.append("It is a special or limiting case of: " + ", ".join(map(link, entry["contained_in"])) + ".")
    if entry["shifts_the_zero_as"]:
        confused.append("On a linear spring it does the same as: " + ", ".join(map(link, entry["shifts_the_zero_as"])) + ".")
    lines += ["\n\n".join(confused) or "No effect of the catalogue contains it, and it contains none. Data of one amplitude and one frequency may still not tell it from others of its family.", ""]
    lines += ["## What tells it apart", "", entry["separates"][0].upper() + entry["separates"][1:] + ".", "",
              f"Its force is drawn over: {entry['axis']}.", "",
              "## Try it", "", f"The virtual rig hides it in a plant of random frequency, damping and size: `generate hidden --effect {entry['effect']}`, as [the catalogue](index.md#try-one) shows.", ""]
    return "\n".join(lines)


def terms(entry):
    """The terms of each form, as they are written in `--terms`."""
    def code(text):
        # A table's cells end at bars, in code too.
        return "<code>" + html.escape(text).replace("|", "&#124;").replace("*", "&#42;") + "</code>"

    rows = []
    for form in entry["forms"]:
        text = ", ".join(map(code, form["terms"]))
        for state, rate in form["states"].items():
            text += f"; d{state}/dt = " + code(" ".join(f"{t['coefficient']:+g} {t['term']}" for t in rate))
        if form["replaces"]:
            text += " in place of " + ", ".join(map(code, form["replaces"]))
        example = ", ".join(f"{n} = {v:g}" for n, v in form["example"].items())
        if text:
            rows.append((form["form"] or "–", form["place"] or "–", text, example or "–"))
    if not rows:
        return ["It has no term of its own: it changes what the input does, or what the sensor shows.", ""]
    lines = ["As terms, for one mass on a moving base (the last column gives the example's values):", "", "| form | place in JSON | terms | with |", "| --- | --- | --- | --- |"]
    return lines + [f"| {' | '.join(row)} |" for row in rows] + [""]
