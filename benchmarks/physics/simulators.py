"""Ruedo, MuJoCo and PyBullet behind one small interface. Each keeps its defaults, except as its
class comment says.
"""

from __future__ import annotations

import importlib.util
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import ruedo
from scenes import Body, Scene, Shape, quaternion

Vec = np.ndarray


class Simulator:
    """A scene at a step. Bodies are asked for by name, links of the mechanism, too; poses and
    velocities are those of the centre of mass, or of the link's origin."""

    name = ""

    def __init__(self, scene: Scene, step_s: float) -> None: ...
    def step(self, n: int = 1) -> None: ...
    def position(self, body: str) -> Vec: ...
    def rotation(self, body: str) -> Vec:
        """3 x 3, to the world."""

    def velocity(self, body: str) -> tuple[Vec, Vec]:
        """Linear and angular, world."""

    def set_velocity(
        self, body: str, linear: Sequence[float], angular: Sequence[float] = (0, 0, 0)
    ) -> None: ...
    def hold(self, joints: Sequence[str], mode: str, value: float) -> None:
        """mode: "velocity" (rad/s) or "position" (rad)."""

    def push(self, joint: str, effort: float) -> None:
        """Gives the joint that effort (N or N m) in every step from now on."""
        raise NotImplementedError

    def drive(self, left: float, right: float) -> None:
        """Turns the wheels of each side at these rates (rad/s)."""

    def close(self) -> None: ...
    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def matrix(q: Sequence[float]) -> Vec:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Ruedo(Simulator):
    """A server of its own, stepped while it is paused, or in lockstep where joints are
    commanded.
    """

    name = "Ruedo"

    def __init__(self, scene: Scene, step_s: float) -> None:
        self._scene = scene
        self._folder = tempfile.TemporaryDirectory(prefix="ruedo-physics-")
        world = Path(self._folder.name) / "world.sdf"
        if scene.urdf:
            (Path(self._folder.name) / "robot.urdf").write_text(
                with_friction(scene), encoding="utf-8"
            )
        world.write_text(sdf(scene, step_s), encoding="utf-8")
        mode = {"lockstep": 1} if scene.commands or scene.wheels[0] else {"args": ["--paused"]}
        self._sim = ruedo.launch(world, rate="max", timeout=120, **mode)
        self._commands: list[ruedo.Command] = []
        self.step(0)

    def step(self, n: int = 1) -> None:
        if self._scene.commands or self._scene.wheels[0]:
            self._sim.step(n, self._commands if n else (), timeout=600)
            self._commands = self._commands if not n else []
        elif n:
            self._sim.step(n, timeout=600)

    def _state(self, body: str):
        free = any(b.name == body for b in self._scene.bodies)
        return self._sim.state(f"{body}/link" if free else f"robot/{body}")

    def position(self, body: str) -> Vec:
        return self._state(body).position

    def rotation(self, body: str) -> Vec:
        return matrix(self._state(body).orientation)

    def velocity(self, body: str) -> tuple[Vec, Vec]:
        state = self._state(body)
        return state.linear, state.angular

    def set_velocity(self, body, linear, angular=(0, 0, 0)) -> None:
        self._sim.set_twist(body, linear, angular)

    def push(self, joint, effort) -> None:
        self.hold([joint], "effort", effort)

    def hold(self, joints, mode, value) -> None:
        command = ruedo.lcmtypes.joint_command_t()
        command.n, command.name = len(joints), list(joints)
        kind = {
            "position": command.POSITION,
            "velocity": command.VELOCITY,
            "effort": command.EFFORT,
        }[mode]
        command.mode, command.value = bytes([kind] * command.n), [value] * command.n
        self._commands.append(ruedo.Command("robot/joint_command", command.encode()))

    def drive(self, left, right) -> None:
        self._commands.append(self._sim.robot("robot").wheel_command(left, right))

    def close(self) -> None:
        self._sim.close()
        self._folder.cleanup()


