"""The text of muscle_mujoco.py, with which MuJoCo asks the module of plain numpy what its muscles do."""

CALLBACKS = '''"""MuJoCo asks muscle.py what its muscles do: `python muscle_mujoco.py lift.xml` shows it.

    import mujoco, muscle_mujoco
    model = muscle_mujoco.load("joint.xml")     # from here on every step of this model asks muscle.py
    data = mujoco.MjData(model)
    data.ctrl[:] = 3e5, 1e5                     # Pa
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
USERS = 2 if hasattr(muscle, "DRAWS") else 1  # numbers that each actuator's user needs at least
_OURS: set = set()  # signatures of the models whose muscles are asked for here
_pulls: dict = {}  # N, by actuator, of the step that is being made


def load(path):
    """A model from an MJCF file, with `install` called.

    Load every scene so: while callbacks are set MuJoCo itself says "Python exception raised" to any.
    """
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
        if model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_USER:
            raise ValueError(f'actuator {name!r} needs biastype="user": without it the muscle pulls with nothing')
        if model.actuator_gainprm[i, 0] != 0:
            raise ValueError(f'actuator {name!r} needs gainprm="0": else its memory pulls, too')
        if model.actuator_gear[i, 0] != 1:
            raise ValueError(f'actuator {name!r} needs gear="1": put a transmission into the tendon')
        if model.nuser_actuator < USERS:
            what = 'nuser_actuator="1" and user="0"' if USERS == 1 else 'nuser_actuator="2" and user="0 -1"'
            raise ValueError(f"actuator {name!r} needs {what}: how much longer than the tendon the muscle is")
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
