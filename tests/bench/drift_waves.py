# SPDX-License-Identifier: Apache-2.0
"""Drift waves of a plasma (Hasegawa and Wakatani) by dpde, JAX and hw2d, which do the same: Arakawa's bracket, central
differences, a potential by Fourier series, nu*lap^3, rk4. Seconds of a value and of a value with its gradient.

Needs JAX and hw2d with numba from PyPI (hw2d has no gradients), and dpde built:
    python3 -m venv /tmp/venv && /tmp/venv/bin/pip install jax==0.4.30 hw2d==1.0.4 numba
    for tool in dpde jax hw2d; do taskset -c 0 /tmp/venv/bin/python tests/bench/drift_waves.py $tool 64 128 256; done
The value is mean(n^2) after 40 steps of 0.025, the gradient that by n and omega at the start; JAX computes steps again
on its way back (jax.checkpoint), dpde keeps states. One line a grid: tool, cells, value, norm of the gradient by n, and
the seconds, each the median of 5 on one thread, compilation not counted.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from functools import partial

os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["NUMBA_NUM_THREADS"] = "1"
import numpy as np

STEPS, DT, K0, NU = 40, 0.025, 0.15, 5e-8
N = "sin(0.45*y)*cos(0.3*x) + 0.5*sin(1.35*y + 1)*cos(0.15*x) + 0.25*cos(0.75*y + 0.3)*sin(0.6*x + 0.7)"
OMEGA = "cos(0.6*y + 0.5)*sin(0.45*x) + 0.5*sin(1.2*y)*cos(0.3*x + 0.2)"
TEXT = f"""
function fall(f) = dx(dx(f)) + dy(dy(f))
model drift_waves {{
  field n, omega
  param nu
  solve lap(phi) = omega for phi
  dt(n) = phi - n - bracket(phi, n) - dy(phi) + nu*fall(fall(fall(n)))
  dt(omega) = phi - n - bracket(phi, omega) + nu*fall(fall(fall(omega)))
}}
scheme nine_points {{ dx = central(2); lap = spectral; time = rk4 }}
scene start : drift_waves with nine_points {{
  grid x = 0 .. 2*pi/{K0}, cells CELLS, periodic
  grid y = 0 .. 2*pi/{K0}, cells CELLS, periodic
  nu = {NU}
  initial n = {N}
  initial omega = {OMEGA}
  observe value = mean(n^2)
  time 0 .. {STEPS*DT}, step {DT}
}}
task size : start {{ unknown initial n; unknown initial omega; minimise mean(n^2) }}
"""


def start(cells):
    """n and omega, y along the first axis."""
    at = (np.arange(cells) + 0.5) * 2 * np.pi / K0 / cells
    y, x = np.meshgrid(at, at, indexing="ij")
    names = {"sin": np.sin, "cos": np.cos, "x": x, "y": y}
    return eval(N, names), eval(OMEGA, names)


def median(run, runs=5):
    run()
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def by_dpde(cells):
    dpde = os.environ.get("DPDE", "build/bin/dpde")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "t.dpde")
        with open(path, "w") as file:
            file.write(TEXT.replace("CELLS", str(cells)))

        def call(*words):
            command = [dpde, *words, "--threads", "1", "--json"]
            return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

        runs = [call("run", path, "start") for _ in range(5)]
        gradients = [call("gradient", path, "size", "--no-certify") for _ in range(5)]
    seconds = lambda results: statistics.median(result["wall_s"] for result in results)
    return gradients[0]["loss"], norm_of(gradients[0]), seconds(runs), seconds(gradients)


def norm_of(result):
    return result["gradient"]["n"]["norm"]


def by_jax(cells):
    import jax
    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp

    h = 2 * np.pi / K0 / cells
    k = np.fft.fftfreq(cells, 1 / cells) * K0
    k2 = k[:, None]**2 + k[None, :cells // 2 + 1]**2
    inverse = jnp.asarray(-np.divide(1, k2, out=np.zeros_like(k2), where=k2 > 0))
    wide = lambda f: jnp.pad(f, 1, mode="wrap")
    at = lambda f, y, x: f[1 + y:cells + 1 + y, 1 + x:cells + 1 + x]  # of a wide one

    def lap(f):
        f = wide(f)
        return (at(f, 0, 1) + at(f, 0, -1) + at(f, 1, 0) + at(f, -1, 0) - 4 * at(f, 0, 0)) / h**2

    def bracket(p, w):
        north, south, east, west = at(p, 1, 0), at(p, -1, 0), at(p, 0, 1), at(p, 0, -1)
        to_east = north - south + at(p, 1, 1) - at(p, -1, 1)
        to_west = north - south + at(p, 1, -1) - at(p, -1, -1)
        to_north = east - west + at(p, 1, 1) - at(p, 1, -1)
        to_south = east - west + at(p, -1, 1) - at(p, -1, -1)
        sides = to_north * at(w, 1, 0) - to_south * at(w, -1, 0) - to_east * at(w, 0, 1) + to_west * at(w, 0, -1)
        corners = ((east - north) * at(w, 1, 1) + (north - west) * at(w, 1, -1) + (west - south) * at(w, -1, -1) +
                   (south - east) * at(w, -1, 1))
        return (sides + corners) / (12 * h * h)

    def rate(state):
        n, omega = state
        phi = jnp.fft.irfft2(jnp.fft.rfft2(omega) * inverse, s=omega.shape)
        p = wide(phi)
        slope = (at(p, 1, 0) - at(p, -1, 0)) / (2 * h)
        return (phi - n - bracket(p, wide(n)) - slope + NU * lap(lap(lap(n))),
                phi - n - bracket(p, wide(omega)) + NU * lap(lap(lap(omega))))

    add = lambda state, factor, k: jax.tree_util.tree_map(lambda s, r: s + factor * r, state, k)

    def stage(begin, carry, factors):  # in a loop, as XLA compiles four of them written out for minutes
        at_stage, total = carry
        k = rate(at_stage)
        return (add(begin, factors[0], k), add(total, factors[1], k)), None

    factors = DT * jnp.asarray([[1 / 2, 1 / 6], [1 / 2, 1 / 3], [1, 1 / 3], [0, 1 / 6]])
    step = lambda state, _: (jax.lax.scan(partial(stage, state), (state, state), factors)[0][1], None)
    value = lambda state: jnp.mean(jax.lax.scan(jax.checkpoint(step), state, None, STEPS)[0][0]**2)
    run, gradient = jax.jit(value), jax.jit(jax.value_and_grad(value))
    state = tuple(jnp.asarray(f) for f in start(cells))
    loss, (by_n, _) = gradient(state)
    return (float(loss), float(jnp.linalg.norm(by_n)), median(lambda: jax.block_until_ready(run(state))),
            median(lambda: jax.block_until_ready(gradient(state))))


def by_hw2d(cells):
    from hw2d.model import HW
    from hw2d.utils.namespaces import Namespace
    h = 2 * np.pi / K0 / cells
    physics = HW(dx=h, N=3, c1=1, nu=NU, k0=K0, TEST_CONSERVATION=False)
    n, omega = start(cells)

    def run():
        plasma = Namespace(density=n, omega=omega, phi=physics.get_phi(omega, h), age=0)
        for _ in range(STEPS):
            plasma = physics.rk4_step(plasma, dt=DT, dx=h)
        return np.mean(plasma.density**2)

    return run(), float("nan"), median(run), float("nan")


def main():
    tool, grids = sys.argv[1], [int(n) for n in sys.argv[2:]]
    for cells in grids:
        value, norm, seconds, of_gradient = {"dpde": by_dpde, "jax": by_jax, "hw2d": by_hw2d}[tool](cells)
        print(f"{tool:5} {cells:5} {value:.12e} {norm:.9e} {seconds:.4f} {of_gradient:.4f}", flush=True)


main()
