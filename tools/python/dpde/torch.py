# SPDX-License-Identifier: Apache-2.0
"""A scene as an operator of PyTorch.

    loss = dpde.torch.loss(model.scene("recover"))               # a task
    loss(kappa=kappa).backward()
    end = dpde.torch.end(model.scene("rod", inputs=["u"]))       # a scene and what its end is differentiated by
    end(u=network(x))["u"]

Tensors of float64 on the processor are read directly. Tensors of float32 are converted, and so are their gradients.
loss() computes the gradient with the value and stores it. end() runs the scene. Its backward pass runs the scene again,
with the adjoint: values that were set with scene.set() and not given to end() must be unchanged until then. There are
no second derivatives.
"""
import torch


def _array(name, tensor):
    if tensor.device.type != "cpu":
        raise TypeError(f"{name} is on {tensor.device}, and scenes run on the processor: give {name}.cpu()")
    if tensor.dtype not in (torch.float64, torch.float32):
        raise TypeError(f"{name}: a tensor of float64 or float32 is wanted, not of {tensor.dtype}")
    return tensor.detach().to(torch.float64).numpy()


def _tensor(values, like):
    return torch.as_tensor(values, dtype=torch.float64).to(like.dtype).reshape(like.shape)


def _require_unknowns(scene, names, tensors):
    for name, tensor in zip(names, tensors):
        if tensor.requires_grad and not scene._is_unknown(name):
            known = f"these are {scene.unknowns}"
            raise ValueError(f"{name} requires a gradient and is no unknown of {scene.name}: {known}")


def _by_input(scene, names, tensors, gradients, scale):
    """What backward() returns for each tensor."""
    for name, tensor in zip(names, tensors):
        if name in scene._vectors and name not in gradients:
            yield torch.stack([_tensor(gradients[part], tensor[0]) for part in scene._vectors[name]]) * scale
        else:
            yield _tensor(gradients[name], tensor) * scale if name in gradients else None


class _Once(torch.autograd.Function):
    """A gradient that depends on the tensors in a way that nobody knows the derivative of."""

    @staticmethod
    def forward(ctx, gradient, *tensors):
        return gradient.clone()

    @staticmethod
    def backward(ctx, bar):
        raise RuntimeError("dpde.torch has no second derivatives: Scene.hessian_vector() has those of a task's loss")


def _differentiable_once(gradients, tensors):
    """As they are, unless autograd records them: once_differentiable lets those through whose incoming gradient is
    constant, and their derivative would be 0."""
    if not torch.is_grad_enabled():
        return gradients
    return [None if g is None else _Once.apply(g, *tensors) for g in gradients]


class _Loss(torch.autograd.Function):
    @staticmethod
    def forward(ctx, scene, names, *tensors):
        values = {name: _array(name, tensor) for name, tensor in zip(names, tensors)}
        with scene.lock:
            if not any(ctx.needs_input_grad):
                return torch.tensor(scene.loss(values), dtype=torch.float64)
            value, gradients = scene.gradient(values)
        ctx.save_for_backward(*tensors)
        ctx.gradients = [g if needs else None for g, needs in zip(_by_input(scene, names, tensors, gradients, 1.0),
                                                                  ctx.needs_input_grad[2:])]
        return torch.tensor(value, dtype=torch.float64)

    @staticmethod
    def backward(ctx, bar):
        scale = bar.item()
        scaled = [g if g is None or scale == 1 else g * scale for g in ctx.gradients]
        return (None, None, *_differentiable_once(scaled, (bar, *ctx.saved_tensors)))


class _End(torch.autograd.Function):
    @staticmethod
    def forward(ctx, scene, names, *tensors):
        ctx.scene, ctx.names = scene, names
        ctx.save_for_backward(*tensors)
        values = {name: _array(name, tensor) for name, tensor in zip(names, tensors)}
        with scene.lock:
            result = scene.run(values)
            ctx.others = scene._set_beside(names)
        return tuple(torch.from_numpy(result.states[name]) for name in scene.states)

    @staticmethod
    def backward(ctx, *bars):
        scene, tensors = ctx.scene, ctx.saved_tensors
        values = {name: _array(name, tensor) for name, tensor in zip(ctx.names, tensors)}
        seeds = {name: _array(name, bar) for name, bar in zip(scene.states, bars)}
        with scene.lock:
            scene._require_set_as_before(ctx.names, ctx.others)
            gradients = scene.vjp(seeds, values)
        by_input = list(_by_input(scene, ctx.names, tensors, gradients, 1.0))
        return (None, None, *_differentiable_once(by_input, (*bars, *tensors)))


def loss(scene):
    """The loss of a task as a function of tensors by name, loss(kappa=kappa); the result is a tensor without axes."""

    def call(values=None, /, **named):
        given = {**(values or {}), **named}
        _require_unknowns(scene, given, given.values())
        return _Loss.apply(scene, tuple(given), *given.values())

    return call


def end(scene):
    """The dictionary of the states at the end of a scene, as a function of tensors by name, end(u=u0).

    The scene must have been opened with `inputs`.
    """
    if not scene.has_seeds:
        raise ValueError("end() is of scenes that are opened with inputs: model.scene(name, inputs=[...])")

    def call(values=None, /, **named):
        given = {**(values or {}), **named}
        _require_unknowns(scene, given, given.values())
        return dict(zip(scene.states, _End.apply(scene, tuple(given), *given.values())))

    return call
