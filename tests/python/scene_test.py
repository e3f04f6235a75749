# SPDX-License-Identifier: Apache-2.0
"""Values, runs and derivatives from NumPy, against closed forms and differences, and what is refused."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import threading
import unittest
import warnings

import numpy as np

import dpde

rod = """model heat { field u; param k; coefficient q
  dt(u) = k*lap(u) + q }
scheme ftcs { lap = central(2); time = euler }
scene rod : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.3
  q = 0
  initial u = sin(x)
  observe size = mean(u^2)
  time 0 .. 1, step 1/8
}
scene plate : heat with ftcs {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 12, periodic
  k = 0.1
  q = 0
  initial u = sin(x)*cos(y) + sin(y)
  time 0 .. 1, step 1/8
}
task find : rod {
  data r = u from scene rod at t = 1
  unknown k from 0.25
  unknown q from 0.1
  minimise mean((u - r)^2) at t = 1
  using lbfgs(), iterations 20
}
"""

carried = """model flow { vector v; param nu
  dt(v) = -advect(v, v) + nu*lap(v) }
scene box : flow {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 6, periodic
  nu = 0.01
  initial v.x = sin(2*pi*y)
  initial v.y = cos(2*pi*x)
  time 0 .. 0.1, step 1/80
}
"""


several = """model m { field c[2]; coefficient vector w; param A[2, 2] = ((0.1, 0.2), (0.3, 0.4))
  dt(c[i]) = -advect(w, c[i]) - sum(A[i, j]*c[j], j) }
scene box : m {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 6, periodic
  w = (1, 2)
  initial c[i] = sin(2*pi*x)*i
  time 0 .. 0.1, step 1/80
}
"""


def scale(k, cells=16):
    h = 2 * np.pi / cells
    return 1 - 4 * k * 0.125 / h**2 * np.sin(h / 2) ** 2


class Growth(unittest.TestCase):
    text = """model heat { field u; param D = 0.05; dt(u) = D*lap(u) }
scheme forward { time = euler }
scene rod : heat with forward {
  grid x = 0 .. 1, cells 50, periodic; initial u = exp(-20*(x - 0.3)^2); time 0 .. 1, step 1/400 }
task fit : rod { unknown D; minimise mean(u^2) at t = 1 }
"""

    def test_steps_that_are_too_large_for_a_parameter_are_said(self):
        model = dpde.compile(self.text)
        rod, fit = model.scene("rod"), model.scene("fit")
        for call in (lambda: rod.run(D=0.12), lambda: fit.gradient(D=0.12), lambda: fit.loss(D=0.12)):
            with self.assertRaisesRegex(dpde.NotFiniteError, "u has grown from .* may be too large"):
                call()
        with self.assertWarnsRegex(dpde.CompilerWarning, "u has grown from 1 to "):
            rod.run(D=0.083, u=(-1.0) ** np.arange(50))
        self.assertLess(rod.run(D=0.05).u.max(), 1)

    def test_losses_and_gradients_say_it_once_of_each_set(self):
        fit = dpde.compile(self.text).scene("fit")
        fit.set("u", (-1.0) ** np.arange(50))
        for call in (fit.loss, fit.gradient):
            with self.assertWarnsRegex(dpde.CompilerWarning, "u has grown from 1 to ") as caught:
                call(D=0.083)
            self.assertEqual([m.code for m in caught.warning.messages], ["W0801"])
            self.assertEqual(caught.filename, __file__)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                fit.loss(), fit.gradient()
                call(D=0.05)


class Lock(unittest.TestCase):
    """The package of the build looks whether Python's lock is held wherever an object is touched."""

    def test_threads_that_run_scenes_at_once(self):
        model = dpde.compile("model o { field a; dt(a) = -a } scheme e { time = euler } "
                             "scene s : o with e { initial a = 1; time 0 .. 2000, step 1/8 }")
        scenes = [model.scene("s") for _ in range(2)]
        failures = []

        def work(scene):
            try:
                scene.run(progress=lambda now: True, every=300)
            except dpde.Error as error:
                failures.append(error)

        threads = [threading.Thread(target=work, args=(scene,)) for scene in scenes]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])


