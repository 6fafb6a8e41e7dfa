"""A program as a functional mock-up unit (FMI 2.0, co-simulation): the same C inside.

(Modelica Association, Functional Mock-up Interface for Model Exchange and Co-Simulation, 2.0.4,
2022.)
"""

from __future__ import annotations

import hashlib
import io
import math
import platform
import sys
import tempfile
import zipfile
from pathlib import Path
from xml.etree import ElementTree as ET

from slewctl.embedded.c_header import header_text
from slewctl.embedded.c_source import source_text
from slewctl.embedded.compiled import FLAGS, find_compiler, run_compiler
from slewctl.embedded.dialect import double_literal
from slewctl.embedded.program import UNITS, Program
from slewctl.errors import InputError
from slewctl.plant.signals import signal

# Folders of the standard, and endings, by system and processor.
_PLATFORMS = {
    ("linux", "x86_64"): ("linux64", ".so"),
    ("darwin", "x86_64"): ("darwin64", ".dylib"),
    ("darwin", "arm64"): ("darwin64", ".dylib"),
    ("win32", "amd64"): ("win64", ".dll"),
}
# The first day that a zip file knows: the same program gives the same bytes.
_DATE = (1980, 1, 1, 0, 0, 0)
# Exponents of the base units by the unit of a signal.
_BASE = {
    "rad": {"rad": "1"}, "rad/s": {"rad": "1", "s": "-1"}, "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"}, "m/s²": {"m": "1", "s": "-2"},
    "N·m": {"kg": "1", "m": "2", "s": "-2"},
    "V": {"kg": "1", "m": "2", "s": "-3", "A": "-1"},
}  # fmt: skip
_FLOAT_LIMITS = "    return (@NAME@_number)(value * scale);"
_WORD_LIMITS = """\
    const double word = floor(value * scale + 0.5);
    const double most = @MOST@;
    /* What is no number is a word beyond all readings, where there is one. */
    return (@NAME@_number)((word >= -most) ? ((word <= most) ? word : most) : -most - 1.0);"""


