"""Options of values by name, completed to the names that MECH has, and options that are one argument of a command."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import click
from click.shell_completion import CompletionItem

import pfabrik as pf

STANDARD_INPUT = "-"

Names: TypeAlias = "Callable[[pf.Mechanism], Iterable[str]]"
Decorator: TypeAlias = Callable[[Callable[..., Any]], Callable[..., Any]]


def completing(
    names_of: Names, ending: str = ""
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """A completion to names that the machine MECH has, each after the last comma and before an ending."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        many = next((each.nargs for each in ctx.command.params if each.name == "mech"), 1) < 0
        given = ctx.params.get("mech") or ctx.args[: None if many else 1]  # left over where the option has no value yet
        machines = [given] if isinstance(given, str) else given
        done, comma, begun = incomplete.rpartition(",")
        try:
            known = [names_of(pf.load(each)) for each in machines if each != STANDARD_INPUT]
        except (pf.errors.PfabrikError, OSError):  # a file that is not finished has no names yet
            return []
        names = dict.fromkeys(name for each in known for name in each)
        fitting = [name for name in names if name.startswith(begun) and name not in done.split(",")]
        return [CompletionItem(f"{done}{comma}{name}{ending}") for name in fitting]

    return complete


def actuators(mechanism: pf.Mechanism) -> tuple[str, ...]:
    """Names of the actuators."""
    return mechanism.actuator_names


def joints(mechanism: pf.Mechanism) -> list[str]:
    """Names of all joints."""
    return [joint.name for joint in mechanism.joints]


def series(mechanism: pf.Mechanism) -> tuple[str, ...]:
    """Names of the passive joints in series from base to end effector."""
    from ..kinematics import passive_series

    return passive_series(mechanism)


def named_values(
    option: str, parameter: str, names_of: Names, help: str, metavar: str = "[NAME=]VALUE", **settings: Any
) -> Decorator:
    """An option of values by names that the machine MECH has, which may be repeated; the command gets their texts."""
    settings |= {"multiple": True, "metavar": metavar, "help": help}
    return click.option(option, parameter, shell_complete=completing(names_of, "="), **settings)


def joints_option(help: str) -> Decorator:
    """The option ``--joints``, of joints in series, for `named_joints`."""
    complete = completing(series)
    return click.option("--joints", metavar="NAME[,NAME]...", multiple=True, shell_complete=complete, help=help)


def together(argument: str, make: Callable[..., object], *options: Decorator) -> Decorator:
    """Adds options to a command, which gets what is made of them as one argument.

    Parameters
    ----------
    make : takes the values of options by their names; those of others go to the command as they are.
    """
    names = inspect.signature(make).parameters

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def with_argument(**given: Any) -> Any:
            made = make(**{name: given.pop(name) for name in names if name in given})
            return command(**{argument: made}, **given)

        with_options: Callable[..., Any] = with_argument
        for option in reversed(options):
            with_options = option(with_options)
        return with_options

    return decorate
