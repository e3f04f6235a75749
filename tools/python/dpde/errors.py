# SPDX-License-Identifier: Apache-2.0
"""What can go wrong, with the compiler's diagnostics."""
import html
import json
from typing import NamedTuple


class Message(NamedTuple):
    """One diagnostic; line and column count from 1, and are 0 if there is no place in a text."""

    code: str
    severity: str
    text: str
    file: str
    line: int
    column: int
    hint: str


class Error(Exception):
    """The base class. Its text shows source lines and carets; `messages` is the list of the same as Message."""

    def __init__(self, text, messages=()):
        super().__init__(text)
        self.messages = list(messages)

    def _repr_html_(self):
        return f"<pre>{html.escape(str(self))}</pre>"


class InputError(Error, ValueError):
    """An argument is wrong: a text, a name, a shape."""


class RunError(Error, RuntimeError):
    """The computation cannot go on."""


class NotFiniteError(RunError, ArithmeticError):
    """A value of the run is not finite."""


class MachineError(Error, RuntimeError):
    """Memory, disk, operating system."""


class Stopped(Error):
    """`progress` returned False."""


class CompilerWarning(UserWarning):
    """A warning of the compiler; `messages` is the list of the same as Message."""

    def __init__(self, text, messages=()):
        super().__init__(text)
        self.messages = list(messages)


def messages_of(text):
    return [Message(text=m.pop("message"), **m) for m in json.loads(text)]


_by_code = {1: InputError, 2: RunError, 3: MachineError, 4: NotFiniteError, 5: Stopped}  # DPDE_ERROR_* of dpde_c.h


def made(code, text, messages):
    """The exception for an error of the C interface."""
    return _by_code.get(code, MachineError)(text.rstrip("\n"), messages_of(messages))
