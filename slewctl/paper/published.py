"""The paper's printed numbers, digit by digit, and its printed asymptotic formulas.

`CITATION` says where: Table 1 (roots βL), Tables 2 and 3 (frequencies in Hz), and the
eigenvector matrices of eq. 49 and 50.  Nothing here is corrected; `slewctl.paper.errata` says
what is wrong.
"""

from __future__ import annotations

import math

TITLE = "New admissible functions for the dynamic analysis of a slewing flexible beam"
CITATION = f"M. K. Kwak, “{TITLE}”, Journal of Sound and Vibration 210(5), 581–594, 1998"

# How many digits after the point the paper prints.
ROOT_DECIMALS = 8
FREQUENCY_DECIMALS = 6
EIGENVECTOR_DECIMALS = 6

# Number of functions in eq. 49–50, in Figures 2–7 and at the end of Tables 2 and 3.
FUNCTIONS = 5

# Sampling period of the simulation in s, and the bang-bang torque of eq. 51 in N·m: it
# acts until the first switch, is reversed until the second, and is zero afterwards.
SAMPLE_TIME = 0.01
TORQUE = 1.0
SWITCHES = (2.0, 4.0)

# Eq. 48: m̄ in kg/m and EI in N·m² as powers of x/L, lowest first.
TAPER = (1.0, 0.0, 0.0, -5.0 / 6.0)

# Table 1, rows 1–5.
CLAMPED_FREE_ROOTS = (1.87510407, 4.69409113, 7.85475744, 10.99554073, 14.13716839)
SLEWING_ROOTS = (3.92660231, 7.06858275, 10.21017612, 13.35176878, 16.49336143)

# Table 2: first natural frequency in Hz with 1 … 5 functions.
FIRST_CLAMPED_FREE = (3.854694, 2.930974, 2.928103, 2.927335, 2.927334)
FIRST_SLEWING = (2.927607, 2.927560, 2.927343, 2.927314, 2.927301)

# Table 3: second natural frequency in Hz with 2 … 5 functions.
SECOND_CLAMPED_FREE = (12.951840, 8.786614, 8.769150, 8.760906)
SECOND_SLEWING = (8.762541, 8.762273, 8.760751, 8.760392)

# Eq. 49: eigenvectors of the model in five clamped-free functions, UᵀMU = I.
EIGENVECTORS_CLAMPED_FREE = (
    (2.267787, 5.973987, 10.450568, 14.779259, 18.824381, -95.476437),
    (0.000000, -3.003119, -4.111172, -6.356664, -7.731835, 39.922482),
    (0.000000, 0.595972, -1.590689, -1.119188, -1.983047, 8.759728),
    (0.000000, 0.013940, 0.747083, -1.065033, -0.419586, 3.248803),
    (0.000000, 0.003923, 0.031493, 0.824762, -0.884682, 1.560588),
    (0.000000, 0.000108, 0.014043, 0.050072, 0.904371, 1.355484),
)

# Eq. 50: the same in five slewing functions.
EIGENVECTORS_SLEWING = (
    (2.267787, 5.975217, 10.435494, 14.883058, 18.949607, -24.004572),
    (0.000000, -9.282804, 3.056031, -2.105336, 1.465521, 1.062884),
    (0.000000, -0.011770, -9.719819, 2.812153, -1.934332, -1.353335),
    (0.000000, -0.043659, 0.131443, -19.697137, 5.157328, 3.472750),
    (0.000000, 0.009925, -0.125682, 0.313478, -20.061953, -4.817372),
    (0.000000, -0.005877, 0.053944, -0.294990, 0.609829, 29.794938),
)


def clamped_free_asymptote(i: int) -> float:
    """Return (2i − 2)π/2, which Table 1 prints for the clamped-free roots with i ≥ 6."""
    return (2 * i - 2) * math.pi / 2


def slewing_asymptote(i: int) -> float:
    """Return (4i + 2)π/4, which Table 1 prints for the pinned-free roots with i ≥ 6."""
    return (4 * i + 2) * math.pi / 4
