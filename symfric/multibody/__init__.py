"""Mechanisms: rigid bodies, joints with friction from reactions, and forces give a `Model`."""

from symfric.multibody.body import GROUND as GROUND
from symfric.multibody.body import Body as Body
from symfric.multibody.constraints import Constraint as Constraint
from symfric.multibody.constraints import PrescribedMotion as PrescribedMotion
from symfric.multibody.constraints import UserConstraint as UserConstraint
from symfric.multibody.forces import Force as Force
from symfric.multibody.forces import Gravity as Gravity
from symfric.multibody.forces import JointSpringDamper as JointSpringDamper
from symfric.multibody.forces import SpringDamper as SpringDamper
from symfric.multibody.forces import UserForce as UserForce
from symfric.multibody.friction import JointFriction as JointFriction
from symfric.multibody.functions import functions as functions
from symfric.multibody.joints import ALL_JOINTS as ALL_JOINTS
from symfric.multibody.joints import Cylindrical as Cylindrical
from symfric.multibody.joints import Distance as Distance
from symfric.multibody.joints import Fixed as Fixed
from symfric.multibody.joints import Free as Free
from symfric.multibody.joints import Joint as Joint
from symfric.multibody.joints import Planar as Planar
from symfric.multibody.joints import PointOnLine as PointOnLine
from symfric.multibody.joints import Prismatic as Prismatic
from symfric.multibody.joints import Revolute as Revolute
from symfric.multibody.joints import Spherical as Spherical
from symfric.multibody.joints import Universal as Universal
from symfric.multibody.mechanism import Mechanism as Mechanism
from symfric.multibody.spatial import Frame as Frame
