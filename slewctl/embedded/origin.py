"""Where a program comes from, in lines for its head: nothing of when, and of no machine."""

from __future__ import annotations

import math

from slewctl.compare import QUANTITIES, Judgement, read, sampling_loss

_TOLD = (
    "gain_margin_db", "phase_margin_deg", "delay_margin_s", "modulus_margin", "disk_margin",
)  # fmt: skip


def provenance(judgement: Judgement, design: str, digest: str, version: str) -> tuple[str, ...]:
    """Return what is said of a judged controller.

    Parameters
    ----------
    judgement : Judgement
        Of a stable loop.
    design : str
        Name of the design.
    digest : str
        Of its file.
    version : str
        Of slewctl.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> from slewctl.embedded import provenance
    >>> K = sc.lqg(problem.plant("clamped-free", n=1))
    >>> provenance(problem.judge(K), "arm", "sha256:0", "1.0")[0]
    'Design arm (sha256:0), slewctl 1.0.'
    """
    controller = judgement.controller
    clock = "continuous"
    if controller.sample_time:
        clock = f"every {controller.sample_time:g} s, {controller.delay:g} s late"
    parts = []
    for name in _TOLD:
        value = read(judgement, name).value
        unit = QUANTITIES[name].unit
        words = name.removesuffix("_db").removesuffix("_deg").removesuffix("_s").replace("_", " ")
        if not math.isnan(value):
            parts.append(f"{words} {value:.4g} {unit}".rstrip())
    loss = sampling_loss(judgement)
    return (
        f"Design {design} ({digest}), slewctl {version}.",
        f"Method {controller.method}, {controller.linear.nstates} states, {clock}.",
        f"On the truth of {judgement.modes} modes: {', '.join(parts)}.",
        *([f"Sampling: {loss}."] if loss else []),
    )