class MuJoCo(Simulator):
    """implicitfast, its recommended integrator, and elliptic cones; the rest by default. Meshes
    are a height field, since it replaces a mesh by its convex hull. It has no coefficient of
    restitution."""

    name = "MuJoCo"

    def __init__(self, scene: Scene, step_s: float) -> None:
        import mujoco

        self._mj, self._scene = mujoco, scene
        spec = mujoco.MjSpec.from_string(scene.urdf) if scene.urdf else mujoco.MjSpec()
        option = spec.option
        option.timestep, option.gravity = step_s, list(scene.down())
        option.integrator, option.cone = (
            mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
            mujoco.mjtCone.mjCONE_ELLIPTIC,
        )
        for body in scene.bodies:
            self._add(spec, body)
        self._targets: dict[str, tuple[str, float]] = {}
        if scene.commands:
            for joint in [j.name for j in spec.joints if j.type != mujoco.mjtJoint.mjJNT_FREE]:
                self._servos(spec, joint)
        if scene.wheels[0]:
            self._on_wheels(spec)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)

    def _on_wheels(self, spec) -> None:
        spec.body("base").add_freejoint()
        for geom in spec.geoms:
            if geom.parent.name != "world" and geom.parent.name not in [
                b.name for b in self._scene.bodies
            ]:
                geom.friction, geom.priority = [self._scene.friction, 1e-9, 1e-9], 1
        for joint in (*self._scene.wheels[0], *self._scene.wheels[1]):
            servo = spec.add_actuator(
                name=f"{joint}_velocity", trntype=self._mj.mjtTrn.mjTRN_JOINT, target=joint
            )
            servo.gaintype, servo.biastype = (
                self._mj.mjtGain.mjGAIN_FIXED,
                self._mj.mjtBias.mjBIAS_AFFINE,
            )
            servo.gainprm[0], servo.biasprm[:3] = 100.0, [0, 0, -100.0]

    def drive(self, left, right) -> None:
        for joints, rate in zip(self._scene.wheels, (left, right)):
            for joint in joints:
                self._data.actuator(f"{joint}_velocity").ctrl[0] = rate

    def _servos(self, spec, joint: str) -> None:
        """Proportional, as stiff as is stable at all three steps."""
        for kind, gain, bias in (
            ("position", 2e3, [0, -2e3, -4e2]),
            ("velocity", 1e4, [0, 0, -1e4]),
        ):
            servo = spec.add_actuator(
                name=f"{joint}_{kind}", trntype=self._mj.mjtTrn.mjTRN_JOINT, target=joint
            )
            servo.gaintype, servo.biastype = (
                self._mj.mjtGain.mjGAIN_FIXED,
                self._mj.mjtBias.mjBIAS_AFFINE,
            )
            servo.gainprm[0] = gain
            servo.biasprm[:3] = bias

    def push(self, joint, effort) -> None:
        self._model.actuator_gainprm[:] = self._model.actuator_biasprm[:] = 0.0
        self._data.joint(joint).qfrc_applied[0] = effort

    def _add(self, spec, body: Body) -> None:
        mj = self._mj
        holder = spec.worldbody.add_body(name=body.name, pos=body.at, quat=quaternion(body.rpy))
        if body.mass > 0.0:
            holder.add_freejoint()
            holder.mass, holder.inertia, holder.explicitinertial = body.mass, body.moments(), True
            holder.ipos, holder.iquat = [0, 0, 0], [1, 0, 0, 0]
        kinds = {
            "box": mj.mjtGeom.mjGEOM_BOX,
            "sphere": mj.mjtGeom.mjGEOM_SPHERE,
            "cylinder": mj.mjtGeom.mjGEOM_CYLINDER,
            "capsule": mj.mjtGeom.mjGEOM_CAPSULE,
            "plane": mj.mjtGeom.mjGEOM_PLANE,
        }
        for shape in body.shapes:
            geom = holder.add_geom(pos=shape.at)
            if shape.kind == "solid":
                spec.add_mesh(name=body.name, file=str(shape.file))
                geom.type, geom.meshname = mj.mjtGeom.mjGEOM_MESH, body.name
            elif shape.kind == "mesh":
                spec.add_hfield(
                    name="floor",
                    nrow=251,
                    ncol=251,
                    size=[10, 10, 0.1, 1],
                    userdata=[0.0] * 251 * 251,
                )
                geom.type, geom.hfieldname = mj.mjtGeom.mjGEOM_HFIELD, "floor"
            else:
                size = [s / 2 for s in shape.size] if shape.kind == "box" else list(shape.size)
                if shape.kind in ("cylinder", "capsule"):
                    size[1] /= 2
                geom.type, geom.size = (
                    kinds[shape.kind],
                    (size + [0, 0, 0])[:3] if size else [0, 0, 1],
                )
            geom.friction = [shape.friction, max(shape.torsion_m, 1e-9), 1e-9]
            geom.condim = 4 if shape.torsion_m else 3
            geom.priority = int(body.mass > 0.0)  # the moving body's coefficients count

    def step(self, n: int = 1) -> None:
        for _ in range(n):
            self._mj.mj_step(self._model, self._data)
        if n:
            self._mj.mj_fwdPosition(self._model, self._data)

    def position(self, body: str) -> Vec:
        return self._data.body(body).xpos.copy()

    def rotation(self, body: str) -> Vec:
        return self._data.body(body).xmat.reshape(3, 3).copy()

    def velocity(self, body: str) -> tuple[Vec, Vec]:
        both = np.zeros(6)
        self._mj.mj_forward(self._model, self._data)
        self._mj.mj_objectVelocity(
            self._model, self._data, self._mj.mjtObj.mjOBJ_XBODY, self._model.body(body).id, both, 0
        )
        return both[3:], both[:3]

    def set_velocity(self, body, linear, angular=(0, 0, 0)) -> None:
        joint = self._model.body(body).jntadr[0]
        at = self._model.jnt_dofadr[joint]
        self._data.qvel[at : at + 3] = linear
        self._data.qvel[at + 3 : at + 6] = self.rotation(body).T @ np.asarray(angular, float)

    def hold(self, joints, mode, value) -> None:
        for joint in joints:
            other = "velocity" if mode == "position" else "position"
            self._data.actuator(f"{joint}_{mode}").ctrl[0] = value
            index = self._model.actuator(f"{joint}_{other}").id
            self._model.actuator_gainprm[index] = self._model.actuator_biasprm[index] = 0.0


