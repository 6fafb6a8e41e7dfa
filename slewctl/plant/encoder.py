"""The noise of an encoder: its steps."""

from __future__ import annotations

import math

from slewctl.errors import check_count, check_positive


def encoder_noise(counts: int, sample_time: float) -> float:
    """Return the noise of an angle read by an encoder, for the ``noise`` of a problem.

    A step of 2π/N rad rounds each reading by up to half of it, which is an error of variance
    (2π/N)²/12 from one sample to the next where the angle moves by a step and more.  White
    noise of density n, averaged over a sample, has the variance n²/T: n = 2π/(N√12)·√T
    (Widrow and Kollár, Quantization Noise, Cambridge 2008, sections 1.2 and 4.2).

    Parameters
    ----------
    counts : int
        N per turn of the hub, after quadrature: four times the lines of the disk.
    sample_time : float
        T in s: the clock that it is read on.

    Returns
    -------
    float
        Square root of the two-sided spectral density, in rad/√Hz.

    Raises
    ------
    InputError
        If there is no count or the sample time is not positive.

    Examples
    --------
    >>> import slewctl as sc
    >>> f"{sc.encoder_noise(4096, sample_time=0.005):.2e}"
    '3.13e-05'
    """
    N = check_count(counts, "encoder_noise.counts")
    T = check_positive(sample_time, "encoder_noise.sample_time")
    return 2 * math.pi / (N * math.sqrt(12)) * math.sqrt(T)
