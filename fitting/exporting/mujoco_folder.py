"""A fitted muscle for MuJoCo: its module of plain numpy, the callbacks that MuJoCo asks, and two scenes."""

from pathlib import Path
from string import Template

import numpy as np
from scipy import constants

from fitting.exporting.laws import NOTHING, RIG, Told, memory_shapes
from fitting.exporting.mujoco_callbacks import CALLBACKS
from fitting.exporting.python_module import python_module
from fitting.exporting.settings import EXPORT
from fitting.exporting.table import forces
from mckibben_jax.model import Model


def mujoco_files(whole: Model, source: str, told: Told = NOTHING) -> dict[str, str]:
    """The texts of the folder's files, by their names; `source` says where the model is from."""
    length, radius = float(whole.muscle.length), EXPORT.pulley * float(whole.muscle.length)
    contraction = np.array([0.0, EXPORT.middle])
    standing, bent = forces(whole, contraction, np.full(2, EXPORT.scene_pressure), np.zeros(2))
    given = {
        "states": len(RIG) + 1 + sum(int(np.prod(shape)) for shape in memory_shapes(whole).values()),
        "gravity": constants.g,
        "length": length,
        "height": 2 * length,
        "load": f"{EXPORT.scene_load * standing / constants.g:.4g}",
        "radius": f"{radius:.6g}",
        "middle": f"{(1 - EXPORT.middle) * length:.6g}",
        "arm": length,
        "weight": f"{EXPORT.joint_load * bent * radius / length / constants.g:.4g}",
        "friction": _FRICTION,
        "stiff": _STIFF,
        "error": _error(told.error.newtons),
        "told": told.error.sentence.replace("--", "-"),
        "users": 1 if told.draws is None else 2,
        "draw": "" if told.draws is None else " -1",
        "chosen": "" if told.draws is None else "; its second number the draw of the parameters, -1: the fitted ones",
    }
    return {
        "muscle.py": python_module(whole, source, told),
        "muscle_mujoco.py": CALLBACKS,
        "lift.xml": _LIFT.substitute(given),
        "joint.xml": _JOINT.substitute(given),
    }


def _error(newtons: float) -> str:
    """The largest force error to expect (N) as a number of the scene; none where it is not known."""
    numeric = f'<numeric name="force_error" data="{newtons:.6g}"/>'
    return f"  <custom>{numeric}</custom>\n" if np.isfinite(newtons) else ""


def write_folder(folder: Path, files: dict[str, str]) -> None:
    """Write files into a new folder."""
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


# MuJoCo's dry friction is a constraint; it holds without creep where it is stiff: two steps to act, hardly any give.
_FRICTION = 'frictionloss="1" solreffriction="0.002 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
_STIFF = 'solreflimit="0.002 1" solimplimit="0.9999 0.9999 0.001 0.5 2"'  # the ground gives as little

_LIFT = Template("""<mujoco model="a McKibben muscle lifts a load">
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 -$gravity"/>
  <size nuser_actuator="$users"/>
  <!-- $told -->
$error  <worldbody>
    <light pos="0 -1 1.5"/>
    <geom type="box" size="0.1 0.1 0.01" pos="0 0 $height" rgba="0.5 0.5 0.5 1"/>
    <site name="top" pos="0 0 $height"/>
    <body name="load" pos="0 0 $length">
      <!-- it stands on the ground, at the muscle's length at rest, until the muscle pulls more than its weight -->
      <joint name="height" type="slide" axis="0 0 1" range="0 $length" limited="true" $stiff/>
      <geom type="box" size="0.05 0.05 0.02" pos="0 0 -0.02" mass="$load" rgba="0.2 0.4 0.7 1"/>
      <site name="hook"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="muscle" width="0.007" rgba="0.1 0.1 0.1 1" $friction>
      <site site="top"/>
      <site site="hook"/>
    </spatial>
  </tendon>
  <actuator>
    <!-- ctrl is the pressure in Pa (gauge). The muscle's length (m) is that of the tendon + user: here the tendon is as
         long as the muscle$chosen -->
    <general name="muscle" tendon="muscle" dyntype="user" biastype="user" gainprm="0" actdim="$states" user="0$draw"/>
  </actuator>
</mujoco>
""")

_JOINT = Template("""<mujoco model="a joint between two McKibben muscles">
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 -$gravity"/>
  <size nuser_actuator="$users"/>
  <!-- $told -->
$error  <worldbody>
    <light pos="0 -1 1.5"/>
    <body name="arm" pos="0 0 $height">
      <joint name="elbow" type="hinge" axis="0 -1 0"/>
      <geom type="cylinder" size="$radius 0.01" zaxis="0 1 0" mass="0.1" rgba="0.5 0.5 0.5 1"/>
      <geom type="capsule" size="0.008" fromto="0 0 0 $arm 0 0" mass="0.1" rgba="0.5 0.5 0.5 1"/>
      <geom type="sphere" size="0.03" pos="$arm 0 0" mass="$weight" rgba="0.2 0.4 0.7 1"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="up" $friction><joint joint="elbow" coef="-$radius"/></fixed>
    <fixed name="down" $friction><joint joint="elbow" coef="$radius"/></fixed>
  </tendon>
  <actuator>
    <!-- ctrl is the pressure in Pa (gauge). The muscle's length (m) is that of the tendon + user: a tendon of joints
         has the length 0 where they stand at 0, so that user is the muscle's length there$chosen -->
    <general name="up" tendon="up" dyntype="user" biastype="user" gainprm="0" actdim="$states" user="$middle$draw"/>
    <general name="down" tendon="down" dyntype="user" biastype="user" gainprm="0" actdim="$states" user="$middle$draw"/>
  </actuator>
</mujoco>
""")
