# SPDX-License-Identifier: MIT
"""The command `rockdda-post completion`: scripts that complete its commands, options and field names in a shell."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer
from typer import Argument
from typer.completion import get_completion_script


class Shell(StrEnum):
    """Shells with a script."""

    bash = "bash"
    zsh = "zsh"
    fish = "fish"


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="completion")(completion_command)


def completion_command(shell: Annotated[Shell, Argument(metavar="bash|zsh|fish", help="The shell.")]) -> None:
    """Print a script that completes commands, options and field names.

    Examples:

        eval "$(rockdda-post completion bash)"

        rockdda-post completion fish | source
    """
    script = get_completion_script(
        prog_name="rockdda-post", complete_var="_ROCKDDA_POST_COMPLETE", shell=shell.value
    ).strip()
    if shell is Shell.zsh:  # evaluated, not found in a folder of functions
        script = f"autoload -U +X compinit && compinit\n{script}"
    typer.echo(script)
