"""Arms that others described: URDF files of the package `example-robot-data`, and what each of its joints does."""

from dataclasses import dataclass, field
from importlib.metadata import files
from pathlib import Path

import mujoco
import numpy as np
import pinocchio

from model.arrays import Floats


@dataclass(frozen=True)
class PublishedArm:
    """An arm of a published robot: the joints that move, base first, and where others are held."""

    file: str
    joints: tuple[str, ...]
    hold: dict[str, float] = field(default_factory=dict)

    @property
    def path(self) -> Path:
        """The file, as it is installed."""
        found = [f for f in files("example-robot-data") or () if str(f).endswith(f"robots/{self.file}")]
        return Path(str(found[0].locate()))


def numbered(pattern: str, *numbers: int) -> tuple[str, ...]:
    return tuple(pattern.format(number) for number in numbers)


ARMS = {
    "panda": PublishedArm(
        "panda_description/urdf/panda.urdf",
        numbered("panda_joint{}", 1, 2, 3, 4, 5, 6, 7),
        {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.02},
    ),
    "ur5": PublishedArm(
        "ur_description/urdf/ur5_robot.urdf",
        ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", *numbered("wrist_{}_joint", 1, 2, 3)),
    ),
    "kinova": PublishedArm("kinova_description/robots/kinova.urdf", numbered("j2s6s200_joint_{}", 1, 2, 3, 4, 5, 6)),
    "xarm7": PublishedArm("xarm_description/urdf/xarm7.urdf", numbered("joint{}", 1, 2, 3, 4, 5, 6, 7)),
    "z1": PublishedArm("z1_description/urdf/z1.urdf", numbered("joint{}", 1, 2, 3, 4, 5, 6), {"jointGripper": -0.5}),
    "so101": PublishedArm(
        "so_arm_description/urdf/so101.urdf",
        ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"),
    ),
    "tiago, lift and arm": PublishedArm(
        "tiago_description/robots/tiago_no_hand.urdf",
        ("torso_lift_joint", *numbered("arm_{}_joint", 1, 2, 3, 4, 5, 6)),
        {"arm_7_joint": 0.7, "head_1_joint": 0.3},
    ),
    "tiago pro, lift and arm": PublishedArm(
        "tiago_pro_description/robots/tiago_pro.urdf",
        ("torso_lift_joint", *numbered("arm_right_{}_joint", 1, 2, 3, 4, 5, 6)),
    ),
    "pr2, lift and arm": PublishedArm(
        "pr2_description/urdf/pr2.urdf",
        (
            "torso_lift_joint",
            *(f"r_{part}_joint" for part in ("shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex")),
            *("r_forearm_roll_joint", "r_wrist_flex_joint"),
        ),
    ),
    "baxter, wrist and sliding finger": PublishedArm(
        "baxter_description/urdf/baxter.urdf",
        ("left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2", "l_gripper_l_finger_joint"),
        {"left_s0": 0.4, "l_gripper_r_finger_joint": 0.0},
    ),
    "talos, left arm": PublishedArm(
        "talos_data/robots/talos_left_arm.urdf", numbered("arm_left_{}_joint", 2, 3, 4, 5, 6, 7)
    ),
    "double pendulum": PublishedArm("double_pendulum_description/urdf/double_pendulum.urdf", ("joint1", "joint2")),
}
"""At least six with up to seven joints, three of them with a joint that slides."""


class InPinocchio:
    """The same joints of the same file in Pinocchio, which reads it with a reader of its own (urdfdom)."""

    def __init__(self, arm: PublishedArm) -> None:
        whole = pinocchio.buildModelFromUrdf(str(arm.path))
        held = [name for name in whole.names if name != "universe" and name not in arm.joints]
        posture = pinocchio.neutral(whole)
        for name, value in arm.hold.items():
            if whole.existJointName(name):
                posture[whole.joints[whole.getJointId(name)].idx_q] = value
        self.model = pinocchio.buildReducedModel(whole, [whole.getJointId(name) for name in held], posture)
        assert tuple(self.model.names)[1:] == arm.joints
        self.data = self.model.createData()
        self.lowest, self.highest = self.model.lowerPositionLimit, self.model.upperPositionLimit

    def inertia(self, q: Floats) -> Floats:
        """D(q)."""
        upper = np.triu(np.array(pinocchio.crba(self.model, self.data, self.posture(q))))
        return upper + np.triu(upper, 1).T

    def bias(self, q: Floats, velocity: Floats) -> Floats:
        """H(q, q̇) + G(q)."""
        return np.array(pinocchio.nonLinearEffects(self.model, self.data, self.posture(q), velocity))

    def posture(self, q: Floats) -> Floats:
        """Positions as Pinocchio has them: of a continuous joint, cosine and sine."""
        return np.array(pinocchio.integrate(self.model, pinocchio.neutral(self.model), q))


class InMujoco:
    """The same joints in MuJoCo, compiled by it: it merges what is fixed, and keeps inertias as axes and moments."""

    def __init__(self, arm: PublishedArm) -> None:
        spec = mujoco.MjSpec.from_file(str(arm.path))
        for body in spec.bodies:
            for joint in body.joints:
                if joint.name in arm.joints:
                    continue
                value = arm.hold.get(joint.name, 0.0)
                self._turn(body, joint, value)
                spec.delete(joint)
        for kind in (spec.geoms, spec.meshes, spec.equalities):
            for one in list(kind):
                spec.delete(one)
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        assert tuple(self.model.joint(i).name for i in range(self.model.njnt)) == arm.joints
        self.model.dof_damping[:] = 0.0

    @staticmethod
    def _turn(body: mujoco.MjsBody, joint: mujoco.MjsJoint, value: float) -> None:
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
            shift = np.zeros(3)
            mujoco.mju_rotVecQuat(shift, value * axis, np.array(body.quat))
            body.pos = np.array(body.pos) + shift
        else:
            turn, quat = np.zeros(4), np.zeros(4)
            mujoco.mju_axisAngle2Quat(turn, axis, value)
            mujoco.mju_mulQuat(quat, np.array(body.quat), turn)
            body.quat = quat

    def inertia(self, q: Floats) -> Floats:
        """D(q)."""
        self._forward(q, np.zeros(self.model.nv))
        full = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, full)
        return full

    def bias(self, q: Floats, velocity: Floats) -> Floats:
        """H(q, q̇) + G(q)."""
        self._forward(q, velocity)
        return np.array(self.data.qfrc_bias)

    def _forward(self, q: Floats, velocity: Floats) -> None:
        self.data.qpos[:], self.data.qvel[:] = q, velocity
        mujoco.mj_forward(self.model, self.data)
