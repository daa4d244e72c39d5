"""Put the arguments and options of a command, as the program has them, below its page."""

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

from rig.cli import COMMANDS, application

FOLDER = "commands/"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Append the table to the page of a command."""
    name = page.file.src_uri.removeprefix(FOLDER).removesuffix(".md")
    if not page.file.src_uri.startswith(FOLDER) or name not in COMMANDS:
        return markdown
    command = typer.main.get_command(application([name])).commands[name]
    parts = getattr(command, "commands", {"All options": command})
    tables = [_table(title, part.params) for title, part in parts.items()]
    return "\n\n".join([markdown.rstrip(), *tables]) + "\n"


def _table(title: str, parameters) -> str:
    lines = ["| option | what it does | if left out |", "|---|---|---|"]
    for parameter in parameters:
        words = ", ".join(f"`{word}`" for word in parameter.opts)
        text = (getattr(parameter, "help", None) or "").replace("|", "\\|").replace("\n", " ")
        lines.append(f"| {words} | {text} | {_default(parameter)} |")
    return "\n".join([f"## {title}", "", *lines])


def _default(parameter) -> str:
    given = parameter.default
    return "" if given in (None, False) or callable(given) else f"`{given}`"