class Several(unittest.TestCase):
    """Vectors of coefficients and elements of arrays by name."""

    def test_by_name(self):
        model = dpde.compile(several)
        scene = model.scene("box", inputs=["c", "w", "A[1, 2]"])
        self.assertEqual(set(scene.unknowns), {"c_1", "c_2", "w.x", "w.y", "A_1_2"})
        rng = np.random.default_rng(4)
        w, seeds = rng.standard_normal((2, 6, 8)), {"c_1": rng.standard_normal((6, 8))}
        self.assertEqual(scene.shape_of("w"), (2, 6, 8))
        slopes = scene.vjp(seeds, w=w)
        along, d = rng.standard_normal((2, 6, 8)), 1e-5
        ends = [np.sum(scene.run(w=w + sign * d * along)["c_1"] * seeds["c_1"]) for sign in (1, -1)]
        there = np.sum(slopes["w.x"] * along[0]) + np.sum(slopes["w.y"] * along[1])
        self.assertAlmostEqual(there, (ends[0] - ends[1]) / (2 * d), delta=1e-6 * abs(there))
        self.assertEqual(model.scene("box", inputs=["c[2]"]).unknowns, ["c_2"])

    def test_seeds_of_a_vector(self):
        scene = dpde.compile(carried).scene("box", inputs=["nu"])
        seed = np.random.default_rng(5).standard_normal((2, 6, 8))
        self.assertEqual(scene.vjp({"v": seed}), scene.vjp({"v.x": seed[0], "v.y": seed[1]}))


