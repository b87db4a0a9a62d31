"""Every command that the book shows is run as the book is built, and its pictures are those that the commands make.

A fenced block `console` holds commands, each behind `$ ` and as long as until the next. Each page has a
folder of its own, `sample_data` in it, where its commands run one after the other; one that fails ends the build. With
`output` after `console` what the commands print stands in the page, with `output=12` its first twelve lines. Pictures that
the commands leave in the folder belong to the page, and so do the figures of an HTML report: `report.html` gives
`report-1.svg`, `report-2.svg`, … The program is the one that the environment's SINDYSCOPE names.
"""

import logging
import os
import re
import shutil
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

BLOCK = re.compile(r"^```console(?P<options>[^\n]*)\n(?P<body>.*?)^```\s*$", re.MULTILINE | re.DOTALL)
SHOWN = re.compile(r"\boutput(?:=(\d+))?")
SVG = re.compile(r"<svg\b.*?</svg>", re.DOTALL)
SECONDS = 300  # a search by a program that is not optimised, beside a build

log = logging.getLogger("mkdocs.hooks.program")
pages = {}


def program():
    path = os.environ.get("SINDYSCOPE", "")
    if not (path and os.access(path, os.X_OK)):
        raise PluginError("the environment variable SINDYSCOPE must name the program that the book's commands run: .ci/book BINARY")
    return Path(path).resolve()


def commands(body):
    """The commands of a block, each whole: one goes on until the next `$ `."""
    found = []
    for line in body.splitlines():
        if line.startswith("$ "):
            found.append(line[2:])
        elif found:
            found[-1] += "\n" + line
        else:
            raise ValueError(f"a console block begins with `$ ` and a command, not with {line!r}")
    return found


def run(source, folder, environment):
    """Runs a page's commands; gives what each block printed."""
    printed = []
    for block in BLOCK.finditer(source):
        texts = []
        for command in commands(block["body"]):
            began = time.monotonic()
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, env=environment, capture_output=True,
                                  text=True, timeout=SECONDS)
            if done.returncode != 0:
                raise ValueError(f"`{command}` ended with status {done.returncode}:\n{done.stderr.strip() or done.stdout.strip()}")
            log.debug("%.1f s: %s", time.monotonic() - began, command)
            texts.append((command, done.stdout))
        printed.append(texts)
    return printed


def shown(block, texts):
    """A block as the page shows it."""
    wanted = SHOWN.search(block["options"])
    lines = []
    for command, text in texts:
        lines.append("$ " + command)
        if wanted:
            of_it = text.rstrip("\n").split("\n") if text.strip() else []
            most = int(wanted[1] or 0) or len(of_it)
            lines += of_it[:most] + (["…"] if len(of_it) > most else [])
    return "```console\n" + "\n".join(lines) + "\n```"


def pictures(folder):
    """The page's pictures; the figures of HTML reports are written beside them."""
    for page in folder.glob("*.html"):
        text = page.read_text("utf-8")
        # The rules that the figures need stand in front; those of the page, which may turn colours round, behind.
        style = text.partition("<style>")[2].partition(":root { color-scheme")[0]
        for k, figure in enumerate(SVG.findall(text), 1):
            opening = '<svg xmlns="http://www.w3.org/2000/svg" style="background:#fff" '
            alone = figure.replace("<svg ", opening, 1).replace(">", f"><style>{style} text {{ font-family: sans-serif }}</style>", 1)
            (folder / f"{page.stem}-{k}.svg").write_text(alone, "utf-8")
    return sorted(p for p in folder.iterdir() if p.suffix in (".png", ".svg"))


def on_files(files, config):
    binary = program()
    root = Path(config["config_file_path"]).parent
    scratch = Path(tempfile.mkdtemp(prefix="sindyscope-book-"))
    config["book_scratch"] = scratch
    tools = scratch / ".bin"
    tools.mkdir()
    (tools / "sindyscope").symlink_to(binary)
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["PATH"] = f"{tools}{os.pathsep}{environment.get('PATH', '')}"

    def page(file):
        source = file.content_string
        if "```console" not in source:
            return None
        folder = scratch / Path(file.src_uri).with_suffix("")
        folder.mkdir(parents=True)
        (folder / "sample_data").symlink_to(root / "sample_data")
        (folder / "examples").symlink_to(root / "examples")
        try:
            return file, run(source, folder, environment), pictures(folder)
        except (ValueError, subprocess.TimeoutExpired) as error:
            raise PluginError(f"{file.src_uri}: {error}") from error

    with ThreadPoolExecutor(os.cpu_count() or 1) as together:
        for found in together.map(page, list(files.documentation_pages())):
            if found is None:
                continue
            file, printed, made = found
            pages[file.src_uri] = printed
            for picture in made:
                beside = (Path(file.src_uri).parent / picture.name).as_posix()
                if files.get_file_from_path(beside) is not None:
                    raise PluginError(f"{file.src_uri}: another page of its folder makes a picture named {picture.name} too")
                if picture.name in file.content_string:
                    files.append(File.generated(config, beside, abs_src_path=str(picture)))
    # The window's own pictures are made with the window, that of the odds by a study, that of a notebook of this book.
    names = ("window.png", "map.png", "missing.png", "rig.png", "report.png", "stream.png", "series.png", "web.png", "web-dark.png", "structure-stabilization.png", "structure-stabilization-dark.png", "structure-responses.png", "structure-shapes.png", "structure-shapes-dark.png", "notebook.png", "odds.svg")
    for name in names:
        files.append(File.generated(config, f"pictures/{name}", abs_src_path=str(root / "assets" / name)))
    return files


def on_page_markdown(markdown, page, config, files):
    printed = iter(pages.get(page.file.src_uri, []))
    return BLOCK.sub(lambda block: shown(block, next(printed)), markdown)


def on_post_build(config):
    shutil.rmtree(config["book_scratch"], ignore_errors=True)
