"""What the scripts beside this file share: running codes, and their parameter files."""
import os
import re
import subprocess

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SPH_PREP = os.path.join(ROOT, "target", "release", "sph-prep")
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}


def run(command, folder):
    with open(os.path.join(folder, "log"), "a", encoding="utf-8") as log:
        return subprocess.run(command, cwd=folder, stdout=log, stderr=log, env=ENVIRONMENT).returncode


def edit(path, key, new):
    """Replaces the value behind a key; returns the old one."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    found = re.search(rf"^(\s*{key}\s*[:= ]\s*)(\S+)", text, re.MULTILINE)
    value = new(float(found.group(2))) if callable(new) else new
    with open(path, "w", encoding="utf-8") as file:
        file.write(text[: found.start(2)] + repr(value) + text[found.end(2) :])
    return float(found.group(2))


def end_at(parameters, end, snapshots):
    """Sets SWIFT's end of the run and so many snapshots until then; the last is at the end but for rounding."""
    edit(parameters, "time_end", end * (1 + 1e-6))
    with open(parameters, encoding="utf-8") as file:
        head, tail = file.read().split("Snapshots:", 1)
    section, rest = tail.split("Statistics:", 1)
    section = re.sub(r"(?m)^(\s*delta_time:\s*)\S+", rf"\g<1>{end / snapshots!r}", section)
    with open(parameters, "w", encoding="utf-8") as file:
        file.write(head + "Snapshots:" + section + "Statistics:" + rest)


def target_of(scene, code):
    """The build of a code that a scene says it is for; the code's name where it says none."""
    with open(scene, encoding="utf-8") as file:
        own = re.search(rf"^target_code: ({code}\S*)", file.read(), re.MULTILINE)
    return own.group(1) if own else code


def units_of(file):
    """Units of mass, length and time of a file of SWIFT's in cgs, by their letters."""
    names = (("mass", "M"), ("length", "L"), ("time", "t"))
    return {s: float(file["Units"].attrs[f"Unit {n} in cgs (U_{s})"][()].ravel()[0]) for n, s in names}
