"""A fitted muscle as a functional mock-up unit: FMI 2.0, co-simulation, made of the header of C99."""

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from string import Template
from xml.sax.saxutils import escape

from fitting.errors import InputError
from fitting.exporting.c_header import c_header
from fitting.exporting.fmu_source import FMU_SOURCE
from fitting.exporting.laws import NOTHING, Told
from fitting.version import program_version
from mckibben_jax.model import Model

# name, causality, unit, what it is; the place is the value reference, which fmu_source.py knows
VARIABLES = (
    ("pressure", "input", "Pa", "gauge pressure at the end of the step"),
    ("displacement", "input", "m", "how much shorter than at rest at the end of the step"),
    ("wanted_force", "input", "N", "the force for which pressure_for_step is asked"),
    ("force", "output", "N", "force, positive when the muscle pulls"),
    ("pull", "output", "N", "force without dry friction"),
    ("friction", "output", "N", "the most that dry friction can resist"),
    ("direction", "output", "1", "way of the braid: 1 contracting, -1 elongating, 0 at rest without friction"),
    ("stiffness", "output", "N/m", "how much more it pulls per metre that it is longer, in slow motion"),
    (
        "pressure_for_step",
        "output",
        "Pa",
        "pressure for the wanted force at the end of the next step; NaN if there is none",
    ),
    ("force_error", "output", "N", "the largest force error to expect, always the same; NaN if it is not known"),
)
UNITS = {
    "Pa": 'kg="1" m="-1" s="-2"', "m": 'm="1"', "N": 'kg="1" m="1" s="-2"', "N/m": 'kg="1" s="-2"', "1": ""
}  # fmt: skip
HEADERS = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")


def write_fmu(whole: Model, source: str, file: Path, name: str, told: Told = NOTHING) -> None:
    """Write an FMU of this name, compiled for this machine, its sources with it for every other."""
    header = c_header(whole, source, "muscle", told)
    texts = {
        "modelDescription.xml": model_description(name, header, told.error.sentence),
        "sources/muscle.h": header,
        "sources/fmu.c": f'#define FMU_GUID "{guid(header)}"\n{FMU_SOURCE}',
        **{f"sources/{each}": text for each, text in _fmi_headers().items()},
    }
    with tempfile.TemporaryDirectory() as folder:
        for place, text in texts.items():
            path = Path(folder, place)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        binary, ending = system()
        library = Path(folder, "binaries", binary, f"{name}{ending}")
        _compile(Path(folder, "sources", "fmu.c"), library)
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(Path(folder).rglob("*")):
                if path.is_file():
                    archive.write(path, path.relative_to(folder).as_posix())


def guid(header: str) -> str:
    """The identity of an FMU: that of its muscle and of its variables."""
    digest = hashlib.sha256((header + repr(VARIABLES)).encode()).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"


def system() -> tuple[str, str]:
    """What FMI 2.0 calls this system, and the ending of its libraries."""
    bits = 64 if sys.maxsize > 2**32 else 32
    names = {"Windows": ("win", ".dll"), "Darwin": ("darwin", ".dylib")}
    name, ending = names.get(platform.system(), ("linux", ".so"))
    return f"{name}{bits}", ending


def _fmi_headers() -> dict[str, str]:
    """The headers of the FMI standard (2-clause BSD), which fmpy carries."""
    found = importlib.util.find_spec("fmpy")
    if found is None or found.origin is None:
        raise InputError("an FMU needs fmpy", cure="pip install 'mckibben-jax[fmu]'")
    folder = Path(found.origin).parent / "c-code"
    return {name: (folder / name).read_text(encoding="utf-8") for name in HEADERS}


def _compile(source: Path, library: Path) -> None:
    compiler = os.environ.get("CC") or next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        cure = "install gcc or clang, or name one in CC; or take --to c"
        raise InputError("an FMU needs a C compiler, and this machine has none", cure=cure)
    library.parent.mkdir(parents=True)
    command = [compiler, "-std=c99", "-O2", "-fPIC", "-shared", str(source), "-o", str(library), "-lm"]
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except OSError as error:
        raise InputError(f"the C compiler cannot be run: {error.strerror}", value=compiler, cure="mend CC") from None
    if done.returncode:
        said = next((line for line in done.stderr.splitlines() if "error" in line), "no reason given")
        raise InputError(f"the C compiler refuses: {said}", value=compiler, cure="name another one in CC")


def model_description(name: str, header: str, sentence: str) -> str:
    """The XML that says what goes in and what comes out; `sentence` says how far the force may be wrong."""
    rows = []
    for number, (variable, causality, unit, words) in enumerate(VARIABLES):
        start = ' start="0"' if causality == "input" else ""
        kind = 'initial="calculated" ' if causality == "output" else ""
        rows.append(
            f'    <ScalarVariable name="{variable}" valueReference="{number}" causality="{causality}" {kind}'
            f'variability="continuous" description="{escape(words)}"><Real unit="{unit}"{start}/></ScalarVariable>'
        )
    places = [i for i, (_, causality, _, _) in enumerate(VARIABLES, 1) if causality == "output"]
    return _DESCRIPTION.substitute(
        name=name,
        guid=guid(header),
        sentence=escape(sentence, {'"': "&quot;"}),
        version=program_version(),
        units="\n".join(f'    <Unit name="{unit}"><BaseUnit {base}/></Unit>' for unit, base in UNITS.items()),
        variables="\n".join(rows),
        unknowns="\n".join(f'      <Unknown index="{place}"/>' for place in places),
    )


_DESCRIPTION = Template("""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="$name" guid="$guid" description="A McKibben muscle. $sentence"
    generationTool="mckibben $version" variableNamingConvention="flat">
  <CoSimulation modelIdentifier="$name" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"
      canBeInstantiatedOnlyOncePerProcess="false">
    <SourceFiles><File name="fmu.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions>
$units
  </UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.001"/>
  <ModelVariables>
$variables
  </ModelVariables>
  <ModelStructure>
    <Outputs>
$unknowns
    </Outputs>
    <InitialUnknowns>
$unknowns
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
""")