class Runs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = dpde.compile(rod)
        cls.rod = cls.model.scene("rod")

    def test_names(self):
        self.assertEqual((self.model.scenes, self.model.tasks), (["rod", "plate"], ["find"]))
        self.assertEqual((self.rod.params, self.rod.states, self.rod.unknowns), (["k"], ["u"], []))
        self.assertEqual(self.model.scene("plate").shape, (12, 8))
        self.assertIn("16 cells", repr(self.rod))

    def test_units(self):
        scene = dpde.compile("model m { vector v in m/s; param k = 1 in 1/s; dt(v) = -k*v }\nscene s : m {\n"
                             "  grid x = 0 .. 1 in m, cells 2, periodic\n  initial v = 1\n"
                             "  time 0 .. 1 in s, step 1\n}\n").scene()
        units = [scene.unit(name) for name in ("v", "v.x", "k", "x", "t", "other")]
        self.assertEqual(units, ["m/s", "m/s", "1/s", "m", "s", ""])

    def test_data_of_one_number_a_time(self):
        text = rod + ("scene other = rod { k = 0.2 }\ntask levels : rod {\n  data d = size from scene other at t = 0.5, 1\n"
                      "  unknown k\n  minimise (mean(u^2) - d)^2 at t = 0.5, 1\n}\n")
        scene = dpde.compile(text).scene("levels")
        self.assertEqual(scene.shape_of("d"), (2,))
        sizes = []
        for until in (0.5, 1):
            scene.run_to(until)
            sizes.append(np.mean(scene.state("u")**2))
        self.assertAlmostEqual(scene.loss(d=[sizes[0] + 0.1, sizes[1] - 0.2]), 0.1**2 + 0.2**2, places=12)
        with self.assertRaisesRegex(ValueError, r"\(2,\)"):
            scene.set("d", np.zeros((2, 16)))

    def test_closed_form(self):
        x = self.rod.coordinates()
        result = self.rod.run(u=2 * np.sin(x), k=0.2, q=np.zeros(16))
        np.testing.assert_allclose(result.u, 2 * scale(0.2) ** 8 * np.sin(x), atol=1e-14)
        self.assertEqual((result.time, result.steps), (1, 8))
        self.assertAlmostEqual(self.rod.observe("size"), 2 * scale(0.2) ** 16, places=13)
        self.assertIs(result["u"], result.u)
        self.assertIn("<svg", result._repr_html_())

    def test_steps_go_on(self):
        self.rod.run(k=0.2, u=np.sin(self.rod.coordinates()), until=0.5)
        self.rod.step(2)
        self.rod.run_to()
        out = np.empty(16)
        self.assertIs(self.rod.state("u", out), out)
        np.testing.assert_allclose(out, scale(0.2) ** 8 * np.sin(self.rod.coordinates()), atol=1e-14)

    def test_x_is_the_last_axis(self):
        plate = self.model.scene("plate")
        y, x = np.meshgrid(plate.coordinates(1), plate.coordinates(0), indexing="ij")
        np.testing.assert_allclose(plate.initial("u"), np.sin(x) * np.cos(y) + np.sin(y), atol=1e-14)
        self.assertIn("data:image/png", plate.run()._repr_html_())

    def test_vectors(self):
        box = dpde.compile(carried).scene("box")
        v = np.random.default_rng(1).standard_normal((2, 6, 8)) * 0.1
        whole = box.run(v=v)
        parts = box.run({"v.x": v[0], "v.y": v[1]})
        np.testing.assert_array_equal(whole.v, parts.v)
        self.assertEqual(whole.v.shape, (2, 6, 8))

    def test_arrays_of_other_kinds(self):
        u = np.sin(self.rod.coordinates())
        expected = self.rod.run(u=u, k=0.2).u
        np.testing.assert_array_equal(self.rod.run(u=list(u)).u, expected)
        np.testing.assert_array_equal(self.rod.run(u=np.repeat(u, 2)[::2]).u, expected)

        class Foreign:  # of another library
            def __dlpack__(self, **options):
                return u.__dlpack__(**options)

            def __dlpack_device__(self):
                return u.__dlpack_device__()

        np.testing.assert_array_equal(self.rod.run(u=Foreign()).u, expected)
        np.testing.assert_array_equal(np.from_dlpack(expected), expected)

    def test_progress_and_stop(self):
        seen = []
        self.rod.run(progress=seen.append, every=3)
        self.assertEqual([p.done for p in seen], [3, 6, 8])
        with self.assertRaises(dpde.Stopped):
            self.rod.run(progress=lambda p: False, every=1)

    def test_progress_raises(self):
        def fail(progress):
            raise KeyError("mine")

        with self.assertRaisesRegex(KeyError, "mine"):
            self.rod.run(progress=fail)
        self.assertEqual(self.rod.run().steps, 8)  # and it is whole

    def test_ctrl_c(self):
        long = dpde.compile(rod).scene("rod", end=1e8, k=0.01, force=True)
        timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            long.run()
        timer.join()

    def test_ctrl_c_ends_losses_and_rare_reports(self):
        text = rod.replace("time 0 .. 1,", "time 0 .. 1e8,").partition("task find")[0]
        text += "task long : rod { unknown k from 0.1; minimise mean(u^2) at t = 1e8 }"
        find = dpde.compile(text).scene("long", slots=8, certify=False)
        for call in (find.loss, lambda: find.gradient(every=10**9), lambda: find.run(every=10**9)):
            timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                call()
            timer.join()

    def test_progress_comes_every_so_many_steps(self):
        scene = dpde.compile(rod).scene("rod", step=1/1024)
        seen = []
        scene.run(every=300, progress=lambda p: seen.append(p.done))
        self.assertEqual(seen[:3], [300, 600, 900])

    def test_warnings(self):
        text = rod.replace("model heat {", "model heat { param spare = 1;")
        with self.assertWarnsRegex(dpde.CompilerWarning, "spare") as caught:
            dpde.compile(text).scene("rod")
        self.assertEqual(caught.warning.messages[0].severity, "warning")

    def test_one_call_at_a_time(self):
        with self.assertRaisesRegex(RuntimeError, "in use"):
            self.rod.run(progress=lambda p: self.rod.state("u"))


