# SPDX-License-Identifier: Apache-2.0
"""What `dpde run --out` writes, read by VTK's readers of NetCDF (CF conventions) and XDMF, as ParaView has them."""

import importlib.util
import os
import pathlib
import subprocess
import tempfile
import unittest

TEXT = """
model waves { field u in K; vector v on faces; param k = 1 in m^2/s, r = 1 in 1/s, g = 1 in K/m
  dt(u) = k*lap(u) - r*u; dt(v) = -r*v }
scene box : waves {
  grid x = 0 .. 1 in m, cells 4, periodic
  grid y = 0 .. 2 in m, cells 5, periodic
  grid z = 0 .. 3 in m, cells 6, periodic
  initial u = g*(x + 10*y + 100*z)
  initial v = (1, 2, 3)
  time 0 .. 1e-3 in s, step 5e-4
}
"""


@unittest.skipUnless(importlib.util.find_spec("vtk"), "VTK is not installed")
class FilesInVtk(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "box.dpde").write_text(TEXT)
        command = os.environ.get("DPDE_COMMAND", pathlib.Path(__file__).parents[2] / "build/bin/dpde")
        arguments = ["run", "box.dpde", "box", "--quiet", "--every", "1", "--out", "."]
        subprocess.run([command, *arguments], cwd=self.folder, check=True)

    def test_netcdf(self):
        import vtk

        reader = vtk.vtkNetCDFCFReader()
        reader.SetFileName(str(self.folder / "box.nc"))
        reader.SphericalCoordinatesOff()
        reader.UpdateInformation()
        names = [reader.GetVariableArrayName(i) for i in range(reader.GetNumberOfVariableArrays())]
        self.assertEqual(names, ["u", "v_x", "v_y", "v_z"])
        for dimensions, name in [("(z, y, x)", "u"), ("(z, y, x_faces)", "v_x"), ("(z_faces, y, x)", "v_z")]:
            reader.SetDimensions(dimensions)
            reader.UpdateTimeStep(0)
            grid = reader.GetOutput()
            self.assertEqual(grid.GetDimensions(), (4, 5, 6))
            self.assertEqual(grid.GetPointData().GetNumberOfArrays(), 1)
            low, high = grid.GetPointData().GetArray(name).GetRange()
            if name == "u":  # of the first state: g*(x + 10*y + 100*z) at the first and last centres
                self.assertAlmostEqual(low, 0.125 + 2 + 25, delta=1e-12)
                self.assertAlmostEqual(high, 0.875 + 18 + 275, delta=1e-12)
                self.assertAlmostEqual(grid.GetSpacing()[2], 0.5, delta=1e-12)
            else:
                self.assertEqual(low, high)

    def test_xdmf(self):
        import vtk

        reader = vtk.vtkXdmfReader()
        reader.SetFileName(str(self.folder / "box.xdmf"))
        reader.UpdateTimeStep(0)
        grid = reader.GetOutputDataObject(0)
        self.assertEqual(grid.GetDimensions(), (5, 6, 7))  # corners of the cells
        self.assertAlmostEqual(grid.GetCellData().GetArray("u").GetRange()[0], 27.125, delta=1e-12)


if __name__ == "__main__":
    unittest.main()
