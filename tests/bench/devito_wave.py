# SPDX-License-Identifier: Apache-2.0
"""The 3-D wave of wave_bench.cpp with Devito: median and least milliseconds of 7 runs, by precision and threads.

Needs Devito 4.8 from PyPI and a C compiler:
    python3 -m venv /tmp/devito && /tmp/devito/bin/pip install devito==4.8.20
    for threads in 1 2; do
      OMP_NUM_THREADS=$threads /tmp/devito/bin/python tests/bench/devito_wave.py f64 $threads
    done
Devito's own operators: second order in time without absorbing layers; the gradient by the slowness squared is the
adjoint operator with the correlation of the stored second time derivative.
"""

import statistics
import sys
import time

import numpy as np
from devito import Eq, Function, Grid, Operator, TimeFunction, configuration, solve

real = {"f64": np.float64, "f32": np.float32}[sys.argv[1]]
threads = int(sys.argv[2])
configuration["log-level"] = "ERROR"
configuration["language"] = "openmp" if threads > 1 else "C"

cells, steps, dt = 128, 40, 0.1 / 40
grid = Grid(shape=(cells, cells, cells), extent=(1.0, 1.0, 1.0), dtype=real)
m = Function(name="m", grid=grid, space_order=8)
m.data[:] = 1.0
u = TimeFunction(name="u", grid=grid, time_order=2, space_order=8)
saved = TimeFunction(name="saved", grid=grid, time_order=2, space_order=8, save=steps + 2)
v = TimeFunction(name="v", grid=grid, time_order=2, space_order=8)
by_m = Function(name="by_m", grid=grid, space_order=0)
forward = Operator([Eq(u.forward, solve(m * u.dt2 - u.laplace, u.forward))])
saving = Operator([Eq(saved.forward, solve(m * saved.dt2 - saved.laplace, saved.forward))])
reverse = Operator([Eq(v.backward, solve(m * v.dt2 - v.laplace, v.backward)), Eq(by_m, by_m - saved.dt2 * v)])


def milliseconds(run, runs=7):
    run()
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        run()
        times.append((time.perf_counter() - begin) * 1e3)
    return statistics.median(times), min(times)


def apply(operator):
    operator.apply(time_m=1, time_M=steps, dt=dt)


def gradient():
    apply(saving)
    apply(reverse)


for name, run in [("forward", lambda: apply(forward)), ("gradient", gradient)]:
    median, least = milliseconds(run)
    print(f"{name:9} {sys.argv[1]} {threads} threads: median {median:.0f} ms, least {least:.0f} ms")
