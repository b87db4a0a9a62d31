"""The notebooks of docs/notebooks: scripts whose cells are run as the book is built, and shown with what they give.

A cell begins with `# %%`, one of text with `# %% [markdown]`; an editor that knows such cells runs them one by one. Nothing that comes out
of them is kept in the repository. A cell that fails ends the build. They run in the Python that the environment's
SINDYSCOPE_PYTHON names, in which the package `sindyscope` is installed; each has a kernel and a folder of its own, with `sample_data` in it.
Beside each page lies the notebook with its outputs, to be taken along.
"""

import base64
import html
import json
import os
import shutil
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jupytext
import nbformat
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, DeadKernelError

FOLDER = "notebooks"
KERNEL = "sindyscope-book"
SECONDS = 300  # of one cell, by a package that is not optimised, beside a build


def on_files(files, config):
    root = Path(config["config_file_path"]).parent
    scripts = sorted((Path(config["docs_dir"]) / FOLDER).glob("*.py"))
    scratch = Path(tempfile.mkdtemp(prefix="sindyscope-notebooks-"))
    try:
        know_kernel(scratch)

        def run(script):
            folder = scratch / script.stem
            folder.mkdir()
            (folder / "sample_data").symlink_to(root / "sample_data")
            return executed(script, folder)

        # One a core: what is measured in a notebook is little disturbed by the next.
        with ThreadPoolExecutor(os.cpu_count() or 1) as together:
            for script, notebook in zip(scripts, together.map(run, scripts)):
                add(files, config, script.stem, notebook)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return files


def know_kernel(scratch):
    """Makes the Python that has the package known to Jupyter, by a file in a folder of its own."""
    python = os.environ.get("SINDYSCOPE_PYTHON", "")
    if not (python and os.access(python, os.X_OK)):
        raise PluginError("the environment variable SINDYSCOPE_PYTHON must name the Python that has the package: .ci/book does so")
    folder = scratch / "kernels" / KERNEL
    folder.mkdir(parents=True)
    # Not resolved: the link is what tells Python of its environment.
    argv = [os.path.abspath(python), "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    kernel = {"argv": argv, "display_name": "Python", "language": "python"}
    (folder / "kernel.json").write_text(json.dumps(kernel), "utf-8")
    os.environ["JUPYTER_PATH"] = str(scratch)
    os.environ["MPLCONFIGDIR"] = str(scratch / "matplotlib")


def executed(script, folder):
    """The notebook of a script, with what its cells give."""
    notebook = jupytext.read(script)
    # The debugger's word of warning is none for the book.
    client = NotebookClient(notebook, timeout=SECONDS, kernel_name=KERNEL, resources={"metadata": {"path": str(folder)}})
    try:
        client.execute()
    except (CellExecutionError, DeadKernelError, TimeoutError) as error:
        raise PluginError(f"{FOLDER}/{script.name}: {error}") from error
    for cell in notebook.cells:
        # When it ran says nothing to a reader.
        cell.metadata.pop("execution", None)
    return notebook


def add(files, config, name, notebook):
    """The page of a notebook, its pictures, and the notebook itself."""
    pictures = []
    parts = []
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
        elif cell.cell_type == "code" and cell.source.strip():
            parts.append(f"```python\n{cell.source.strip()}\n```")
            parts += [shown(output, name, pictures) for output in cell.outputs]
    parts.append(f"[This notebook, with what came out]({name}.ipynb), for Jupyter.")
    files.append(File.generated(config, f"{FOLDER}/{name}.md", content="\n\n".join(filter(None, parts)) + "\n"))
    files.append(File.generated(config, f"{FOLDER}/{name}.ipynb", content=nbformat.writes(notebook)))
    for file, content in pictures:
        files.append(File.generated(config, f"{FOLDER}/{file}", content=content))


def shown(output, name, pictures):
    """What a cell gives, for a page."""
    if output.output_type == "stream":
        return "" if output.name == "stderr" else block(output.text)
    data = output.get("data", {})
    if "text/html" in data:
        return f'<div class="output">{table(data["text/html"])}</div>'
    for kind, ending in (("image/svg+xml", "svg"), ("image/png", "png")):
        if kind in data:
            file = f"{name}-{len(pictures) + 1}.{ending}"
            pictures.append((file, data[kind] if ending == "svg" else base64.b64decode(data[kind])))
            return f"![What the cell draws]({file})"
    if "text/latex" in data:
        return data["text/latex"]
    return block(data.get("text/plain", ""))


def table(text):
    """HTML of an output in one block, which an empty line would end; tables look as those of the book, not as a frame's style says."""
    before, style, rest = text.partition('<style type="text/css">')
    if style:
        text = before + rest.partition("</style>")[2]
    return "\n".join(line for line in text.splitlines() if line.strip())


def block(text):
    return f'<pre class="output">{html.escape(text.rstrip())}</pre>' if text.strip() else ""
