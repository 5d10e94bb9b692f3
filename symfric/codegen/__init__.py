"""Friction laws and other discrete-time blocks as C99 for embedded controllers."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.codegen.blocks.block import Block as Block
    from symfric.codegen.blocks.from_law import contact_block as contact_block
    from symfric.codegen.blocks.from_law import law_block as law_block
    from symfric.codegen.blocks.from_model import plant_block as plant_block
    from symfric.codegen.blocks.inverse_dynamics import gravity_block as gravity_block
    from symfric.codegen.blocks.inverse_dynamics import (
        inverse_dynamics_block as inverse_dynamics_block,
    )
    from symfric.codegen.contract import Proof as Proof
    from symfric.codegen.contract import prove as prove
    from symfric.codegen.fixed.generated import FixedPoint as FixedPoint
    from symfric.codegen.fixed.generated import fixed_point as fixed_point
    from symfric.codegen.generated import Generated as Generated
    from symfric.codegen.generated import generate as generate
    from symfric.codegen.verification import Check as Check
    from symfric.codegen.verification import Verification as Verification
    from symfric.codegen.verification import verify as verify

load_lazily(__name__)
