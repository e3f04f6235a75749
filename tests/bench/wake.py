#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The wake of Um and others (2020): what a grid four times as coarse loses in 500 steps, beside their "no model" column.

A reference on 128 x 256 cells runs 1000 steps. From there on 500 states of it are compared with those of a run on fewer
cells that begins with the first of them, taken to its faces as their code does it: every second face along the own
axis, means of two across, until it fits. The measure is theirs too: the mean of the absolute differences over a frame
of (2n+1) x (n+1) pairs, whose unused places are 0 in both.

Needs numpy and netCDF4. Leaves the frames of each run, a data set to learn from, in DIR/re_RE/{reference,coarse}.nc.

  tests/bench/wake.py build/bin/dpde DIR [--cells 32] [--reynolds 240000,...]
"""
import argparse
import pathlib
import subprocess

import netCDF4
import numpy as np

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "dsl-examples" / "wake" / "wake.dpde"
# Of 500 steps, by the Reynolds number of their command line; computed with PhiFlow 4f5e678 and a direct solver.
PUBLISHED = {32: {240000: 0.13866, 960000: 0.14845, 3840000: 0.14942}, 64: {240000: 0.09474, 960000: 0.11148,
                                                                          3840000: 0.11588}}
SCENE = """
scene {name} : wake_step {{
  grid x = -1 .. {n}+1, cells {n}+2
  grid y = -1 .. 2*{n}+1, cells 2*{n}+2
  n = {n}
  viscosity = 1e4/{reynolds}
  open = if((x*100/{n} - 50)^2 + (y*100/{n} - 50)^2 <= 100, 0, 1)
  fluid = if(x < 0 or y < 0 or x > {n} or y > 2*{n} or (x*100/{n} - 50)^2 + (y*100/{n} - 50)^2 <= 100, 0, 1)
  initial vx = load("{folder}/vx.npy")
  initial vy = load("{folder}/vy.npy")
  output vx, vy every 1
  time 0 .. {steps}, step 1
}}
"""


def run(command):
    subprocess.run([str(part) for part in command], check=True)


def faces(vx, vy):
    """The velocities on their faces, of arrays with a ring: vx[2n, n+1], vy[2n+1, n]."""
    return vx[..., 1:-1, :-1], vy[..., :-1, 1:-1]


def halved(vx, vy):
    return (vx[..., ::2, ::2] + vx[..., 1::2, ::2]) / 2, (vy[..., ::2, ::2] + vy[..., ::2, 1::2]) / 2


def arrays(vx, vy):
    """With a ring, in which each is what it is at its nearest place."""
    return np.pad(vx, ((1, 1), (0, 1)), "edge"), np.pad(vy, ((0, 1), (1, 1)), "edge")


def difference(a, b):
    """Of each frame, over (2n+1) x (n+1) pairs."""
    n = a[1].shape[-1]
    total = sum(np.abs(x - y).sum(axis=(-2, -1)) for x, y in zip(a, b))
    return total / (2 * (2 * n + 1) * (n + 1))


def frames(dpde, folder, name, n, reynolds, steps, start):
    """Of a run that begins with `start`."""
    begin = folder / f"{name}_start"
    begin.mkdir(parents=True, exist_ok=True)
    for component, values in zip(("vx", "vy"), arrays(*start)):
        np.save(begin / f"{component}.npy", values)
    model = folder / f"{name}.dpde"
    model.write_text(EXAMPLE.read_text() + SCENE.format(name=name, n=n, reynolds=reynolds, steps=steps,
                                                        folder=begin.name))
    run([dpde, "run", model, name, "--out", folder, "--quiet"])
    with netCDF4.Dataset(folder / f"{name}.nc") as data:
        return faces(data["vx"][:].data, data["vy"][:].data)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dpde")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cells", type=int, default=32, choices=[32, 64])
    parser.add_argument("--reynolds", default="240000,480000,960000,1920000,3840000")
    options = parser.parse_args()
    errors = []
    print("Re of the command line, mean error, published; at frames 1, 10, 50, 100, 250, 499")
    for reynolds in map(int, options.reynolds.split(",")):
        folder = options.folder / f"re_{reynolds}"
        folder.mkdir(parents=True, exist_ok=True)
        run([options.dpde, "run", EXAMPLE, "fine", "--set", f"viscosity=1e4/{reynolds}", "--out", folder, "--quiet"])
        start = faces(np.load(folder / "vx.npy"), np.load(folder / "vy.npy"))
        reference = frames(options.dpde, folder, "reference", 128, reynolds, 499, start)
        for _ in range({32: 2, 64: 1}[options.cells]):
            start, reference = halved(*start), halved(*reference)
        coarse = frames(options.dpde, folder, "coarse", options.cells, reynolds, 499, start)
        if options.cells == 64:  # is looked at on the faces of 32 x 64 cells, too
            coarse, reference = halved(*coarse), halved(*reference)
        error = difference(coarse, reference)
        errors.append(error.mean())
        published = PUBLISHED[options.cells].get(reynolds)
        picked = " ".join(f"{error[k]:.4f}" for k in (1, 10, 50, 100, 250, 499))
        print(f"{reynolds:8d}  {error.mean():.5f}  {published or '':8}  {picked}", flush=True)
    print(f"mean {np.mean(errors):.4f} +- {np.std(errors):.4f}")


if __name__ == "__main__":
    main()
