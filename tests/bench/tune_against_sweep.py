#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does `dpde tune` choose what a sweep of everything would have chosen, and with how many runs?

For each scene every method that tune tries is run on every rung of its ladder of grids, with three steps and both
precisions. A sweep takes minutes, in which a machine is now slow and now fast, so that its timings say only which
points may be the cheapest: the best RIVALS of them that meet the tolerance and tune's choice are then timed again in
turn, ROUNDS times, and the least that each of them took counts. test_chart does the same with costs that are counted.

    tests/bench/tune_against_sweep.py build/bin/dpde [--json FILE]
"""
import json
import subprocess
import sys

MOST_CELLS = 4
RIVALS = 6
ROUNDS = 7
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


def timed(dpde, file, scene, points):
    """Seconds of a unit of time, the least of all rounds."""
    least = [float("inf")] * len(points)
    for _ in range(ROUNDS):
        for i, p in enumerate(points):
            vary = [argument for key, value in method_of(p["variant"]) for argument in ("--vary", f"{key}={value}")]
            vary += ["--vary", f"real={p['variant'].get('real', 'f64')}", "--vary", f"cells={p['cells'][0]}"]
            found = call([dpde, "chart", file, scene, "--vary", f"step={p['step']!r}"] + vary + QUICK)["points"][0]
            least[i] = min(least[i], *found["wall_s_samples"])
    return least


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
            chosen = tuned.get("chosen")
            if not meeting or not chosen:
                continue
            steps = round(meeting[0]["steps"] * meeting[0]["step"] / chosen["step"])
            chosen = {"variant": chosen_variant(chosen), "cells": chosen["cells"], "step": chosen["step"], "steps": steps}
            both = [chosen] + sorted(meeting, key=cost)[:RIVALS]
            least = timed(dpde, file, scene, both)
            best = min(range(len(both)), key=least.__getitem__)
            row["ratio"] = least[0] / least[best]
            row["chosen"], row["cheapest"] = describe(chosen), describe(both[best])
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


def describe(p):
    method = " ".join(f"{k}={v}" for k, v in method_of(p["variant"])) or "own"
    return f"{method} {p['variant'].get('real', 'f64')}, {p['cells'][0]} cells, {p['steps']} steps"


if __name__ == "__main__":
    main()
