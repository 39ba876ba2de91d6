"""Options of the command line: one name for one thing in all commands."""

from __future__ import annotations

from collections import defaultdict

from typer.main import get_command

from tolalloc.cli.main import app

COMMANDS = get_command(app).commands
MEANT = {
    "--out": {
        "Run folder, new or empty; the next one of runs/NAME, runs/NAME-2, … unless given.",
        "Write a report into this folder, new or empty.",
        "Folder for all run folders; finished runs in it are not repeated.",
        "Folder to write, new or empty.",
    },
    "--seed": {"Seed of every random number, instead of the study's.", "Seed of every random number."},
    "--torque": {
        "Torque on the carrier [N·m], negative where it resists the rotation; the reducer's test torque unless given.",
        "Torque on the carrier [N·m], negative where it resists the rotation; minus the rated one unless given.",
    },
    "--write": {
        "New reducer file to write, with these amounts.",
        "New tolerance table to write, with Cp and shift of the lot.",
        "New stiffness file to write, for --stiffness elsewhere.",
    },
}
"""Option → what its helps say, where they differ in what holds unless given or in what is written."""


def options() -> dict[str, dict[str, object]]:
    """Return option → command → its parameter."""
    found: dict[str, dict[str, object]] = defaultdict(dict)
    for name, command in COMMANDS.items():
        for own in command.params:
            if own.param_type_name == "option":
                for option in own.opts:
                    found[option][name] = own
    return found


def test_an_option_means_one_thing_in_all_commands():
    said = {option: {parameter.help for parameter in own.values()} for option, own in options().items()}
    assert all(all(helps) for helps in said.values())
    different = {option: helps for option, helps in said.items() if len(helps) > 1}
    assert different == MEANT


def test_an_option_takes_one_kind_of_value_in_all_commands():
    kinds = {
        option: {str(own.type_descriptor.annotation).replace(" | None", "") for own in parameters.values()}
        for option, parameters in options().items()
    }
    assert not {option: found for option, found in kinds.items() if len(found) > 1}


def test_one_thing_has_one_option():
    """A help stands under one name alone."""
    named = defaultdict(set)
    for option, own in options().items():
        for parameter in own.values():
            named[parameter.help].add(option)
    assert not {said: names for said, names in named.items() if len(names) > 1}


def test_every_command_and_every_word_of_it_says_what_it_is():
    for name, command in COMMANDS.items():
        assert command.help.rstrip().endswith("."), name
        assert command.epilog.startswith("Example: `tolalloc "), name
        assert not [own.name for own in command.params if not own.help], name
