"""Settings of the whole test suite."""

import matplotlib as mpl
from hypothesis import settings

mpl.use("Agg")
settings.register_profile("symfric", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("symfric")
