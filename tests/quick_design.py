"""A design file that is judged in a fraction of a second."""

QUICK = """\
[arm]
catalogue = "paper-beam"
damping_ratio = 0.01
hub = { inertia = 0.2 }
[model]
basis = "clamped-free"
n = 2
[controller]
method = "lqg"
limits = { tip = 0.03, torque = 1.0 }
noise = { torque = 0.1, theta = 0.01, theta_dot = 0.1 }
[slew]
angle_deg = 30
duration_s = 2
[truth]
modes = 5
[requirements]
gain_margin_db = 6
"""
