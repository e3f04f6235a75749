# SPDX-License-Identifier: Apache-2.0
"""A scene as an operator of JAX, by pure_callback: it works under jit, grad and, one by one, vmap.

    loss = dpde.jax.loss(model.scene("recover"))                 # a task
    jax.grad(loss)({"kappa": 0.05})
    end = dpde.jax.end(model.scene("rod", inputs=["u"]))         # a scene and what its end is differentiated by
    end({"u": u0})["u"]

A callback costs some tens of microseconds and a copy of its inputs and outputs. Without jax_enable_x64 arrays of JAX
are float32: they are converted, and the results are float32. loss() computes the gradient with the value if it is
differentiated. end() runs the scene, and its derivative runs it again, with the adjoint. There are no second
derivatives and no forward mode.
"""
import inspect

import jax
import jax.numpy as jnp
import numpy as np

_options = ({"vmap_method": "sequential"} if "vmap_method" in inspect.signature(jax.pure_callback).parameters
            else {"vectorized": False})


def _shapes(tree):
    return jax.tree_util.tree_map(lambda x: jax.ShapeDtypeStruct(jnp.shape(x), jnp.result_type(x)), tree)


def _number_type():
    return np.dtype(np.float64 if jax.config.jax_enable_x64 else np.float32)


def _doubles(tree):
    return {name: np.array(value, np.float64, order="C") for name, value in tree.items()}


def _like(shapes, values, vectors):
    """Arrays of these shapes from results of the scene, by name; of a vector all components."""
    def found(name):
        return values[name] if name in values else np.stack([values[part] for part in vectors[name]])

    return {name: np.asarray(found(name), shape.dtype).reshape(shape.shape) for name, shape in shapes.items()}


def _check(scene, inputs):
    """Before anything runs: what is wrong in a callback JAX shows with a trace of its own."""
    scene._require_once(inputs)
    for name, value in inputs.items():
        if not scene._is_unknown(name):
            raise ValueError(f"{name} is no unknown of {scene.name}, and JAX would differentiate by it; "
                             f"these are {scene.unknowns}: set others with scene.set()")
        if jnp.shape(value) != scene.shape_of(name):
            raise ValueError(f"{name}: an array of shape {scene.shape_of(name)} is wanted, not of {jnp.shape(value)}")
        if not jnp.issubdtype(jnp.result_type(value), jnp.floating):
            raise TypeError(f"{name}: an array of float64 or float32 is wanted, not of {jnp.result_type(value)}")


def loss(scene):
    """The loss of a task as a function of a dictionary of its unknowns: arrays of float64 or float32, or numbers."""
    number = jax.ShapeDtypeStruct((), _number_type())

    def value(inputs):
        with scene.lock:
            return np.asarray(scene.loss(_doubles(inputs)), number.dtype)

    def with_gradient(shapes):
        def call(inputs):
            with scene.lock:
                loss, gradients = scene.gradient(_doubles(inputs))
            return np.asarray(loss, number.dtype), _like(shapes, gradients, scene._vectors)

        return call

    @jax.custom_vjp
    def call(inputs):
        _check(scene, inputs)
        return jax.pure_callback(value, number, inputs, **_options)

    def forward(inputs):
        _check(scene, inputs)
        shapes = _shapes(inputs)
        return jax.pure_callback(with_gradient(shapes), (number, shapes), inputs, **_options)

    def backward(gradients, bar):
        return (jax.tree_util.tree_map(lambda g: (g * bar).astype(g.dtype), gradients),)

    call.defvjp(forward, backward)
    return call


def end(scene):
    """The dictionary of the states at the end of a scene, as a function of a dictionary of its inputs.

    The scene must have been opened with `inputs`.
    """
    if not scene.has_seeds:
        raise ValueError("end() is of scenes that are opened with inputs: model.scene(name, inputs=[...])")
    states = {name: jax.ShapeDtypeStruct(scene.shape, _number_type()) for name in scene.states}
    note = jax.ShapeDtypeStruct((), np.int32)  # what the scene had besides, see Scene._set_beside

    def run(inputs):
        with scene.lock:
            return _like(states, scene.run(_doubles(inputs)).states, {})

    def run_and_note(inputs):
        with scene.lock:
            return _like(states, scene.run(_doubles(inputs)).states, {}), np.int32(scene._set_beside(inputs))

    def transposed(shapes):
        def call(inputs, others, bars):
            with scene.lock:
                scene._require_set_as_before(inputs, int(others))
                return _like(shapes, scene.vjp(_doubles(bars), _doubles(inputs)), scene._vectors)

        return call

    @jax.custom_vjp
    def call(inputs):
        _check(scene, inputs)
        return jax.pure_callback(run, states, inputs, **_options)

    def forward(inputs):
        _check(scene, inputs)
        result, others = jax.pure_callback(run_and_note, (states, note), inputs, **_options)
        return result, (inputs, others)

    def backward(saved, bars):
        inputs, others = saved
        shapes = _shapes(inputs)
        return (jax.pure_callback(transposed(shapes), shapes, inputs, others, bars, **_options),)

    call.defvjp(forward, backward)
    return call
