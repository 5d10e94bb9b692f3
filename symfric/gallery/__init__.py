"""The figures of the source papers, a function each, with what is compared and how far we are.

What users do with the packages, from data or equations to a result, is in the folder `examples`.

from symfric.gallery import plates

plate = plates()["self_tuning/fig_07_shape_factor"](quick=True)
plate.picture.savefig("fig_07.png")
"""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.gallery.plate import Plate as Plate
    from symfric.gallery.plate import chosen as chosen
    from symfric.gallery.plate import plate_of as plate_of
    from symfric.gallery.plate import plates as plates
    from symfric.gallery.plate import script as script
    from symfric.gallery.plate import scripts as scripts
    from symfric.gallery.plate import short as short

load_lazily(__name__)
