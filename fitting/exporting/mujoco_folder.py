"""A fitted muscle for MuJoCo: its module of plain numpy, the callbacks that MuJoCo asks, and two scenes."""

from pathlib import Path
from string import Template

import numpy as np
from scipy import constants

from fitting.exporting.laws import NOTHING, RIG, Told, memory_shapes
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
        "error": _error(told.error.newtons),
        "told": told.error.sentence.replace("--", "-"),
        "users": 1 if told.draws is None else 2,
        "draw": "" if told.draws is None else " -1",
        "chosen": "" if told.draws is None else "; its second number the draw of the parameters, -1: the fitted ones",
    }
    return {
        "muscle.py": python_module(whole, source, told),
        "muscle_mujoco.py": _CALLBACKS,
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

_LIFT = Template("""<mujoco model="a McKibben muscle lifts a load">
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 -$gravity"/>
  <size nuser_actuator="$users"/>
  <!-- $told -->
$error  <worldbody>
    <light pos="0 -1 1.5"/>
    <geom type="box" size="0.1 0.1 0.01" pos="0 0 $height" rgba="0.5 0.5 0.5 1"/>
    <site name="top" pos="0 0 $height"/>
    <body name="load" pos="0 0 $length">
      <joint name="height" type="slide" axis="0 0 1"/>
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
    <!-- ctrl is the pressure in Pa; user is added to the tendon's length (m) to have that of the muscle$chosen -->
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
    <!-- ctrl is the pressure in Pa; user is the muscle's length (m) where the joint stands at 0$chosen -->
    <general name="up" tendon="up" dyntype="user" biastype="user" gainprm="0" actdim="$states" user="$middle$draw"/>
    <general name="down" tendon="down" dyntype="user" biastype="user" gainprm="0" actdim="$states" user="$middle$draw"/>
  </actuator>
</mujoco>
""")

_CALLBACKS = '''"""MuJoCo asks muscle.py what its muscles do: `python muscle_mujoco.py lift.xml` shows it.

    import mujoco, muscle_mujoco
    model = muscle_mujoco.load("joint.xml")     # from here on every step of this model asks muscle.py
    data = mujoco.MjData(model)
    data.ctrl[:] = 2e5, 1.5e5                   # Pa
    mujoco.mj_step(model, data)

A muscle is a `general` actuator on a tendon, with dyntype and biastype `user`, as in the scenes beside this file. Its
control is the pressure (Pa), its activations are what the muscle remembers (data.act; all zero before its first step,
when it is taken to have stood where it is for long). So a copy of `data` goes on where the first was.

Dry friction is no force with a sign, which would chatter, but what the tendon's constraint may resist: each step gives
MuJoCo the pull without dry friction, and for the step after it `frictionloss`, the most that dry friction can hold at
this pressure and contraction. A muscle that is shorter than it would be by itself pushes, as the law says; a rope does
not: let such a tendon go slack by giving it limits.
"""

import mujoco
import numpy as np

import muscle

_example = muscle.start()
_shapes = [np.shape(part) for part in _example]
_ends = np.cumsum([np.size(part) for part in _example])
STATES = int(_ends[-1])  # the actuator's actdim
_OURS: set = set()  # signatures of the models whose muscles are asked for here
_pulls: dict = {}  # N, by actuator, of the step that is being made


def load(path):
    """A model from an MJCF file, with `install` called. While callbacks are set MuJoCo itself can load none."""
    mujoco.set_mjcb_act_dyn(None)
    mujoco.set_mjcb_act_bias(None)
    model = mujoco.MjModel.from_xml_path(path)
    install(model)
    return model


def install(model):
    """Let MuJoCo ask for the muscles of a model; copies of it are meant too."""
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise ValueError('integrator="RK4" takes each step four times; a muscle that remembers needs implicitfast')
    for i in muscles(model):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, i)
        if model.actuator_actnum[i] != STATES:
            raise ValueError(f'actuator {name!r} needs actdim="{STATES}", not {model.actuator_actnum[i]}')
        if model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_TENDON:
            raise ValueError(f"actuator {name!r} needs a tendon")
        if not model.tendon_frictionloss[model.actuator_trnid[i, 0]] > 0:
            raise ValueError(f'the tendon of actuator {name!r} needs frictionloss="1", which each step then changes')
    _OURS.add(int(model.signature))
    mujoco.set_mjcb_act_dyn(_dynamics)
    mujoco.set_mjcb_act_bias(_bias)


def uninstall():
    """Let MuJoCo ask nobody."""
    _OURS.clear()
    mujoco.set_mjcb_act_dyn(None)
    mujoco.set_mjcb_act_bias(None)


def muscles(model):
    """The numbers of the actuators that are muscles."""
    return np.flatnonzero(model.actuator_dyntype == mujoco.mjtDyn.mjDYN_USER)


def choose(model, i):
    """Let muscle.py be the draw that muscle number `i` asks for, where it has draws: the second number of its user."""
    if hasattr(muscle, "use"):
        draw = int(model.actuator_user[i, 1]) if model.nuser_actuator > 1 else -1
        muscle.use(draw if draw >= 0 else None)


def displacement(model, data, i):
    """How much shorter muscle number `i` is than at rest, m."""
    choose(model, i)
    return muscle.LENGTH - (data.actuator_length[i] + model.actuator_user[i, 0])


def state(model, data, i):
    """What muscle number `i` remembers, as muscle.py has it; of one that has stood here for long before its start."""
    choose(model, i)
    first = model.actuator_actadr[i]
    kept = data.act[first : first + STATES]
    if not kept.any():
        return muscle.start(data.ctrl[i], displacement(model, data, i))
    parts = np.split(kept, _ends[:-1])
    return muscle.State(*(part.reshape(shape)[()] for part, shape in zip(parts, _shapes)))


def _dynamics(model, data, i):
    if int(model.signature) not in _OURS:
        return 0.0
    before, step = state(model, data, i), model.opt.timestep
    after, _pulls[i], friction = muscle.step_parts(before, data.ctrl[i], displacement(model, data, i), step)
    first, new = model.actuator_actadr[i], np.concatenate([np.ravel(part) for part in after])
    data.act_dot[first : first + STATES] = (new - data.act[first : first + STATES]) / step
    model.tendon_frictionloss[model.actuator_trnid[i, 0]] = max(friction, 1e-9)  # at 0 the constraint would be gone
    return data.act_dot[first + STATES - 1]


def _bias(model, data, i):
    return -_pulls.get(i, 0.0) if int(model.signature) in _OURS else 0.0


def main(scene, seconds=3.0, pressure=3e5):
    """Run a scene without a window: every muscle rises to `pressure` (Pa) in half a second, the first of all alone."""
    model = load(scene)
    data = mujoco.MjData(model)
    print("time [s]", *(f"{model.joint(j).name} [m or rad]" for j in range(model.njnt)), "friction [N]", sep="\\t")
    while data.time < seconds:
        data.ctrl[:] = [pressure * min(2 * data.time, 1) * (1 if k == 0 else 0.5) for k in range(model.nu)]
        mujoco.mj_step(model, data)
        if round(data.time / model.opt.timestep) % 200 == 0:
            numbers = [data.time, *data.qpos, *model.tendon_frictionloss]
            print(*(f"{number:.5g}" for number in numbers), sep="\\t")


if __name__ == "__main__":
    import sys

    main(sys.argv[1] if len(sys.argv) > 1 else "lift.xml")
'''
