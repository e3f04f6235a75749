# SPDX-License-Identifier: Apache-2.0
"""What Python adds: a gradient of 512 x 512 cells by NumPy, PyTorch and JAX beside the same calls of the library alone
(dpde_c.h by ctypes), in turn, and what single calls cost.

PYTHONPATH=build/python python3 tests/bench/python_gradient.py
"""
import ctypes
import statistics
import sys
import time
import timeit

import numpy as np

import dpde
from dpde import _core

text = b"""model flow { field u; param kappa
  dt(u) = kappa*lap(u) - u*dx(u) }
scene plate : flow {
  grid x = 0 .. 1, cells 512, periodic
  grid y = 0 .. 1, cells 512, periodic
  kappa = 1e-4
  initial u = sin(2*pi*x)*sin(2*pi*y)
  time 0 .. 0.05, step 1/1280
}
task find : plate {
  data r = u from scene plate at t = 0.05
  unknown initial u from 0.9*sin(2*pi*x)*sin(2*pi*y)
  unknown kappa from 2e-4
  minimise mean((u - r)^2) at t = 0.05
}
"""
kappa = 2e-4


class Options(ctypes.Structure):
    _fields_ = [("version", ctypes.c_int32), ("name", ctypes.c_char_p), ("rest", ctypes.c_int64 * 32)]


def library_alone(u):
    """The calls of a C++ host, arrays in and out."""
    lib = ctypes.CDLL(sys.argv[1] if len(sys.argv) > 1 else "build/compiler/libdpde.so")
    for function in (lib.dpde_model_from_text, lib.dpde_model_open):
        function.restype = ctypes.c_void_p
    error, options = ctypes.c_void_p(), Options()
    lib.dpde_options_init(ctypes.byref(options), 1)
    options.name = b"find"
    model = ctypes.c_void_p(lib.dpde_model_from_text(text, b"plate.dpde", ctypes.byref(error)))
    sim = ctypes.c_void_p(lib.dpde_model_open(model, ctypes.byref(options), ctypes.byref(error)))
    assert sim
    by_u, number, loss = np.empty_like(u), ctypes.c_double(kappa), ctypes.c_double()
    size, none = ctypes.c_size_t(u.size), ctypes.c_void_p()

    def gradient():
        lib.dpde_sim_set(sim, _core.INITIAL, b"u", u.ctypes.data_as(ctypes.c_void_p), size, none)
        lib.dpde_sim_set(sim, _core.PARAM, b"kappa", ctypes.byref(number), ctypes.c_size_t(1), none)
        assert lib.dpde_sim_gradient(sim, ctypes.byref(loss), none) == 0
        lib.dpde_sim_get(sim, _core.GRADIENT, b"u", by_u.ctypes.data_as(ctypes.c_void_p), size, none)
        return loss.value

    return gradient


def with_torch(calls, model, task, u):
    import torch

    import dpde.torch

    loss = dpde.torch.loss(task)
    scene = model.scene("plate", inputs=["u", "kappa"])
    end = dpde.torch.end(scene)
    tensor = torch.from_numpy(u).requires_grad_()
    number = torch.tensor(kappa, dtype=torch.float64, requires_grad=True)

    def use(function):
        def call():
            tensor.grad = number.grad = None
            function().backward()

        return call

    calls["torch loss"] = use(lambda: loss(u=tensor, kappa=number))
    calls["torch end"] = use(lambda: (end(u=tensor, kappa=number)["u"] ** 2).mean())
    calls["NumPy run"] = lambda: scene.run(u=u, kappa=kappa)
    calls["NumPy vjp"] = lambda: scene.vjp({"u": u}, u=u, kappa=kappa)


def with_jax(calls, task, u):
    import jax

    import dpde.jax

    jax.config.update("jax_enable_x64", True)
    update = jax.jit(jax.value_and_grad(dpde.jax.loss(task)))
    array = jax.numpy.asarray(u)
    calls["jax loss"] = lambda: jax.block_until_ready(update({"u": array, "kappa": kappa}))


def gradients():
    model = dpde.compile(text.decode())
    task = model.scene("find")
    u = task.initial("u")
    calls = {"library": library_alone(u), "NumPy": lambda: task.gradient(u=u, kappa=kappa)}
    for add in (lambda: with_torch(calls, model, task, u), lambda: with_jax(calls, task, u)):
        try:
            add()
        except ImportError as reason:
            print(f"left out: {reason}")
    wall, cpu = ({name: [] for name in calls} for _ in range(2))
    for _ in range(16):
        for name, call in calls.items():
            start, used = time.perf_counter(), time.process_time()
            call()
            wall[name].append(1e3 * (time.perf_counter() - start))
            cpu[name].append(1e3 * (time.process_time() - used))
    for name in calls:  # without the first, which tunes and allocates
        of_wall, of_cpu = statistics.median(wall[name][1:]), statistics.median(cpu[name][1:])
        print(f"{name:10s} {of_wall:6.1f} ms, {of_cpu:6.1f} ms of processor, "
              f"{of_cpu / statistics.median(cpu['library'][1:]):.3f} of the library alone")


def single_calls():
    scene = dpde.compile("model decay { field u; param k\n dt(u) = -k*u }\nscene s : decay {\n"
                         " grid x = 0 .. 1, cells 8, periodic\n k = 1\n initial u = 1\n"
                         " time 0 .. 1e6, step 1/8 }").scene()
    values, out = np.ones(8), np.empty(8)
    calls = {"set a parameter": lambda: scene.set("k", 1.0), "set a field": lambda: scene.set("u", values),
             "state into an array": lambda: scene.state("u", out), "step of 8 cells": lambda: scene.step()}
    for name, call in calls.items():
        print(f"{name:20s} {1e6 * min(timeit.repeat(call, number=10000, repeat=5)) / 10000:.2f} us")


single_calls()
gradients()
