"""What the kernels of the gallery are told: vectors for figures, a look for them, no remarks."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from pathlib import Path

from sphinx.application import Sphinx

KERNEL = """c = get_config()
c.InlineBackend.figure_formats = ["svg"]
c.IPKernelApp.log_level = 40  # it would remark at each start that its sockets are local
c.HistoryManager.enabled = False
"""


def beside_the_pages(app: Sphinx) -> None:
    """Keep what was run within the built guide, from where it is downloaded."""
    folder = Path(app.outdir) / "_notebooks"
    app.env.mystnb_config = app.env.mystnb_config.copy(output_folder=str(folder))  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, bool]:
    folder = Path(tempfile.mkdtemp(prefix="slewctl-docs-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    profile = folder / "profile_default"
    profile.mkdir()
    (profile / "ipython_kernel_config.py").write_text(KERNEL, encoding="utf-8")
    os.environ["IPYTHONDIR"] = str(folder)
    os.environ["MATPLOTLIBRC"] = str(Path(__file__).with_name("matplotlibrc"))
    app.connect("builder-inited", beside_the_pages, priority=900)  # after myst_nb
    return {"parallel_read_safe": True}