class PyBullet(Simulator):
    """Bodies are multibodies, 50 iterations, as createMultiBody and loadURDF make them; its default
    damping of 0.04 is removed, and sleeping stays off."""

    name = "PyBullet"

    def __init__(self, scene: Scene, step_s: float) -> None:
        import pybullet

        self._p, self._scene = pybullet, scene
        self._folder = tempfile.TemporaryDirectory(prefix="ruedo-physics-")
        self._id = pybullet.connect(pybullet.DIRECT)
        pybullet.setTimeStep(step_s, physicsClientId=self._id)
        pybullet.setGravity(*scene.down(), physicsClientId=self._id)
        self._bodies = {body.name: self._add(body) for body in scene.bodies}
        self._links: dict[str, int] = {}
        self._joints: dict[str, int] = {}
        if scene.urdf:
            self._load(scene.urdf)

    def _load(self, urdf: str) -> None:
        p = self._p
        path = Path(self._folder.name) / "robot.urdf"
        path.write_text(urdf, encoding="utf-8")
        self._robot = p.loadURDF(
            str(path),
            useFixedBase=not self._scene.wheels[0],
            flags=p.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=self._id,
        )
        for i in range(p.getNumJoints(self._robot, physicsClientId=self._id)):
            info = p.getJointInfo(self._robot, i, physicsClientId=self._id)
            self._joints[info[1].decode()] = self._links[info[12].decode()] = i
            p.setJointMotorControl2(
                self._robot, i, p.VELOCITY_CONTROL, force=0, physicsClientId=self._id
            )
            p.changeDynamics(
                self._robot,
                i,
                linearDamping=0,
                angularDamping=0,
                jointDamping=info[6],
                physicsClientId=self._id,
            )
        p.changeDynamics(
            self._robot, -1, linearDamping=0, angularDamping=0, physicsClientId=self._id
        )
        for joint in (*self._scene.wheels[0], *self._scene.wheels[1]):
            p.changeDynamics(
                self._robot,
                self._joints[joint],
                lateralFriction=self._scene.friction,
                physicsClientId=self._id,
            )
        self._links["base"] = -1

    def drive(self, left, right) -> None:
        for joints, rate in zip(self._scene.wheels, (left, right)):
            for joint in joints:
                self._p.setJointMotorControl2(
                    self._robot,
                    self._joints[joint],
                    self._p.VELOCITY_CONTROL,
                    targetVelocity=rate,
                    force=100,
                    physicsClientId=self._id,
                )

    def _add(self, body: Body) -> int:
        p, c = self._p, {"physicsClientId": self._id}
        w, x, y, z = quaternion(body.rpy)
        if len(body.shapes) > 1:
            raise NotImplementedError("several shapes of a body")
        shape = body.shapes[0]
        made = p.createMultiBody(
            body.mass, self._shape(shape), basePosition=body.at, baseOrientation=[x, y, z, w], **c
        )
        p.changeDynamics(
            made,
            -1,
            lateralFriction=shape.friction,
            restitution=shape.restitution,
            spinningFriction=shape.torsion_m,
            rollingFriction=0,
            linearDamping=0,
            angularDamping=0,
            **c,
        )
        if body.mass > 0.0:
            p.changeDynamics(made, -1, localInertiaDiagonal=body.moments(), **c)
        return made

    def _shape(self, shape: Shape) -> int:
        p, c = self._p, {"physicsClientId": self._id}
        if shape.kind == "box":
            return p.createCollisionShape(p.GEOM_BOX, halfExtents=[s / 2 for s in shape.size], **c)
        if shape.kind == "sphere":
            return p.createCollisionShape(p.GEOM_SPHERE, radius=shape.size[0], **c)
        if shape.kind in ("cylinder", "capsule"):
            kind = p.GEOM_CYLINDER if shape.kind == "cylinder" else p.GEOM_CAPSULE
            return p.createCollisionShape(kind, radius=shape.size[0], height=shape.size[1], **c)
        if shape.kind == "plane":
            return p.createCollisionShape(p.GEOM_PLANE, **c)
        flags = {} if shape.kind == "solid" else {"flags": p.GEOM_FORCE_CONCAVE_TRIMESH}
        return p.createCollisionShape(p.GEOM_MESH, fileName=str(shape.file), **flags, **c)

    def step(self, n: int = 1) -> None:
        for _ in range(n):
            self._p.stepSimulation(physicsClientId=self._id)

    def _link(self, body: str):
        return self._p.getLinkState(
            self._robot,
            self._links[body],
            computeLinkVelocity=1,
            computeForwardKinematics=1,
            physicsClientId=self._id,
        )

    def position(self, body: str) -> Vec:
        if body in self._bodies:
            return np.array(
                self._p.getBasePositionAndOrientation(self._bodies[body], physicsClientId=self._id)[
                    0
                ]
            )
        if self._links[body] < 0:
            return np.array(
                self._p.getBasePositionAndOrientation(self._robot, physicsClientId=self._id)[0]
            )
        return np.array(self._link(body)[4])

    def rotation(self, body: str) -> Vec:
        if body in self._bodies:
            x, y, z, w = self._p.getBasePositionAndOrientation(
                self._bodies[body], physicsClientId=self._id
            )[1]
        else:
            x, y, z, w = (
                self._p.getBasePositionAndOrientation(self._robot, physicsClientId=self._id)[1]
                if self._links[body] < 0
                else self._link(body)[5]
            )
        return matrix((w, x, y, z))

    def velocity(self, body: str) -> tuple[Vec, Vec]:
        if body in self._bodies:
            linear, angular = self._p.getBaseVelocity(self._bodies[body], physicsClientId=self._id)
            return np.array(linear), np.array(angular)
        if self._links[body] < 0:
            linear, angular = self._p.getBaseVelocity(self._robot, physicsClientId=self._id)
            return np.array(linear), np.array(angular)
        state = self._link(body)
        linear, angular = np.array(state[6]), np.array(state[7])  # of the centre of mass
        return linear + np.cross(angular, np.array(state[4]) - np.array(state[0])), angular

    def set_velocity(self, body, linear, angular=(0, 0, 0)) -> None:
        self._p.resetBaseVelocity(
            self._bodies[body], list(linear), list(angular), physicsClientId=self._id
        )

    def hold(self, joints, mode, value) -> None:
        p = self._p
        for joint in joints:
            if mode == "position":
                p.setJointMotorControl2(
                    self._robot,
                    self._joints[joint],
                    p.POSITION_CONTROL,
                    targetPosition=value,
                    force=1000,
                    physicsClientId=self._id,
                )
            else:
                p.setJointMotorControl2(
                    self._robot,
                    self._joints[joint],
                    p.VELOCITY_CONTROL,
                    targetVelocity=value,
                    force=1000,
                    physicsClientId=self._id,
                )

    def push(self, joint, effort) -> None:
        raise NotImplementedError("mimic joints")

    def close(self) -> None:
        self._p.disconnect(self._id)
        self._folder.cleanup()


