# SPDX-License-Identifier: Apache-2.0
"""Scenes as operators of JAX: gradients against differences, jit, vmap, and a network that is trained through one."""
import unittest

import numpy as np

import dpde
from scene_test import carried, rod

try:
    import jax
    import jax.numpy as jnp

    import dpde.jax

    jax.config.update("jax_enable_x64", True)
except ImportError:
    jax = None


@unittest.skipIf(jax is None, "there is no JAX")
class Operators(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = dpde.compile(rod)

    def field(self, *shape):
        return 0.3 * np.random.default_rng(1).standard_normal(shape)

    def check(self, function, inputs, name):
        d, along = 1e-6, np.random.default_rng(2).standard_normal(np.shape(inputs[name]))
        slope = jnp.sum(jax.jit(jax.grad(function))(inputs)[name] * along)
        above, below = (function({**inputs, name: inputs[name] + s * along}) for s in (d, -d))
        change = (above - below) / (2 * d)
        self.assertAlmostEqual(float(slope), float(change), delta=1e-7 * abs(float(change)) + 1e-8)

    def test_loss(self):
        loss = dpde.jax.loss(self.model.scene("find"))
        for name in "kq":
            self.check(loss, {"k": 0.2, "q": self.field(16)}, name)

    def test_end(self):
        end = dpde.jax.end(self.model.scene("plate", inputs=["u", "k", "q"]))
        weights = self.field(12, 8)
        for name in "ukq":
            self.check(lambda inputs: jnp.sum(weights * end(inputs)["u"] ** 2),
                       {"u": self.field(12, 8), "k": 0.1, "q": self.field(12, 8)}, name)

    def test_vector(self):
        end = dpde.jax.end(dpde.compile(carried).scene("box", inputs=["v"]))
        self.check(lambda inputs: jnp.sum(end(inputs)["v.x"] ** 2), {"v": self.field(2, 6, 8)}, "v")

    def test_vmap(self):
        end = dpde.jax.end(self.model.scene("rod", inputs=["u"]))
        many = self.field(3, 16)
        found = jax.vmap(lambda u: end({"u": u})["u"])(many)
        np.testing.assert_allclose(found, [end({"u": u})["u"] for u in many], atol=0)

    def test_network_learns_through_the_scene(self):
        """A network gives the heating whose temperature at the end is wanted."""
        scene = self.model.scene("rod", inputs=["q"])
        end, x = dpde.jax.end(scene), scene.coordinates()
        wanted = scene.run(q=np.cos(x)).u
        features = jnp.stack([jnp.sin(x), jnp.cos(x)], 1)

        def loss(weights):
            q = jnp.tanh(features @ weights["a"] + weights["b"]) @ weights["c"]
            return jnp.mean((end({"q": q})["u"] - wanted) ** 2)

        random = np.random.default_rng(3)
        weights = {"a": 0.5 * random.standard_normal((2, 8)), "b": np.zeros(8), "c": 0.5 * random.standard_normal(8)}
        first, update = float(loss(weights)), jax.jit(jax.value_and_grad(loss))
        for _ in range(150):
            _, slopes = update(weights)
            weights = jax.tree_util.tree_map(lambda w, s: w - 0.3 * s, weights, slopes)
        self.assertLess(float(loss(weights)), 0.02 * first)
        self.check(loss, weights, "a")

    def test_backward_is_at_the_values_of_forward(self):
        scene = self.model.scene("rod", inputs=["u"])
        value, backward = jax.vjp(dpde.jax.end(scene), {"u": self.field(16)})
        backward(value)
        scene.set("k", 0.3)
        with self.assertRaisesRegex(Exception, "another point"):
            jax.block_until_ready(backward(value))

    def test_refusals(self):
        box = dpde.jax.end(dpde.compile(carried).scene("box", inputs=["v"]))
        with self.assertRaisesRegex(dpde.InputError, "v.x is given twice"):
            box({"v": self.field(2, 6, 8), "v.x": self.field(6, 8)})
        loss, end = dpde.jax.loss(self.model.scene("find")), dpde.jax.end(self.model.scene("rod", inputs=["q"]))
        with self.assertRaisesRegex(ValueError, "u is no unknown"):
            loss({"u": np.zeros(16)})
        with self.assertRaisesRegex(ValueError, r"\(16,\) is wanted, not of \(4,\)"):
            end({"q": np.zeros(4)})
        with self.assertRaisesRegex(TypeError, "int"):
            loss({"k": 1})
        with self.assertRaisesRegex(ValueError, "opened with inputs"):
            dpde.jax.end(self.model.scene("rod"))


if __name__ == "__main__":
    unittest.main()
