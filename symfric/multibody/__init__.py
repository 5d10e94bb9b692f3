"""Mechanisms of rigid bodies, joints with friction from reactions, and forces.

`Mechanism.build` assembles them into a `Model`.
"""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.multibody.belts import Belt as Belt
    from symfric.multibody.belts import CapstanDrum as CapstanDrum
    from symfric.multibody.brakes import BandBrake as BandBrake
    from symfric.multibody.brakes import DiscClutch as DiscClutch
    from symfric.multibody.brakes import DrumBrake as DrumBrake
    from symfric.multibody.brakes import shoe_arms as shoe_arms
    from symfric.multibody.constraints import Constraint as Constraint
    from symfric.multibody.constraints import PrescribedMotion as PrescribedMotion
    from symfric.multibody.constraints import UserConstraint as UserConstraint
    from symfric.multibody.couplings import Cam as Cam
    from symfric.multibody.couplings import Gear as Gear
    from symfric.multibody.couplings import Rolling as Rolling
    from symfric.multibody.couplings import Screw as Screw
    from symfric.multibody.efficiency import efficiency as efficiency
    from symfric.multibody.element_friction import CamFriction as CamFriction
    from symfric.multibody.element_friction import ElementFriction as ElementFriction
    from symfric.multibody.element_friction import MeshFriction as MeshFriction
    from symfric.multibody.element_friction import ThreadFriction as ThreadFriction
    from symfric.multibody.element_friction import mesh_arm as mesh_arm
    from symfric.multibody.forces import Force as Force
    from symfric.multibody.forces import Gravity as Gravity
    from symfric.multibody.forces import JointSpringDamper as JointSpringDamper
    from symfric.multibody.forces import JointStop as JointStop
    from symfric.multibody.forces import SpringDamper as SpringDamper
    from symfric.multibody.forces import UserForce as UserForce
    from symfric.multibody.joint import Joint as Joint
    from symfric.multibody.joint import JointFriction as JointFriction
    from symfric.multibody.joints import ALL_JOINTS as ALL_JOINTS
    from symfric.multibody.joints import Cylindrical as Cylindrical
    from symfric.multibody.joints import Distance as Distance
    from symfric.multibody.joints import Fixed as Fixed
    from symfric.multibody.joints import Floating as Floating
    from symfric.multibody.joints import PinInSlot as PinInSlot
    from symfric.multibody.joints import Planar as Planar
    from symfric.multibody.joints import PlanarPrismatic as PlanarPrismatic
    from symfric.multibody.joints import PlanarRevolute as PlanarRevolute
    from symfric.multibody.joints import PointOnLine as PointOnLine
    from symfric.multibody.joints import Prismatic as Prismatic
    from symfric.multibody.joints import Revolute as Revolute
    from symfric.multibody.joints import Spherical as Spherical
    from symfric.multibody.joints import Universal as Universal
    from symfric.multibody.kinematics import Kinematics as Kinematics
    from symfric.multibody.mechanism import Mechanism as Mechanism
    from symfric.multibody.named_functions import functions as functions
    from symfric.multibody.spatial import GROUND as GROUND
    from symfric.multibody.spatial import Body as Body
    from symfric.multibody.spatial import Frame as Frame
    from symfric.multibody.urdf import read_urdf as read_urdf

load_lazily(__name__)
