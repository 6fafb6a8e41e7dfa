"""What a command puts off is there as soon as something asks for it."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import LazyLoader

import numpy

from slewctl.cli.startup import _LATE, _Late


def test_only_what_no_command_uses_is_loaded_late() -> None:
    for name in _LATE:
        spec = _Late.find_spec(name, numpy.__path__)
        assert spec is not None
        assert isinstance(spec.loader, LazyLoader)
    assert _Late.find_spec("numpy.linalg", numpy.__path__) is None
    assert _Late.find_spec("no_such_module") is None


def test_what_is_put_off_is_whole_when_it_is_asked_for() -> None:
    code = (
        "import sys\n"
        "from slewctl.cli.startup import begin_sooner\n"
        "begin_sooner(); begin_sooner()\n"
        "import scipy.linalg\n"
        "late = {'numpy.f2py.crackfortran', 'numpy.testing._private.utils', 'unittest'}\n"
        "assert not late & set(sys.modules), late & set(sys.modules)\n"
        "import numpy as np\n"
        "np.testing.assert_allclose([1.0], [1.0])\n"
        "assert np.f2py.crackfortran.__name__ in sys.modules\n"
        "assert late <= set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
