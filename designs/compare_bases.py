"""The comparison report of one arm, from Python: python designs/compare_bases.py [FOLDER]."""

import sys
from pathlib import Path

import slewctl as sc
from slewctl.compare import Case, compare
from slewctl.report import write_comparison

arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.02), damping_ratio=0.005)
objective = sc.Objective(
    limits={"tip": 0.03, "torque": 1.0},
    noise={"torque": 0.1, "theta": 0.01, "theta_dot": 0.1},
)
case = Case(
    name="light-hub",
    title="The paper's beam on a hub with a tenth of its inertia",
    arm=arm,
    objective=objective,
    basis="clamped-free",
    n=2,
    slew=sc.Slew(angle_deg=30.0, duration_s=2.0),
)
folder = Path(sys.argv[1] if len(sys.argv) > 1 else "reports/light-hub")
print(write_comparison(compare([case]), folder))
