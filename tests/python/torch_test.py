# SPDX-License-Identifier: Apache-2.0
"""Scenes as operators of PyTorch: gradcheck, and a network that is trained through one."""
import unittest

import numpy as np

import dpde
from scene_test import carried, rod

try:
    import torch

    import dpde.torch
except ImportError:
    torch = None


@unittest.skipIf(torch is None, "there is no PyTorch")
class Operators(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        torch.manual_seed(1)
        cls.model = dpde.compile(rod)

    def tensor(self, *shape):
        return (0.3 * torch.randn(*shape, dtype=torch.float64)).requires_grad_()

    def test_loss(self):
        loss = dpde.torch.loss(self.model.scene("find"))
        k = torch.tensor(0.2, dtype=torch.float64, requires_grad=True)
        self.assertTrue(torch.autograd.gradcheck(lambda k, q: loss(k=k, q=q), (k, self.tensor(16))))
        self.assertFalse(loss(k=k.detach()).requires_grad)

    def test_end(self):
        end = dpde.torch.end(self.model.scene("plate", inputs=["u", "k", "q"]))
        k = torch.tensor(0.1, dtype=torch.float64, requires_grad=True)
        inputs = (self.tensor(12, 8), k, self.tensor(12, 8))
        self.assertTrue(torch.autograd.gradcheck(lambda u, k, q: end(u=u, k=k, q=q)["u"], inputs))

    def test_vector(self):
        end = dpde.torch.end(dpde.compile(carried).scene("box", inputs=["v"]))
        self.assertTrue(torch.autograd.gradcheck(lambda v: tuple(end(v=v).values()), (self.tensor(2, 6, 8),)))

    def test_two_uses_before_one_backward(self):
        end = dpde.torch.end(self.model.scene("rod", inputs=["u"]))
        first, second = self.tensor(16), self.tensor(16)
        (end(u=first)["u"].sum() + (end(u=second)["u"] ** 2).sum()).backward()
        alone = first.detach().clone().requires_grad_()
        end(u=alone)["u"].sum().backward()
        torch.testing.assert_close(first.grad, alone.grad)

    def test_no_second_derivative_is_0(self):
        """In no form, also where the incoming gradient is constant."""
        loss = dpde.torch.loss(self.model.scene("find"))
        end = dpde.torch.end(self.model.scene("rod", inputs=["k"]))
        k = torch.tensor(0.2, dtype=torch.float64, requires_grad=True)
        for of_k in (lambda k: loss(k=k), lambda k: loss(k=k) + k**2, lambda k: end(k=k)["u"].sum()):
            with self.assertRaisesRegex(RuntimeError, "no second derivatives"):
                torch.autograd.functional.hessian(of_k, k)
        first, = torch.autograd.grad(loss(k=k), k, create_graph=True)
        plain, = torch.autograd.grad(loss(k=k), k)
        self.assertEqual(first.item(), plain.item())
        with self.assertRaisesRegex(RuntimeError, "no second derivatives"):
            (first**2).backward()

    def test_backward_is_at_the_values_of_forward(self):
        scene = self.model.scene("rod", inputs=["u"])
        end = dpde.torch.end(scene)
        u = self.tensor(16)
        for change in (lambda: scene.set("k", 0.3), lambda: end(u=u, k=torch.tensor(0.4, dtype=torch.float64))):
            before = end(u=u)["u"]
            change()
            with self.assertRaisesRegex(dpde.InputError, "another point"):
                before.sum().backward()
        end(u=u)["u"].sum().backward()

    def test_a_vector_and_its_component(self):
        end = dpde.torch.end(dpde.compile(carried).scene("box", inputs=["v"]))
        with self.assertRaisesRegex(dpde.InputError, "v.x is given twice"):
            end({"v": self.tensor(2, 6, 8), "v.x": self.tensor(6, 8)})

    def test_single_precision(self):
        end = dpde.torch.end(self.model.scene("rod", inputs=["u"]))
        u = torch.zeros(16, requires_grad=True)
        end(u=u)["u"].sum().backward()
        self.assertEqual(u.grad.dtype, torch.float32)

    def test_network_learns_through_the_scene(self):
        """A network gives the heating whose temperature at the end is wanted."""
        scene = self.model.scene("rod", inputs=["q"])
        end, x = dpde.torch.end(scene), torch.from_numpy(scene.coordinates())
        wanted = torch.from_numpy(scene.run(q=np.cos(scene.coordinates())).u)
        features = torch.stack([torch.sin(x), torch.cos(x)], 1)
        network = torch.nn.Sequential(torch.nn.Linear(2, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1)).double()
        steps = torch.optim.Adam(network.parameters(), lr=0.03)
        losses = []
        for _ in range(150):
            steps.zero_grad()
            loss = ((end(q=network(features)[:, 0])["u"] - wanted) ** 2).mean()
            loss.backward()
            steps.step()
            losses.append(loss.item())
        self.assertLess(losses[-1], 1e-3 * losses[0])
        weight, d = network[0].weight, 1e-6
        value = lambda: ((end(q=network(features)[:, 0])["u"] - wanted) ** 2).mean()
        network.zero_grad()
        value().backward()
        with torch.no_grad():
            found = weight.grad[3, 1].item()
            weight[3, 1] += d
            above = value().item()
            weight[3, 1] -= 2 * d
            below = value().item()
        self.assertAlmostEqual(found, (above - below) / (2 * d), delta=1e-5 * abs(found) + 1e-10)

    def test_refusals(self):
        loss, end = dpde.torch.loss(self.model.scene("find")), dpde.torch.end(self.model.scene("rod", inputs=["q"]))
        with self.assertRaisesRegex(TypeError, "u is on meta.*u.cpu"):
            end(u=torch.zeros(16, device="meta"))
        with self.assertRaisesRegex(TypeError, "int64"):
            loss(q=torch.zeros(16, dtype=torch.int64))
        with self.assertRaisesRegex(ValueError, r"\(16,\)"):
            loss(q=torch.zeros(4))
        with self.assertRaisesRegex(ValueError, "u requires a gradient and is no unknown"):
            loss(u=torch.zeros(16, requires_grad=True))
        with self.assertRaisesRegex(ValueError, "opened with inputs"):
            dpde.torch.end(self.model.scene("rod"))
        q = torch.zeros(16, dtype=torch.float64, requires_grad=True)
        first = torch.autograd.grad((end(q=q)["u"] ** 2).sum(), q, create_graph=True)[0]
        with self.assertRaisesRegex(RuntimeError, "no second derivatives"):
            first.sum().backward()


if __name__ == "__main__":
    unittest.main()
