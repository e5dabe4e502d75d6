"""Runs the notebooks while the documentation is built, and makes a page of each with all that its cells show.

A notebook is kept without outputs, so that nothing in it can be out of date. A cell that fails stops the build.
"""

import base64
import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import nbformat
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode

#: seconds that a cell may take
PATIENCE = 120
READINGS = Path(__file__).parents[1] / "readings"
ANSI = re.compile(r"\x1b\[[0-9;]*m")
DOWNLOAD = '[Download this notebook]({file}){{ .md-button download="{file}" }}\n\n'


@cache
def executed(text: str) -> NotebookNode:
    """A notebook with the outputs of its cells, run in a folder of its own beside the readings that pages link to."""
    notebook = nbformat.reads(text, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(READINGS, folder, dirs_exist_ok=True)
        folders = {"metadata": {"path": folder}}
        client = NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", resources=folders)
        try:
            # The kernel warns there of things that concern kernels on other machines.
            found = client.execute(stderr=subprocess.DEVNULL)
        except CellExecutionError as error:
            raise PluginError(ANSI.sub("", str(error))) from None
    for cell in found.cells:
        if cell.cell_type == "code":
            # Long work leaves an empty line where it told how far it was: on a slow machine only.
            cell.outputs = [one for one in cell.outputs if one.get("data") != {"text/plain": ""}]
    return found


def shown(output: NotebookNode, pictures: list[bytes], name: str) -> str:
    """What an output shows, as Markdown: the richest form that it has."""
    if output.output_type == "stream":
        return f"```text\n{output.text.rstrip()}\n```"
    if "text/html" in output.data:
        # Blank lines would end a block of HTML.
        return re.sub(r"\n\s*\n", "\n", output.data["text/html"])
    if "image/png" in output.data:
        pictures.append(base64.b64decode(output.data["image/png"]))
        return f"![Figure of the cell above]({name}-{len(pictures)}.png)"
    return f"```text\n{output.data['text/plain']}\n```"


def page(notebook: NotebookNode, name: str) -> tuple[str, list[bytes]]:
    """The Markdown of an executed notebook, and its figures, which are beside the page as ``NAME-1.png`` and so on."""
    parts, pictures = [], list[bytes]()
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        outputs = [shown(output, pictures, name) for output in cell.outputs]
        parts += [f'<div class="output" markdown="block">\n\n{output}\n\n</div>' for output in outputs]
    return "\n\n".join(parts), pictures


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for every notebook."""
    for source in [file for file in files if file.src_uri.endswith(".ipynb")]:
        name = Path(source.src_uri).stem
        markdown, pictures = page(executed(source.content_string), name)
        heading, _, rest = markdown.partition("\n\n")
        text = f"{heading}\n\n{DOWNLOAD.format(file=source.src_uri)}{rest}"
        files.append(File.generated(config, f"{name}.md", content=text))
        for number, content in enumerate(pictures, 1):
            files.append(File.generated(config, f"{name}-{number}.png", content=content))
    return files
