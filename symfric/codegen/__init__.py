"""Friction laws and other discrete-time blocks as C99 for embedded controllers."""

from symfric.codegen.block import Block as Block
from symfric.codegen.from_law import law_block as law_block
from symfric.codegen.from_model import plant_block as plant_block
from symfric.codegen.from_population import contact_block as contact_block
from symfric.codegen.generate import Generated as Generated
from symfric.codegen.generate import generate as generate
from symfric.codegen.verify import Check as Check
from symfric.codegen.verify import Verification as Verification
from symfric.codegen.verify import verify as verify
