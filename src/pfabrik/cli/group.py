"""The group of subcommands: loads them on demand, and turns every failure into a line on stderr and an exit code."""

from __future__ import annotations

import importlib
import keyword
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any, NoReturn

import click

from ..common.telling import lines_on_pipes
from ..errors import InvalidArgument, PfabrikError, near_miss
from ..kernels import NoKernels
from .examples import EXAMPLES
from .printing import complain

WRONG_INPUT = 2
PIPE_CLOSED = 141

ENDS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals to end a command, beside the one of Ctrl-C."""


class CommandGroup(click.Group):
    """A group whose subcommand is the object of its name in a module of this folder.

    A name that is a word of Python has an underscore behind it there.
    """

    def __init__(self, *args: Any, subcommands: Mapping[str, tuple[str, str]], **kwargs: Any) -> None:
        """Make a group of subcommands: name -> its module, and what it does, the first line of its help."""
        super().__init__(*args, **kwargs)
        self.subcommands = {name: line for name, (_, line) in subcommands.items()}
        self._modules = {name: module for name, (module, _) in subcommands.items()}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the subcommands, in the order of the help."""
        return list(self.subcommands)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands without loading them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self.subcommands.items()))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Load one subcommand."""
        if cmd_name not in self.subcommands:
            return None
        name = f"{cmd_name}_" if keyword.iskeyword(cmd_name) else cmd_name
        module = importlib.import_module(f".{self._modules[cmd_name]}", __package__)
        command: click.Command = getattr(module, name)
        refuse_repeated_files(command)
        command.epilog = "\n".join(["\b", "Examples:", *(f"  pfabrik {line}" for line in EXAMPLES[cmd_name])])
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does, but an unknown subcommand comes with the nearest known one."""
        if args and args[0] not in self.subcommands and not args[0].startswith("-"):
            hint = near_miss(args[0], self.subcommands) or f" (known: {', '.join(self.subcommands)})"
            ctx.fail(f"no command '{args[0]}'{hint}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """As click does, but errors in the options of a subcommand name it, and errors in arguments the option."""
        try:
            return super().invoke(ctx)
        except click.UsageError as error:
            error.ctx = error.ctx or self._invoked(ctx)
            raise
        except InvalidArgument as error:
            called = self._invoked(ctx)
            options = [each for each in called.command.params if isinstance(each, click.Option)]
            named = {name: each.opts[0] for each in options for name in (each.name, each.opts[0][2:].replace("-", "_"))}
            name, _, key = error.argument.partition("['")
            if name not in named or name == "path":  # of whichever option: the name says it
                raise
            words, place = str(error).removeprefix(error.argument), f" {key.removesuffix(chr(39) + ']')}" if key else ""
            raise click.UsageError(f"{named[name]}{place}{words}", called) from error

    def _invoked(self, ctx: click.Context) -> click.Context:
        """The context of the subcommand that ran, or the group's own if there is none."""
        command = self.get_command(ctx, ctx.invoked_subcommand or "")
        return ctx if command is None else click.Context(command, parent=ctx, info_name=command.name)

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> Any:
        """Run a command line; in standalone mode, exit with the code that the subcommand returned."""
        run = partial(super().main, args, prog_name or "pfabrik", complete_var, standalone_mode=False, **extra)
        with lines_on_pipes():
            if not standalone_mode:
                return run()
            take_closed_places()
            return leave(exit_code(run))


def refuse_repeated_files(command: click.Command) -> None:
    """Refuse an option of one file that is given twice: the last would be taken, and the others dropped in silence."""
    parse = command.parse_args

    def parse_args(context: click.Context, args: list[str]) -> list[str]:
        parser = command.make_parser(context)
        parser.ignore_unknown_options, given = True, parser.parse_args(args=[*args])[2]
        for each in {each.name: each for each in given if isinstance(each.type, click.Path)}.values():
            count = sum(other is each for other in given)
            if isinstance(each, click.Option) and not each.multiple and count > 1:
                raise click.UsageError(f"{each.opts[0]}: found it {count} times; expected one file", context)
        return parse(context, args)

    command.parse_args = parse_args  # type: ignore[assignment,method-assign]


def take_closed_places() -> None:
    """Open the null device in place of standard streams that are closed, lest an output file takes their numbers.

    Reading standard input and writing standard output then fail as they should; text on stderr is dropped.
    """
    for name, mode, flags in (("stdin", "r", os.O_WRONLY), ("stdout", "w", os.O_RDONLY), ("stderr", "w", os.O_WRONLY)):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, flags), mode, encoding="utf-8"))


def exit_code(run: Callable[[], Any]) -> int:
    """Run a command: the integer it returns, or the code of its failure, which is reported on stderr."""
    try:
        with plain_warnings(), signals_interrupt():
            result = run()
        return result if isinstance(result, int) else 0
    except click.UsageError as error:
        place = error.ctx.command_path if error.ctx else "pfabrik"
        examples = EXAMPLES.get(place.rpartition(" ")[2], ())
        example = f"for example: pfabrik {examples[0]}; " if examples else ""
        complain(f"{error.format_message().rstrip('.')} ({example}see '{place} --help')")
    except click.ClickException as error:
        complain(error.format_message())
    except (PfabrikError, NoKernels) as error:
        complain(str(error))
    except SystemExit:  # click leaves this way when the reader of a pipe has gone
        return PIPE_CLOSED
    except (KeyboardInterrupt, click.Abort) as error:
        number = next((each for each in (error.__cause__ or error).args if each in ENDS), signal.SIGINT)
        complain("interrupted" if number == signal.SIGINT else "terminated")
        return 128 + int(number)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        complain(f"{where}{error.strerror or error}")
    return WRONG_INPUT


@contextmanager
def plain_warnings() -> Iterator[None]:
    """Show warnings as one line for people, without the place in the code that raised them."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        complain(f"warning: {message}")

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Let other signals to end interrupt as Ctrl-C does: what is half written is removed. Ignored ones stay ignored."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt(number)

    is_main = threading.current_thread() is threading.main_thread()  # others can have no handlers
    before = {number: signal.getsignal(number) for number in ENDS if is_main}
    heard = [number for number, handler in before.items() if handler != signal.SIG_IGN]
    try:
        for number in heard:
            signal.signal(number, interrupt)
        yield
    finally:
        for number in heard:
            signal.signal(number, before[number])


def leave(code: int) -> NoReturn:
    """Exit; text that stdout can no longer take (a full disk, say) was reported before and is dropped."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