def fmu_bytes(program: Program) -> bytes:
    """Return an FMU for co-simulation, compiled for this machine, its sources inside.

    Inputs are the readings, ``angle`` (the reference) and ``feedforward``; outputs the command,
    by the name of the actuator, and ``fault``; the parameter ``start_angle`` is the angle at
    which it starts at rest.

    Parameters
    ----------
    program : Program

    Returns
    -------
    bytes
        The same for the same program, compiler and machine.

    Raises
    ------
    InputError
        Where there is no compiler, it refuses the code, or FMI 2.0 has no name for the machine.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from pathlib import Path
    >>> from slewctl.embedded import CodeOptions, fmu_bytes, program_of
    >>> program = program_of(problem.judge(K), CodeOptions(), "arm")
    >>> Path("arm.fmu").write_bytes(fmu_bytes(program))  # doctest: +SKIP
    """
    machine = (sys.platform, platform.machine().lower())
    if machine not in _PLATFORMS:
        raise InputError(
            f"FMI 2.0 has no name for {' on '.join(reversed(machine))}",
            where="--format",
            remedy="export C code instead",
        )
    folder, ending = _PLATFORMS[machine]
    name = program.name
    sources = {f"{name}.h": header_text(program), f"{name}.c": source_text(program)}
    guid = _guid(sources)
    interface = f"{name}_fmi2.c"
    sources[interface] = _interface(program, guid)
    files = {"modelDescription.xml": _description(program, guid, [f"{name}.c", interface])}
    files |= {f"sources/{file}": text.encode("ascii") for file, text in sources.items()}
    with tempfile.TemporaryDirectory(prefix="slewctl-") as place:
        for file, text in sources.items():
            (Path(place) / file).write_text(text, encoding="ascii")
        out = f"{name}{ending}"
        run_compiler(
            [find_compiler(), *FLAGS, "-fvisibility=hidden", "-shared", "-fPIC", f"{name}.c",
             interface, "-lm", "-o", out],
            Path(place),
        )  # fmt: skip
        files[f"binaries/{folder}/{out}"] = (Path(place) / out).read_bytes()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, content in files.items():
            archive.writestr(zipfile.ZipInfo(file, _DATE), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def _guid(sources: dict[str, str]) -> str:
    """Return what tells these sources from others."""
    digits = hashlib.sha256("".join(sources.values()).encode()).hexdigest()
    return f"{{{digits[:8]}-{digits[8:12]}-{digits[12:16]}-{digits[16:20]}-{digits[20:32]}}}"


def _interface(program: Program, guid: str) -> str:
    """Return the source of the interface of one program."""
    words, controller = program.words, program.controller
    scales = [1.0] * (len(program.sensors) + 3)
    number = _FLOAT_LIMITS
    if words:
        bits = [*words.readings, words.angle, words.command, words.command]
        scales = [math.ldexp(1.0, each) for each in bits]
        number = _WORD_LIMITS.replace("@MOST@", f"{2 ** (words.word - 1) - 1}.0")
    text = Path(__file__).with_name("fmi2.c").read_text(encoding="ascii")
    late = 2 + math.ceil(controller.delay / controller.sample_time)
    for key, value in {
        "NUMBER_OF": number, "NAME": program.name, "GUID": guid,
        "SAMPLE_TIME": double_literal(controller.sample_time),
        "DELAY": double_literal(controller.delay),
        "INPUTS": str(len(program.sensors) + 2), "LATE": str(late),
        "SCALES": ", ".join(map(double_literal, scales)),
    }.items():  # fmt: skip
        text = text.replace(f"@{key}@", value)
    return text


def _description(program: Program, guid: str, sources: list[str]) -> bytes:
    """Return the model description."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0", modelName=program.name, guid=guid,
        description=" ".join(program.notes), generationTool="slewctl",
        variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip
    kind = ET.SubElement(
        root, "CoSimulation",
        modelIdentifier=program.name, canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUstate="true", canSerializeFMUstate="true",
    )  # fmt: skip
    files = ET.SubElement(kind, "SourceFiles")
    for file in sources:
        ET.SubElement(files, "File", name=file)
    command = UNITS[program.actuator].replace("*", "·")
    units = ET.SubElement(root, "UnitDefinitions")
    names = [signal(name).unit for name in program.sensors]
    for each in dict.fromkeys([*names, "rad", command]):
        ET.SubElement(ET.SubElement(units, "Unit", name=each), "BaseUnit", _BASE.get(each, {}))
    variables = ET.SubElement(root, "ModelVariables")
    inputs = [*zip(program.sensors, names, strict=True), ("angle", "rad"), ("feedforward", command)]
    for k, (name, of) in enumerate(inputs):
        one = ET.SubElement(
            variables, "ScalarVariable", name=name, valueReference=str(k), causality="input"
        )
        ET.SubElement(one, "Real", unit=of, start="0.0")
    k = len(inputs)
    out = ET.SubElement(variables, "ScalarVariable", name=program.actuator,
                        valueReference=str(k), causality="output")  # fmt: skip
    ET.SubElement(out, "Real", unit=command)
    angle = ET.SubElement(variables, "ScalarVariable", name="start_angle",
                          valueReference=str(k + 1), causality="parameter",
                          variability="fixed", initial="exact")  # fmt: skip
    ET.SubElement(angle, "Real", unit="rad", start="0.0")
    fault = ET.SubElement(variables, "ScalarVariable", name="fault", valueReference=str(k + 2),
                          causality="output", variability="discrete")  # fmt: skip
    ET.SubElement(fault, "Integer")
    structure = ET.SubElement(root, "ModelStructure")
    for part in ("Outputs", "InitialUnknowns"):
        unknown = ET.SubElement(structure, part)
        # A command that is due later depends on no input of its own time.
        at_once = [] if program.controller.delay else list(range(1, k + 1))
        if at_once and part == "InitialUnknowns":
            at_once.append(k + 2)  # where it starts
        ET.SubElement(
            unknown, "Unknown", index=str(k + 1), dependencies=" ".join(map(str, at_once))
        )
        ET.SubElement(unknown, "Unknown", index=str(k + 3), dependencies="")
    ET.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="utf-8")
