# SPDX-License-Identifier: Apache-2.0
"""dpde: differentiable simulations, compiled.

    model = dpde.compile("heat.dpde")                  # or the text itself
    scene = model.scene("rod", cells=256)
    result = scene.run(u=u0, kappa=0.05)               # NumPy arrays in and out, x the last axis
    loss, slopes = model.scene("recover").gradient(kappa=0.05)

dpde.torch and dpde.jax make a scene an operator of these libraries.
"""
import os
import warnings

from . import _core
from .errors import (CompilerWarning, Error, InputError, MachineError, Message, NotFiniteError, RunError, Stopped,
                     messages_of)
from .scene import Optimised, Progress, Result, Scene

__all__ = ["CompilerWarning", "Error", "InputError", "MachineError", "Message", "Model", "NotFiniteError", "Optimised",
           "Progress", "Result", "RunError", "Scene", "Stopped", "compile"]

_backends = {"jit": 0, "cpp": 1, "interpreter": 2}


class Model:
    """A checked .dpde text; scene() compiles one of its scenes or tasks.

    `scenes` and `tasks` are the lists of their names.
    """

    def __init__(self, core):
        self._core = core
        self.scenes = core.scenes()
        self.tasks = core.tasks()

    def scene(self, name="", *, settings=None, scheme="", inputs=(), backend="jit", threads=1, slots=0, force=False,
              certify=None, second_order=False, checkpoint_bytes=None, **more):
        """Compiles a scene or a task to machine code and returns a Scene.

        - `name`: the scene or the task. It may be left out if there is just one.
        - `settings`: the settings of `--set`, {"cells.x": 64, "time": "rk4"}. Names without a dot may be keywords.
        - `scheme`: a scheme block of the text that replaces the scene's.
        - `inputs`: of a scene, the initial states, parameters, coefficients, controls and networks by which vjp()
          differentiates its end.
        - `backend`: "jit", "cpp" (the system's C++ compiler) or "interpreter".
        - `threads`: the number of threads of this scene.
        - `checkpoint_bytes`, `slots`: the memory, or the number, of stored states of a gradient.
        - `force`: True runs a scene whose step is unstable.
        - `certify`: True or False, whether the derivatives are checked first; None: if that is cheap.
        - `second_order`: True for hessian_vector().

        Raises InputError for a name, a setting or a text that is wrong. The compiler's warnings are a CompilerWarning.
        """
        if not isinstance(name, str):
            raise TypeError(f"the name of a scene or a task is wanted, not {type(name).__name__}")
        if backend not in _backends:
            raise InputError(f"there is no back end {backend}; there is {', '.join(_backends)}")
        chosen = _core.Settings()
        chosen.name, chosen.scheme, chosen.backend = name, scheme, _backends[backend]
        chosen.inputs = [inputs] if isinstance(inputs, str) else list(inputs)
        chosen.set = {key: _text(value) for key, value in {**(settings or {}), **more}.items()}
        chosen.threads, chosen.slots, chosen.force, chosen.certify = threads, slots, force, certify
        chosen.second_order, chosen.checkpoint_bytes = second_order, checkpoint_bytes
        opened = _core.Sim(self._core, chosen)
        text, messages = opened.warnings()
        if text:
            warnings.warn(CompilerWarning(text.rstrip("\n"), messages_of(messages)), stacklevel=2)
        return Scene(opened, name or (self.scenes if chosen.inputs else self.tasks or self.scenes)[0])

    def __repr__(self):
        return f"dpde.Model(scenes={self.scenes}, tasks={self.tasks})"


def _text(value):
    if isinstance(value, float):
        return repr(value)  # all its digits
    return str(value)


def compile(text_or_path, path="text.dpde"):
    """Reads and checks a text (a string with a line break or a brace) or the file at a path, and returns a Model.

    `path` names a text in messages; files that it loads are searched in its folder. Raises InputError for mistakes in
    the text and for a file that cannot be read.
    """
    if not isinstance(text_or_path, (str, os.PathLike)):
        raise TypeError(f"a text or a path is wanted, not {type(text_or_path).__name__}")
    if "\0" in str(text_or_path):
        raise InputError("there is a NUL character in the text or path")
    if isinstance(text_or_path, str) and any(c in text_or_path for c in "\n{"):
        return Model(_core.Model.from_text(text_or_path, path))
    return Model(_core.Model.from_file(os.fspath(text_or_path)))
