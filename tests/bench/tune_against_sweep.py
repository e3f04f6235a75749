#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does `dpde tune` choose what a sweep of everything would have chosen, and with how many runs?

For each scene every method that tune tries is run on every rung of its ladder of grids, with three steps and both
precisions. The cost of a point is its number of steps times the seconds of one step on its cells: the least that any of
the timings of this method, precision and grid gave, so that a busy moment counts for little. Tune's choice has its cost
by the same numbers.

    tests/bench/tune_against_sweep.py build/bin/dpde [--json FILE]
"""
import json
import subprocess
import sys

MOST_CELLS = 4
FRACTIONS = "0.9,0.6,0.3"
QUICK = ["--samples", "15", "--sample-seconds", "0.001", "--threads", "1", "--json"]
# Scene, its cells along its axis, and tolerances.
SCENES = [
    ("dsl-examples/advection/advection.dpde", "ring", 128, ["1e-2", "1e-4"]),
    ("dsl-examples/heat/heat.dpde", "rod", 128, ["1e-3", "1e-5"]),
    ("dsl-examples/burgers_1d/burgers.dpde", "front", 64, ["1e-2", "1e-4"]),
    ("dsl-examples/burgers_1d/burgers.dpde", "ends", 128, ["1e-2", "1e-4"]),
    ("dsl-examples/wave/wave.dpde", "string", 100, ["1e-1", "1e-2"]),
]


def call(arguments):
    done = subprocess.run(arguments, capture_output=True, text=True)
    result = json.loads(done.stdout or "{}")
    if done.returncode != 0:
        print(" ".join(arguments), "->", done.returncode, done.stderr[-400:], file=sys.stderr)
    return result


def rungs(cells):
    lowest = min(1.0, 8 / cells)
    factors = []
    while lowest * 2 ** (len(factors) / 2) <= MOST_CELLS * (1 + 1e-9):
        factors.append(lowest * 2 ** (len(factors) / 2))
    return [round(cells * factor) for factor in factors]


def method_of(variant):
    return tuple(sorted((k, v) for k, v in variant.items() if not k.startswith("cells") and k not in ("step", "real")))


def sweep(dpde, file, scene, cells):
    """All points of all methods."""
    listed = call([dpde, "chart", file, scene, "--vary", f"cells={cells}", "--vary", "fraction=0.5"] + QUICK)
    points = []
    for method in sorted({method_of(p["variant"]) for p in listed["points"]}):
        vary = [argument for key, value in method for argument in ("--vary", f"{key}={value}")]
        vary += ["--vary", "cells=" + ",".join(map(str, rungs(cells))), "--vary", "fraction=" + FRACTIONS]
        points += call([dpde, "chart", file, scene, "--vary", "real=f32,f64"] + vary + QUICK).get("points", [])
    return points


def key_of(variant, cells):
    return method_of(variant), variant.get("real", "f64"), tuple(cells)


def step_seconds(points):
    """Of one step, by method, precision and cells."""
    seconds = {}
    for p in points:
        if not p["wall_s"]:
            continue
        key = key_of(p["variant"], p["cells"])
        one = min(p["wall_s_samples"]) * p["step"]
        seconds[key] = min(one, seconds.get(key, one))
    return seconds


def main():
    dpde = sys.argv[1]
    rows = []
    for file, scene, cells, tolerances in SCENES:
        points = sweep(dpde, file, scene, cells)
        seconds = step_seconds(points)
        ran = [p for p in points if p["error"] is not None and isinstance(p["error"], (int, float)) and p["steps"] > 0]
        cost = lambda p: p["steps"] * seconds[key_of(p["variant"], p["cells"])]
        for tolerance in tolerances:
            tuned = call([dpde, "tune", file, scene, "--tolerance", tolerance, "--most-cells", str(MOST_CELLS)] + QUICK)
            meeting = [p for p in ran if p["error"] <= float(tolerance)]
            row = {"scene": scene, "tolerance": tolerance, "sweep": len(ran), "tried": tuned.get("tried")}
            rows.append(row)
            if not meeting or not tuned.get("chosen"):
                continue
            best = min(meeting, key=cost)
            chosen = tuned["chosen"]
            steps = round(best["steps"] * best["step"] / chosen["step"])
            row["cost"] = steps * seconds.get(key_of(chosen_variant(chosen), chosen["cells"]), float("inf"))
            row["best"] = cost(best)
            row["ratio"] = row["cost"] / row["best"]
            row["chosen"] = describe(chosen, chosen["cells"], steps)
            row["cheapest"] = describe(best["variant"], best["cells"], best["steps"])
        for row in rows[-len(tolerances):]:
            print(row, flush=True)
    good = [row for row in rows if row.get("ratio", 9) <= 1.15]
    few = [row for row in rows if row["tried"] and row["tried"] <= row["sweep"] / 5]
    print(f"within 15 %: {len(good)} of {len(rows)}; at most a fifth of the runs: {len(few)} of {len(rows)}")
    if "--json" in sys.argv:
        with open(sys.argv[sys.argv.index("--json") + 1], "w", encoding="utf-8") as out:
            json.dump(rows, out, indent=1)


def chosen_variant(chosen):
    return {key: value for key, value in chosen.items() if key not in ("cells", "step")}


def describe(variant, cells, steps):
    method = " ".join(f"{k}={v}" for k, v in method_of(chosen_variant(variant))) or "own"
    return f"{method} {variant.get('real', 'f64')}, {cells[0]} cells, {steps} steps"


if __name__ == "__main__":
    main()
