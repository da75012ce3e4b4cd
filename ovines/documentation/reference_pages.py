"""docs/reference from the code: ``python -m ovines.documentation.reference_pages`` writes its pages."""

from __future__ import annotations

import argparse
from pathlib import Path

import ovines
from ovines.core.effects import EFFECTS
from ovines.documentation.schema_pages import board_page, law_page, recording_page, scenario_page
from ovines.io.atomic_write import write_text_whole

FOLDER = Path(ovines.__file__).resolve().parent.parent / "docs" / "reference"
MADE = "Made by `python -m ovines.documentation.reference_pages` from the code; a test compares."


def commands_page() -> str:
    """Every command with its arguments."""
    from ovines.__main__ import command, command_names

    lines = ["# Commands", "", MADE, "", "Exit status: 0 done, 2 the input or the command line is wrong, 1 our bug."]
    lines += [
        "",
        "Every command takes `--quiet` (print errors only, no progress bars) and `--verbose` (also print what is read "
        "and decided, and how long it takes). `ovines.log` beside the results has the same.",
        "",
        'Tab completes commands, options, files after `eval "$(ovines --completion bash)"` in `~/.bashrc` (`zsh` and '
        "`tcsh` serve too).",
    ]
    for name in command_names():
        module = command(name)
        parser = argparse.ArgumentParser(prog=f"ovines {name}")
        module.add_arguments(parser)
        lines += ["", f"## ovines {name}", "", module.HELP[:1].upper() + module.HELP[1:].rstrip(".") + "."]
        lines += _arguments(parser, f"ovines {name}")
    return "\n".join(lines) + "\n"


def _arguments(parser: argparse.ArgumentParser, prog: str) -> list[str]:
    lines, rows = [], []
    for action in parser._actions:  # argparse has no public way to ask
        if isinstance(action, argparse._SubParsersAction):
            for name, inner in action.choices.items():
                lines += ["", f"### {prog} {name}", *_arguments(inner, f"{prog} {name}")]
        elif action.help != argparse.SUPPRESS and "--help" not in action.option_strings:
            metavar = action.metavar or ("" if action.nargs == 0 else action.dest.upper())
            value = " ".join(metavar) if isinstance(metavar, tuple) else str(metavar)
            shown = " ".join(part for part in (", ".join(action.option_strings), value) if part)
            rows.append(f"| `{shown}` | {(action.help or '').replace('|', '/').replace('%%', '%')} |")
    if rows:
        lines = ["", "| argument | meaning |", "|---|---|", *rows, *lines]
    return lines


def effects_page() -> str:
    """Every effect with its physics and parameters, by stage."""
    lines = ["# Effects", "", MADE, ""]
    lines += [
        "An effect is something that an experiment may have and a simulator may lack. Add it to a "
        "scenario under `[effects]`, to the nominal model under `[model] effects`. Which size the diagnosis calls "
        "negligible on your rig, `detectable` in `diagnosis.json` says.",
    ]
    stages = list(dict.fromkeys(effect.stage for effect in EFFECTS.values()))
    for stage in stages:
        lines += ["", f"## {stage.capitalize()}"]
        for effect in EFFECTS.values():
            if effect.stage != stage:
                continue
            lines += ["", f"### {effect.name}", "", " ".join(effect.meaning.split())]
            if effect.parameters:
                lines += [
                    "",
                    "| parameter | unit | bounds | default |",
                    "|---|---|---|---|",
                ]
            for one in effect.parameters:
                default = "must be given" if one.default is None else f"{one.default:g}"
                lines.append(f"| `{one.name}` | {one.unit} | {one.low:g} ... {one.high:g} | {default} |")
    return "\n".join(lines) + "\n"


PAGES = {
    "commands.md": commands_page,
    "effects.md": effects_page,
    "recording-toml.md": recording_page,
    "scenario-toml.md": scenario_page,
    "law-toml.md": law_page,
    "board-toml.md": board_page,
}

if __name__ == "__main__":
    for name, page in PAGES.items():
        write_text_whole(page(), FOLDER / name)
