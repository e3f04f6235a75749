# SPDX-License-Identifier: Apache-2.0
"""100 steps of decaying turbulence on [0, 2 pi]^2 by dpde and jax-cfd's finite volumes: seconds of a run and of a
gradient.

    python3 -m venv /tmp/venv && /tmp/venv/bin/pip install jax-cfd==0.2.1 jax==0.10.2
    for tool in dpde_rk4_stage dpde_rk4_step dpde_rk2_step jax_rk4 jax_rk2 jax_euler; do
      taskset -c 0 /tmp/venv/bin/python tests/bench/projection.py $tool f32 128 256
    done

Both take central differences of second order on faces and Fourier series for the pressure (solve_fast_diag).
jax-cfd's Runge-Kutta methods have a projection behind each stage, and so has dpde_rk4_stage; those of `step` have
one. The flow is that of decaying_turbulence.py, at a Courant number of about 0.4. The gradient is that of the mean
energy at the end by the initial flow; jax-cfd's steps are checkpointed. One line a grid: tool, precision, cells,
seconds of a run, and of a value with its gradient, both medians of 7 without compilation, and the mean energy at the
end; one thread.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from decaying_turbulence import NU, SCALE, WAVES, flow

STEPS, RUNS = 100, 7
step_of = lambda cells: 0.4 * 2 * np.pi / cells / 3  # the largest speed is about 3


def median(run):
    run()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def by_dpde(cells, real, time_scheme, often):
    term = lambda w, factor: f"{factor}*cos({w[0]}*x + {w[1]}*y + {w[3]})"
    u = " + ".join(term(w, SCALE[w] * w[1]) for w in WAVES)
    v = " + ".join(term(w, -SCALE[w] * w[0]) for w in WAVES)
    text = f"""
model flow {{ vector u on faces; field p; param nu
  dt(u) = -div(outer(interpolate(u), interpolate(u))) - grad(p) + nu*lap(u)
  0 = div(u) gives p each {often} }}
scheme c {{ time = {time_scheme}; real = {real} }}
scene turbulence : flow with c {{
  grid x = 0 .. 2*pi, cells {cells}, periodic
  grid y = 0 .. 2*pi, cells {cells}, periodic
  nu = {NU}
  initial u = ({u}, {v})
  time 0 .. {STEPS * step_of(cells)}, step {step_of(cells)}
  observe energy = 0.5*mean(u.x^2) + 0.5*mean(u.y^2)
}}
task energy_at_end : turbulence {{ unknown initial u; minimise 0.5*mean(u.x^2) + 0.5*mean(u.y^2) }}
"""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "t.dpde")
        with open(path, "w") as file:
            file.write(text)

        def call(*words):
            command = [os.environ.get("DPDE", "build/bin/dpde"), *words, "--threads", "1", "--json"]
            return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

        runs = [call("run", path, "turbulence") for _ in range(RUNS)]
        gradients = [call("gradient", path, "energy_at_end", "--no-certify") for _ in range(RUNS)]
    middle = lambda results: statistics.median(each["wall_s"] for each in results)
    return middle(runs), middle(gradients), gradients[0]["loss"]


def by_jax_cfd(cells, real, stepper):
    import jax
    jax.config.update("jax_enable_x64", real == "f64")
    import jax.numpy as jnp
    import jax_cfd.base as cfd

    grid = cfd.grids.Grid((cells, cells), domain=((0, 2 * np.pi), (0, 2 * np.pi)))
    step = cfd.equations.semi_implicit_navier_stokes(1.0, NU, step_of(cells), grid,
                                                     convect=cfd.advection.convect_linear,
                                                     time_stepper=getattr(cfd.time_stepping, stepper))
    periodic = cfd.boundaries.periodic_boundary_conditions(2)
    begin = []
    for axis, offset in enumerate(grid.cell_faces):
        values = jnp.asarray(flow(*grid.mesh(offset))[axis], jnp.float64 if real == "f64" else jnp.float32)
        begin.append(cfd.grids.GridVariable(cfd.grids.GridArray(values, offset, grid), periodic))
    run = jax.jit(cfd.funcutils.repeated(step, STEPS))
    checkpointed = cfd.funcutils.repeated(jax.checkpoint(step), STEPS)
    energy = lambda u: 0.5 * sum(jnp.mean(c.data**2) for c in checkpointed(u))
    gradient = jax.jit(jax.value_and_grad(energy))
    begin = tuple(begin)
    return (median(lambda: jax.block_until_ready(run(begin))), median(lambda: jax.block_until_ready(gradient(begin))),
            float(gradient(begin)[0]))


if __name__ == "__main__":
    tool, real = sys.argv[1:3]
    steppers = {"rk4": "classic_rk4", "rk2": "midpoint_rk2", "euler": "forward_euler"}
    for cells in map(int, sys.argv[3:]):
        program, *method = tool.split("_", 1)
        if program == "dpde":
            found = by_dpde(cells, real, *method[0].rsplit("_", 1))
        else:
            found = by_jax_cfd(cells, real, steppers[method[0]])
        print(tool, real, cells, *(f"{value:.6g}" for value in found), flush=True)
