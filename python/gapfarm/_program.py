"""The program gapfarm: found, run, and its errors as exceptions."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from typing import Any, Callable, Optional, Sequence, Union

Progress = Callable[[str], None]


class GapfarmError(Exception):
    """What gapfarm could not do, in its own words.  ``exit_code``: docs/commands.md."""

    def __init__(self, message: str, exit_code: int):
        super().__init__(message)
        self.exit_code = exit_code

    def __reduce__(self) -> "tuple[type, tuple[str, int]]":  # also from other processes
        return (GapfarmError, (self.args[0], self.exit_code))


def _program() -> str:
    named = os.environ.get("GAPFARM", "")
    found = named or shutil.which("gapfarm")
    if not found:
        raise GapfarmError("gapfarm is not on the PATH; install it or name it in GAPFARM", 2)
    return found


def files(option: str, named: "Union[str, os.PathLike[str], Sequence[Union[str, os.PathLike[str]]]]") -> "list[str]":
    """The option with its files, of which one may stand alone; nothing where there are none."""
    several = [named] if isinstance(named, (str, os.PathLike)) else named
    return [option, *(os.fspath(file) for file in several)] if several else []


def command(words: Sequence[str], progress: Optional[Progress] = None) -> Any:
    """Runs ``gapfarm WORDS --json`` and returns its result as Python values.

    ``progress`` is called with every line of notes and progress as it comes.  Raises GapfarmError
    with what gapfarm printed and its exit code; exit code 3 (done, but tasks were given up) is no error.
    """
    program = _program()
    try:
        process = subprocess.Popen(
            [program, *map(str, words), "--json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            text=True,
            errors="replace",
        )
    except OSError as failed:
        raise GapfarmError(f"{program}: {failed.strerror}; name the program in GAPFARM", 2) from None
    # Results are small enough for the pipe only sometimes, so both are read at once.
    import threading

    printed: list[str] = []

    def listen() -> None:
        assert process.stderr is not None
        for line in process.stderr:
            printed.append(line.rstrip("\n"))
            if progress is not None:
                progress(printed[-1])

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    assert process.stdout is not None
    try:
        output = process.stdout.read()
        exit_code = process.wait()
    except BaseException:
        process.terminate()
        process.wait()
        raise
    finally:
        listener.join()
    try:
        result = json.loads(output) if output.strip() else {}
    except json.JSONDecodeError:
        raise GapfarmError("\n".join(printed) or output, exit_code or 1) from None
    if exit_code not in (0, 3):
        error = result.get("error", {}) if isinstance(result, dict) else {}
        printed_error = error.get("message", "\n".join(printed[-3:]))
        raise GapfarmError(printed_error or f"{program} ended with {exit_code}", exit_code)
    return result


def version() -> str:
    """Of the program: "gapfarm 0.1.0 (build ...)"."""
    return subprocess.run(
        [_program(), "--version"], check=True, capture_output=True, text=True
    ).stdout.strip()
