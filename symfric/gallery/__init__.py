"""Figures of the source papers, one function each, with comparisons and distances.

The folder `examples` shows the use of the packages, from data or equations to a result.

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
