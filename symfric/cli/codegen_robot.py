"""`symfric codegen ROBOT.urdf --inverse-dynamics`: what the options mean."""

from pathlib import Path

from symfric import law_from_text, with_values
from symfric.cli.machines import kind_of
from symfric.codegen import Block, inverse_dynamics_block
from symfric.foundation.parameters import check_names, parameters
from symfric.multibody import Mechanism, read_urdf
from symfric.scenes.mechanism import MechanismScene

FLAG = "--inverse-dynamics"


def robot_block(
    file: Path | None,
    scene: str | None,
    law: str | None,
    values: dict[str, float],
    *,
    name: str | None,
    h: float | None,
    fold: bool,
    payload: str | None,
    tunable_gravity: bool,
) -> Block:
    """The inverse dynamics of a robot's file or of a scene.

    Args:
        file, scene: one of them; a scene may be a robot's file, too.
        law: in all joints; of a file without one, what its tags say.
        values: parameters of the scene or of the law, which become its defaults.
        fold: the numbers of friction become constants.
        payload: frame that carries a load; its inertia is a parameter, too.

    Raises:
        ValueError: both or none of them; no mechanism; as `inverse_dynamics_block`.
    """
    where = file if scene is None else scene
    if where is None or (file is not None and scene is not None):
        got = "neither" if where is None else "both"
        raise ValueError(f"{FLAG}: expected a robot's FILE.urdf or --scene NAME, got {got}")
    if file is not None and file.suffix.lower() != ".urdf":
        raise ValueError(f"{FLAG}: expected a robot's FILE.urdf, got '{file}'")
    return inverse_dynamics_block(
        _mechanism(str(where), law, values),
        name=name,
        h=h,
        fold=fold,
        payload=payload,
        payload_inertia=payload is not None,
        tunable_gravity=tunable_gravity,
    )


def _mechanism(scene: str, law: str | None, values: dict[str, float]) -> Mechanism:
    if law is None and scene.endswith(".urdf"):
        if values:
            raise ValueError(f"{FLAG}: --set: expected with --law only, got {', '.join(values)}")
        return read_urdf(scene)
    if law is None:
        raise ValueError(f"{FLAG}: expected --law NAME with --scene {scene}, got none")
    machine = kind_of(scene, "--scene")(law_from_text(law))
    check_names(f"--set of {scene}", values, parameters(machine))
    if not isinstance(machine, MechanismScene):
        raise ValueError(f"{FLAG}: expected a scene of bodies and joints, got {scene}")
    return with_values(machine, values).mechanism()