class Records(unittest.TestCase):
    """Files of a run, which are those of the command (tests/hosts/recorder_test.cpp compares all formats)."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)

    def test_a_run_is_the_files_of_the_command(self):
        (self.path / "rod.dpde").write_text(rod)
        subprocess.run([os.environ["DPDE_COMMAND"], "run", "rod.dpde", "rod", "--quiet", "--every", "3", "--out", "c"],
                       cwd=self.path, check=True)
        scene = dpde.compile(str(self.path / "rod.dpde")).scene("rod")
        with scene.record(self.path / "p", every=3):
            scene.run(progress=lambda now: True, every=2)
        names = {"u.npy", "u_over_time.npy", "observables.csv", "rod.nc"}
        pictures = {f"rod{what}.{kind}" for what in ("", "_observables") for kind in ("svg", "png")}
        self.assertEqual({file.name for file in (self.path / "p").iterdir()},
                         names | (pictures if shutil.which("gnuplot") else set()))
        for name in names - {"rod.nc"}:
            self.assertEqual((self.path / "p" / name).read_bytes(), (self.path / "c" / name).read_bytes(), name)
        self.assertEqual(np.load(self.path / "p" / "u_over_time.npy").shape, (4, 16))

    def test_a_run_goes_on_from_a_checkpoint(self):
        whole, first, second = (dpde.compile(rod).scene("rod") for _ in range(3))
        whole.run_to()
        with first.record(self.path, every=2, checkpoint_every=3, resume=True) as is_resumed:
            self.assertFalse(is_resumed)
            first.run_to(0.5)
        with second.record(self.path, every=2, resume=True) as is_resumed:
            self.assertTrue(is_resumed)
            self.assertEqual(second.steps_done, 3)
            second.run_to()
        np.testing.assert_array_equal(second.state("u"), whole.state("u"))
        before = (self.path / "u_over_time.npy").read_bytes()
        first.reset()
        with self.assertRaisesRegex(dpde.InputError, "set of parameters"):
            with dpde.compile(rod).scene("rod", k=0.2).record(self.path, every=2, resume=True):
                pass
        self.assertEqual((self.path / "u_over_time.npy").read_bytes(), before)  # a refusal writes nothing
        self.assertEqual(np.load(self.path / "u_over_time.npy").shape, (5, 16))

    def test_what_ends_early_is_recorded_until_then(self):
        scene = dpde.compile(Growth.text).scene("rod")
        with self.assertRaises(dpde.NotFiniteError):
            with scene.record(self.path, every=50):
                scene.run(D=0.12)
        states = np.load(self.path / "u_over_time.npy")
        self.assertGreater(len(states), 2)
        with scene.record(self.path):  # nothing ran: the present state
            pass
        with self.assertRaisesRegex(dpde.InputError, "one run"):
            with scene.record(self.path):
                scene.run(D=0.05)
                scene.run(D=0.05)

    def test_refusals(self):
        scene = dpde.compile(rod).scene("rod")
        with self.assertRaisesRegex(dpde.InputError, "every -1 steps cannot be recorded: take 1 or more"):
            with scene.record(self.path / "none", every=-1):
                pass
        self.assertFalse((self.path / "none").exists())
        with self.assertRaisesRegex(dpde.InputError, "recorded already: end that record first"):
            with scene.record(self.path), scene.record(self.path):
                pass


class Derivatives(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = dpde.compile(rod)
        cls.find = cls.model.scene("find", second_order=True)

    def test_gradient_is_a_difference(self):
        q = np.random.default_rng(2).standard_normal(16)
        value, slopes = self.find.gradient(k=0.2, q=q)
        d = 1e-6
        by_k = (self.find.loss(k=0.2 + d) - self.find.loss(k=0.2 - d)) / (2 * d)
        self.assertAlmostEqual(slopes["k"], by_k, delta=1e-8 * abs(by_k) + 1e-8)
        along = np.random.default_rng(3).standard_normal(16)
        by_q = (self.find.loss(k=0.2, q=q + d * along) - self.find.loss(q=q - d * along)) / (2 * d)
        self.assertAlmostEqual(slopes["q"] @ along, by_q, delta=1e-7)
        self.assertAlmostEqual(value, self.find.loss(q=q), places=15)

    def test_hessian_is_a_difference(self):
        q, d = np.full(16, 0.1), 1e-6
        product = self.find.hessian_vector({"k": 1.0}, k=0.25, q=q)
        above, below = self.find.gradient(k=0.25 + d)[1], self.find.gradient(k=0.25 - d)[1]
        self.assertAlmostEqual(product["k"], (above["k"] - below["k"]) / (2 * d), places=6)
        np.testing.assert_allclose(product["q"], (above["q"] - below["q"]) / (2 * d), atol=1e-7)
        square = self.find.hessian_vector({"k": 1.0}, k=0.25, gauss_newton=True)
        self.assertGreater(square["k"], 0)

    def test_optimise(self):
        find = self.model.scene("find")
        losses = []
        done = find.optimise(progress=lambda p: losses.append(p.loss))
        self.assertLess(done.loss, 1e-3 * losses[0])
        self.assertEqual(find.unknown("q").shape, (16,))
        self.assertIsInstance(find.unknown("k"), float)

    def test_progress_of_a_gradient(self):
        seen = []
        self.find.gradient(progress=seen.append, every=2)
        self.assertTrue(seen)
        with self.assertRaises(dpde.Stopped):
            self.find.gradient(progress=lambda p: False, every=1)
        self.find.gradient()

    def test_vjp(self):
        random = np.random.default_rng(4)
        scene = self.model.scene("plate", inputs=["u", "k", "q"])
        u, q, seed = (random.standard_normal((12, 8)) for _ in range(3))
        slopes = scene.vjp({"u": seed}, u=u, q=q, k=0.1)

        def value(u, q, k):
            return np.sum(seed * scene.run(u=u, q=q, k=k).u)

        d = 1e-6
        by_k = (value(u, q, 0.1 + d) - value(u, q, 0.1 - d)) / (2 * d)
        self.assertAlmostEqual(slopes["k"], by_k, delta=1e-7 * abs(by_k) + 1e-7)
        for name in "uq":
            along = random.standard_normal((12, 8))
            above, below = ({"u": u, "q": q, name: {"u": u, "q": q}[name] + s * along} for s in (d, -d))
            change = (value(k=0.1, **above) - value(k=0.1, **below)) / (2 * d)
            self.assertAlmostEqual(np.sum(slopes[name] * along), change, delta=1e-7 * abs(change) + 1e-7)

    def test_vjp_of_a_vector(self):
        random = np.random.default_rng(5)
        scene = dpde.compile(carried).scene("box", inputs=["v", "nu"])
        v, along, seed = (0.1 * random.standard_normal((2, 6, 8)) for _ in range(3))
        slopes = scene.vjp({"v.x": seed[0], "v.y": seed[1]}, v=v)
        d = 1e-6
        change = np.sum(seed * (scene.run(v=v + d * along).v - scene.run(v=v - d * along).v)) / (2 * d)
        found = np.sum(slopes["v.x"] * along[0] + slopes["v.y"] * along[1])
        self.assertAlmostEqual(found, change, delta=1e-7 * abs(change))


class Refusals(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = dpde.compile(rod)
        cls.rod = cls.model.scene("rod")

    def refused(self, error, text, call):
        with self.assertRaisesRegex(error, text):
            call()

    def test_texts(self):
        with self.assertRaises(dpde.InputError) as caught:
            dpde.compile(rod.replace("lap(u)", "lapp(u)"), path="mine.dpde")
        first = caught.exception.messages[0]
        self.assertEqual((first.code, first.file, first.line, first.column), ("E0302", "mine.dpde", 2, 13))
        self.assertIn("did you mean lap?", str(caught.exception))
        self.assertIn("^~~~", caught.exception._repr_html_())
        self.refused(dpde.InputError, "error", lambda: dpde.compile("model {"))
        self.refused(dpde.InputError, "nowhere.dpde", lambda: dpde.compile("nowhere.dpde"))
        self.refused(dpde.InputError, "NUL", lambda: dpde.compile("a\0b{"))
        self.refused(TypeError, "a text or a path", lambda: dpde.compile(3))

    def test_scenes(self):
        self.refused(dpde.InputError, "nothing", lambda: self.model.scene("nothing"))
        self.refused(TypeError, "the name of a scene", lambda: self.model.scene(3))
        self.refused(dpde.InputError, "cels", lambda: self.model.scene("rod", cels=3))
        self.refused(dpde.RunError, "largest stable", lambda: self.model.scene("rod", cells=400))
        self.refused(dpde.InputError, "back end", lambda: self.model.scene("rod", backend="gpu"))
        self.refused(dpde.InputError, "nothing is not known", lambda: self.model.scene("rod", inputs=["nothing"]))
        self.refused(dpde.InputError, "opened with inputs", lambda: self.rod.vjp({}))
        with_inputs = self.model.scene("rod", inputs=["k"])
        self.refused(dpde.InputError, "no loss of its own", with_inputs.loss)
        self.refused(dpde.InputError, "no loss of its own", with_inputs.gradient)

    def test_progress_of_a_refused_call(self):
        """It takes nothing away from the call that runs; NumPy's False stops that one."""
        find, told = self.model.scene("find"), []

        def progress(now):
            told.append(now.done)
            self.refused(RuntimeError, "in use", lambda: find.gradient(progress=lambda other: told.append("other")))
            return np.False_ if len(told) == 3 else None

        with self.assertRaises(dpde.Stopped):
            find.gradient(progress=progress, every=1)
        self.assertEqual(len(told), 3)
        self.assertNotIn("other", told)
        self.refused(ValueError, "every", lambda: find.gradient(every=0))

    def test_arrays(self):
        u = np.zeros(16)
        self.refused(TypeError, "u: .*float64 is wanted, not of float32", lambda: self.rod.run(u=u.astype("f")))
        self.refused(TypeError, "complex", lambda: self.rod.run(u=u + 0j))
        self.refused(TypeError, "float64", lambda: self.rod.run(u="hot"))
        self.refused(TypeError, "no array", lambda: self.rod.run(u=[1, [2]]))
        self.refused(TypeError, "float64", lambda: self.rod.run(u=u.astype(">f8")))
        self.refused(TypeError, "without a mask", lambda: self.rod.run(u=np.ma.masked_less(u, 0.5)))
        self.refused(ValueError, r"shape \(16,\) is wanted, not of \(4, 4\)", lambda: self.rod.run(u=np.zeros((4, 4))))
        self.refused(ValueError, r"q: .*\(16,\)", lambda: self.rod.run(q=0.5))
        self.refused(TypeError, "k: one number", lambda: self.rod.run(k=[1, 2]))
        self.refused(dpde.InputError, "did you mean k?", lambda: self.rod.run(kk=1))
        self.refused(ValueError, "out", lambda: self.rod.state("u", np.zeros(32)[::2]))
        self.refused(ValueError, "out", lambda: self.rod.state("u", np.zeros(16, "f")))
        fixed = np.zeros(16)
        fixed.flags.writeable = False
        self.refused(ValueError, "written", lambda: self.rod.state("u", fixed))

    def test_devices(self):
        class Far:
            def __dlpack__(self, **options):
                raise AssertionError("is not asked")

            def __dlpack_device__(self):
                return (2, 0)

        self.refused(TypeError, "a CUDA device", lambda: self.rod.run(u=Far()))

    def test_values_that_are_not_finite(self):
        self.refused(dpde.RunError, "not finite", lambda: self.rod.run(u=np.full(16, np.nan)))
        self.rod.run(u=np.zeros(16))

    def test_derivatives(self):
        self.refused(dpde.InputError, "task", self.rod.gradient)
        find = self.model.scene("find")
        self.refused(dpde.InputError, "second", lambda: find.hessian_vector({"k": 1.0}))
        self.refused(dpde.InputError, "not an unknown", lambda: find.hessian_vector({"u": 1.0}))


if __name__ == "__main__":
    unittest.main()
