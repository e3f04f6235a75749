# SPDX-License-Identifier: Apache-2.0
"""A compiled scene or task: values in, runs, losses and derivatives out."""
import collections
import contextlib
import difflib
import os
import threading
import warnings
from typing import NamedTuple

import numpy as np

from . import _core
from .arrays import as_array, shaped
from .errors import CompilerWarning, InputError, Message
from .pictures import picture


class Progress(NamedTuple):
    """The argument of `progress`.

    `done` of `total` steps of a run or a gradient, or updates of an optimiser (`total` is 0); `time` of the present
    state; `loss` and `gradient_norm` of an optimiser, else 0.
    """

    done: int
    total: int
    time: float
    loss: float
    gradient_norm: float


class Optimised(NamedTuple):
    """The result of optimise(): the loss at the values found, counts, and the reason for the stop in words."""

    loss: float
    iterations: int
    evaluations: int
    hessian_products: int
    reason: str


class Result:
    """The states at the end of a run: result.u, result["v.x"].

    A state is an array of the scene's shape. A vector v has all components, along the first axis. `states` is the
    dictionary of all states, `time` the time and `steps` the number of steps.
    """

    def __init__(self, states, time, steps):
        self.states, self.time, self.steps = states, time, steps

    def __getitem__(self, name):
        if name in self.states:
            return self.states[name]
        parts = [values for state, values in self.states.items() if state.startswith(name + ".")]
        if not parts:
            raise KeyError(f"there is no state {name}; there is {', '.join(self.states)}")
        return np.stack(parts)

    def __getattr__(self, name):
        if name.startswith("_") or name == "states":
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as reason:
            raise AttributeError(*reason.args) from None

    def __repr__(self):
        shapes = ", ".join(f"{name} {values.shape}" for name, values in self.states.items())
        return f"dpde.Result(t = {self.time:g} after {self.steps} steps: {shapes})"

    def _repr_html_(self):
        return "".join(picture(name, values) for name, values in self.states.items()) + f"<p>t = {self.time:g}</p>"


def _called(progress, every=1):
    """False, NumPy's too, stops a call."""
    if every < 1:
        raise ValueError(f"every: a number of steps from 1 on is wanted, not {every}")
    if progress is None:
        return None
    return lambda *numbers: not _is_false(progress(Progress(*numbers)))


def _is_false(answer):
    return isinstance(answer, (bool, np.bool_)) and not answer