def available(peers: bool) -> list[type[Simulator]]:
    """Ruedo, and the peers that are installed."""
    return [Ruedo] + [
        s
        for s, package in ((MuJoCo, "mujoco"), (PyBullet, "pybullet"))
        if peers and importlib.util.find_spec(package)
    ]


def with_friction(scene: Scene) -> str:
    """The URDF with the tags by which Gazebo's users set the friction of wheels."""
    wheels = [joint.removeprefix("to_") for side in scene.wheels for joint in side]
    blocks = "".join(
        f'<gazebo reference="{wheel}"><mu1>{scene.friction}</mu1><mu2>{scene.friction}</mu2></gazebo>'
        for wheel in wheels
    )
    return scene.urdf.replace("</robot>", blocks + "</robot>")


def sdf(scene: Scene, step_s: float) -> str:
    models = "".join(_model(body) for body in scene.bodies)
    if scene.urdf:
        drive = ""
        if scene.wheels[0]:
            sides = "".join(
                f"<ruedo:{side}_joint>{joint}</ruedo:{side}_joint>"
                for side, joints in zip(("left", "right"), scene.wheels)
                for joint in joints
            )
            drive = f'<ruedo:drive type="wheels">{sides}<ruedo:watchdog>0</ruedo:watchdog></ruedo:drive>'
        models += f"<include><uri>robot.urdf</uri><name>robot</name>{drive}</include>"
    return (
        f'<sdf version="1.9" xmlns:ruedo="urn:ruedo"><world name="test"><gravity>{" ".join(map(repr, scene.down()))}</gravity>'
        f'<physics name="step" type="bullet"><max_step_size>{step_s!r}</max_step_size></physics>{models}</world></sdf>'
    )


