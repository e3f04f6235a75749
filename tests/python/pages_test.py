# SPDX-License-Identifier: Apache-2.0
"""The manual's page and the notebooks run as they stand, in the folder that their paths are of."""
import contextlib
import importlib.util
import io
import json
import os
import pathlib
import re
import unittest

root = pathlib.Path(__file__).resolve().parents[2]
manual = root / "dsl-examples" / "manual" / "python.md"
notebooks = root / "dsl-examples" / "python"


def run(cells, where):
    names = {}
    folder = os.getcwd()
    os.chdir(root)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            for number, cell in enumerate(cells, 1):
                exec(compile(cell, f"{where}, cell {number}", "exec"), names)
    finally:
        os.chdir(folder)
    return names


class Pages(unittest.TestCase):
    def test_manual(self):
        blocks = re.findall(r"^```python ?(\w*)\n(.*?)^```", manual.read_text(), re.M | re.S)
        self.assertGreater(len(blocks), 4)
        names = run([code for needs, code in blocks if not needs or importlib.util.find_spec(needs)], "python.md")
        self.assertAlmostEqual(names["task"].unknown("kappa"), 0.1, places=2)

    def test_notebooks(self):
        books = sorted(notebooks.glob("*.ipynb"))
        self.assertEqual(len(books), 2)
        for book in books:
            with self.subTest(book.name):
                cells = [cell for cell in json.loads(book.read_text())["cells"] if cell["cell_type"] == "code"]
                self.assertFalse([cell for cell in cells if cell["outputs"]], "outputs are to be stripped")
                names = run(["".join(cell["source"]) for cell in cells], book.name)
                self.assertIn("<svg" if book.stem == "find_the_start" else "image/png", names["result"]._repr_html_())


if __name__ == "__main__":
    unittest.main()