class Scene:
    """A compiled scene or task, made by Model.scene(). One thread at a time may use it; threads that share
    it hold `lock`.

    Lists of names: `params`, `states`, `outputs` (those with a formula), `unknowns` (of a task, or the inputs),
    `networks`. `shape` is that of a field: numbers of cells, x last. Arrays are float64; a vector has its components
    along a first axis. Unknown names raise InputError, wrong shapes ValueError, other types TypeError.

    `values` of a method is a dictionary for names that are no keywords, {"v.x": array}; `**named` are the others. Both
    are kept until they are set again.
    """

    def __init__(self, core, name):
        self._core, self.name = core, name
        self.lock = threading.Lock()
        self.params = core.names(_core.PARAM)
        self.states = core.names(_core.STATE)
        self.outputs = core.names(_core.OUTPUT)
        self.unknowns = core.names(_core.UNKNOWN)
        self.networks = core.names(_core.WEIGHTS)
        self.has_seeds = bool(core.names(_core.SEED))
        self.shape = tuple(reversed(core.cells()))
        self._vectors = {}
        self._state_vectors = {state.partition(".")[0] for state in self.states if "." in state}
        for field in self.states + core.names(_core.FIELD):
            if "." in field:
                self._vectors.setdefault(field.partition(".")[0], []).append(field)
        self._places = {name: (_core.WEIGHTS, (core.size(_core.WEIGHTS, name),)) for name in self.networks}
        self._places.update({name: (_core.INITIAL, (len(self._vectors[name]), *self.shape))
                             for name in self._state_vectors})
        self._places.update({name: (_core.INITIAL, self.shape) for name in self.states})
        self._places.update({name: (_core.PARAM, ()) for name in self.params})
        self._sets = collections.Counter()  # how often each name was set
        self._told_growth = ""

    def __repr__(self):
        axes = " x ".join(str(n) for n in reversed(self.shape)) or "no"
        return (f"dpde.Scene({self.name}: {axes} cells, states {self.states}, params {self.params}, "
                f"unknowns {self.unknowns})")

    # Values

    def coordinates(self, axis=0):
        """The centres of the cells along an axis: 0 is x, 1 is y, 2 is z."""
        centres = np.empty(self.shape[-1 - axis] if 0 <= axis < len(self.shape) else 0)
        self._core.coordinates(axis, centres)
        return centres

    def unit(self, name):
        """The unit of a field, parameter, observable, axis or "t" in the text: "m/s"; "" if it has none."""
        return self._core.unit(name)

    def set(self, name, value):
        """Sets a parameter, an initial state, a coefficient, a control, data of the task or the weights of a network.

        A parameter is a number; an array has the shape of shape_of(name).
        """
        kind, shape = self._places.get(name) or self._find(name)
        self._sets.update(self._vectors.get(name, [name]))
        if kind == _core.PARAM:
            self._core.set_number(kind, name, self._number(name, value))
        elif name in self._vectors:
            for part, values in zip(self._vectors[name], shaped(name, value, shape)):
                self._core.set(kind, part, values)
        else:
            self._core.set(kind, name, shaped(name, value, shape))

    def shape_of(self, name):
        """The shape of the values of set(): () for a parameter."""
        return (self._places.get(name) or self._find(name))[1]

    @staticmethod
    def _number(name, value):
        try:
            return float(value)
        except (TypeError, ValueError) as reason:
            raise TypeError(f"{name}: one number is wanted: {reason}") from reason

    def _find(self, name):
        """A control, or a field that is no state: where its values go and their shape."""
        if name in self._vectors:
            kind, shape = self._find(self._vectors[name][0])
            self._places[name] = kind, (len(self._vectors[name]), *shape)
            return self._places[name]
        try:
            place = _core.CONTROL, (self._core.size(_core.CONTROL, name),)
        except InputError:
            size, cells = self._field_size(name), int(np.prod(self.shape))
            if self._core.is_number(name):
                place = _core.FIELD, (size,)
            else:
                place = _core.FIELD, self.shape if size == cells else (size // cells, *self.shape)
        self._places[name] = place
        return place

    def _field_size(self, name):
        try:
            return self._core.size(_core.FIELD, name)
        except InputError as error:
            near = difflib.get_close_matches(name, self._places, 1)
            hint = f"did you mean {near[0]}?" if near else f"other names are {', '.join(self._places)}"
            raise InputError(f"{error}; {hint}", error.messages) from None

    def assign(self, values=None, /, **named):
        """Sets several values, by name; a dictionary is for names with a dot and those that Python does not allow."""
        given = {**(values or {}), **named}
        self._require_once(given)
        for name, value in given.items():
            self.set(name, value)

    def _is_unknown(self, name):
        return all(part in self.unknowns for part in self._vectors.get(name, [name]))

    def _require_once(self, names):
        """A vector and one of its components would be two values for one array."""
        for vector, parts in self._vectors.items():
            twice = [part for part in parts if part in names] if vector in names else []
            if twice:
                raise InputError(f"{twice[0]} is given twice: {vector} holds it, too")

    def _set_beside(self, names):
        """A number that grows whenever something else than these is set."""
        given = {part for name in names for part in self._vectors.get(name, [name])}
        return sum(count for name, count in self._sets.items() if name not in given)

    def _require_set_as_before(self, names, before):
        if self._set_beside(names) != before:
            raise InputError("a value was set, or given to another call, since this end() was computed, and backward "
                             "would be at another point: call backward first, or give that value to each call")

    def param(self, name):
        """The value of a parameter."""
        value = np.empty(1)
        self._core.get(_core.PARAM, name, value)
        return float(value[0])

    def _field(self, kind, name, out=None):
        values = np.empty(self.shape) if out is None else out
        if values.dtype != np.float64 or values.shape != self.shape:
            raise ValueError(f"out: an array of float64 of shape {self.shape} is wanted, "
                             f"not of {values.dtype} of shape {values.shape}")
        if not values.flags.c_contiguous or not values.flags.writeable:
            raise ValueError("out: an array in C order that may be written is wanted")
        self._core.get(kind, name, values)
        return values

    def state(self, name, out=None):
        """The state at the present time, in a new array or in `out`."""
        return self._field(_core.STATE, name, out)

    def set_state(self, name, value):
        """Sets the state at the present time."""
        self._core.set(_core.STATE, name, shaped(name, value, self.shape))

    def initial(self, name, out=None):
        """The initial state, in a new array or in `out`."""
        return self._field(_core.INITIAL, name, out)

    def weights(self, network):
        """All weights of a network, as one array."""
        values = np.empty(self._core.size(_core.WEIGHTS, network))
        self._core.get(_core.WEIGHTS, network, values)
        return values

    def observe(self, name):
        """An observable of the scene at the present time, a number."""
        return self._core.observe(name)

    def output(self, name, out=None):
        """An output of the scene with a formula at the present time, in a new array or in `out`."""
        return self._field(_core.OUTPUT, name, out)

    # Runs

    @property
    def time(self):
        """The present time."""
        return self._core.time()

    @property
    def time_step(self):
        """The length of a step."""
        return self._core.time_step()

    @property
    def steps_done(self):
        """The number of steps since the initial state."""
        return self._core.steps_done()

    def reset(self):
        """Makes the initial state the present one."""
        self._core.reset()
        self._told_growth = ""

    def step(self, count=1):
        """Makes `count` steps from the present state. Raises NotFiniteError if a state is no longer finite."""
        while count > 64:  # Ctrl-C ends it between two parts
            self._core.step(64)
            count -= 64
        self._core.step(count)

    def run_to(self, until=None, *, progress=None, every=64):
        """Runs from the present state to the first step that ends at `until` or later; None: to the end of the scene.

        `progress` is called every `every` steps; if it returns False, the run ends with Stopped. Raises NotFiniteError
        if the run blows up, RunError if a solve has no solution.
        """
        self._core.run(until, _called(progress, every), every)
        self._warn_of_growth()

    def _warn_of_growth(self):
        """Of the last run, loss or gradient, as the command does; once of each verdict."""
        text = self._core.growth()
        is_new, self._told_growth = text != self._told_growth, text
        if text and is_new:
            warnings.warn(CompilerWarning(text, [Message("W0801", "warning", text, "", 0, 0, "")]), stacklevel=3)

    def run(self, values=None, /, *, until=None, progress=None, every=64, **named):
        """Sets these values, runs from the initial state, and returns a Result: run(u=u0, nu=0.01).

        `until`, `progress` and `every` are those of run_to().
        """
        self.assign(values, **named)
        self.reset()
        self._core.run(until, _called(progress, every), every)
        self._warn_of_growth()
        return self.result()

    @contextlib.contextmanager
    def record(self, folder, every=1, checkpoint_every=0, resume=False):
        """A context that records a run: `with scene.record("results", every=10): scene.run()`.

        It writes the files of `dpde run --every 10 --out results`: SCENE.nc, STATE.npy, STATE_over_time.npy,
        observables.csv, and with gnuplot SCENE.svg and .png. every=0 records the outputs of the scene. Recording takes
        the memory of one state. If the run ends with an error, the files hold the states recorded until then. A record
        is of one run: a second one is an InputError.

        checkpoint_every=500 writes a checkpoint to the folder every 500 steps. With resume=True the scene starts from
        the checkpoint of the same run, if there is one, and `as is_resumed` is True: `scene.run_to()` continues from it
        with the same bits. `run()`, which starts again, is refused then.
        """
        self._core.record(os.fspath(folder), every)
        try:
            self._core.record_checkpoints(checkpoint_every)
            is_resumed = resume and self._core.record_resume()
        except BaseException:  # the files of the run before stay
            self._core.drop_record()
            raise
        try:
            yield is_resumed
        finally:
            self._core.end_record()

    def result(self):
        """The present states, as a Result."""
        return Result({name: self.state(name) for name in self.states}, self.time, self.steps_done)

    # Losses and derivatives

    def _require_task(self):
        if self.has_seeds:
            raise InputError("a scene opened with inputs has no loss of its own: open a task, or use vjp()")

    def loss(self, values=None, /, **named):
        """Sets these values and returns the loss of the task, computed from the initial state."""
        self._require_task()
        self.assign(values, **named)
        value = self._core.loss()
        self._warn_of_growth()
        return value

    def gradient(self, values=None, /, *, progress=None, every=256, **named):
        """Sets these values and returns the loss of the task and the dictionary of its derivatives by each unknown.

        A derivative has the shape of its unknown: an array for a field, a number for a parameter. `progress` and
        `every` are those of run_to(); forward, recomputed and adjoint steps count.
        """
        self._require_task()
        self.assign(values, **named)
        value = self._core.gradient(_called(progress, every), every)
        self._warn_of_growth()
        return value, {name: self._derivative(name) for name in self.unknowns}

    def _values_like(self, name, values):
        shape = self.shape_of(name)
        return values.reshape(shape) if shape else float(values[0])

    def _derivative(self, name):
        values = np.empty(self._core.size(_core.GRADIENT, name))
        self._core.get(_core.GRADIENT, name, values)
        return self._values_like(name, values)

    def vjp(self, seeds, values=None, /, *, progress=None, every=256, **named):
        """The transposed derivative of the states at the end times `seeds`, as a dictionary by input.

        The scene must have been opened with `inputs`. `seeds` has an array for each state, or for a vector all
        components; states that are left out have the seed 0. The other arguments are those of gradient().
        """
        if not self.has_seeds:
            raise InputError("vjp() is of scenes that are opened with inputs: model.scene(name, inputs=[...])")
        self._require_once(seeds)
        for vector in self._state_vectors & set(seeds):
            parts = self._vectors[vector]
            seeds = {**seeds, **dict(zip(parts, shaped(vector, seeds[vector], (len(parts), *self.shape))))}
            del seeds[vector]
        for name in seeds:
            if name not in self.states:
                raise InputError(f"seeds: there is no state {name}; there is {', '.join(self.states)}")
        self.assign(values, **named)
        for state in self.states:
            seed = shaped(state, seeds[state], self.shape) if state in seeds else np.zeros(self.shape)
            self._core.set(_core.SEED, state, seed)
        self._core.gradient(_called(progress, every), every)
        self._warn_of_growth()
        return {name: self._derivative(name) for name in self.unknowns}

    def unknown(self, name):
        """The value of an unknown with which losses and gradients start."""
        values = np.empty(self._core.size(_core.UNKNOWN, name))
        self._core.get(_core.UNKNOWN, name, values)
        return self._values_like(name, values)

    def hessian_vector(self, direction, values=None, /, *, gauss_newton=False, progress=None, every=256, **named):
        """The Hessian of the loss, or the Gauss-Newton matrix, times `direction`, as a dictionary by unknown.

        `direction` is a dictionary by unknown; unknowns that are left out have the direction 0. The task must have been
        opened with second_order=True.
        """
        self.assign(values, **named)
        vector, product = np.zeros(self._core.unknown_count()), np.empty(self._core.unknown_count())
        places, end = {}, 0
        for name in self.unknowns:
            places[name] = slice(end, end := end + self._core.size(_core.UNKNOWN, name))
        for name, part in direction.items():
            if name not in places:
                raise InputError(f"direction: {name} is not an unknown; these are {', '.join(places)}")
            part = as_array(name, part)
            if part.size != vector[places[name]].size:
                raise ValueError(f"{name}: {vector[places[name]].size} values are wanted, not {part.size}")
            vector[places[name]] = part.ravel()
        self._core.hessian_vector(vector, product, gauss_newton, _called(progress, every), every)
        return {name: self._values_like(name, product[place].copy()) for name, place in places.items()}

    def optimise(self, values=None, /, *, iterations=0, progress=None, **named):
        """Sets these values, runs the optimiser of the task and returns an Optimised; unknown(name) is the value found.

        `iterations` > 0 replaces the number of the task. `progress` is called before each update; if it returns False,
        the optimiser ends without an error, with the values of the last update.
        """
        self.assign(values, **named)
        self._sets.update(self.unknowns)
        return Optimised(*self._core.optimise(_called(progress), iterations))