def _model(body: Body) -> str:
    inertial = ""
    if body.mass > 0.0:
        i = body.moments()
        inertial = f"<inertial><mass>{body.mass!r}</mass><inertia><ixx>{i[0]!r}</ixx><iyy>{i[1]!r}</iyy><izz>{i[2]!r}</izz></inertia></inertial>"
    shapes = "".join(_collision(f"c{i}", shape) for i, shape in enumerate(body.shapes))
    static = "" if body.mass > 0.0 else "<static>true</static>"
    pose = " ".join(repr(float(v)) for v in (*body.at, *body.rpy))
    return f'<model name="{body.name}">{static}<pose>{pose}</pose><link name="link">{inertial}{shapes}</link></model>'


def _collision(name: str, shape: Shape) -> str:
    size = shape.size
    geometry = {
        "box": lambda: f"<box><size>{size[0]!r} {size[1]!r} {size[2]!r}</size></box>",
        "sphere": lambda: f"<sphere><radius>{size[0]!r}</radius></sphere>",
        **{
            kind: lambda kind=kind: (
                f"<{kind}><radius>{size[0]!r}</radius><length>{size[1]!r}</length></{kind}>"
            )
            for kind in ("cylinder", "capsule")
        },
        "plane": lambda: "<plane><normal>0 0 1</normal></plane>",
        **{kind: lambda: f"<mesh><uri>{shape.file}</uri></mesh>" for kind in ("mesh", "solid")},
    }[shape.kind]()
    torsion = ""
    if shape.torsion_m:  # the moment is 3 pi / 16 of coefficient and radius
        torsion = (
            f"<torsional><coefficient>1</coefficient><use_patch_radius>true</use_patch_radius>"
            f"<patch_radius>{shape.torsion_m * 16 / (3 * math.pi)!r}</patch_radius></torsional>"
        )
    at = " ".join(repr(float(v)) for v in shape.at)
    return (
        f'<collision name="{name}"><pose>{at} 0 0 0</pose><geometry>{geometry}</geometry><surface><friction><ode><mu>{shape.friction!r}</mu>'
        f"<mu2>{shape.friction!r}</mu2></ode>{torsion}</friction><bounce><restitution_coefficient>{shape.restitution!r}"
        f"</restitution_coefficient></bounce></surface></collision>"
    )
