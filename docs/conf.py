"""Settings of the documentation; `make docs` builds it, see `docs/README.md`."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from symfric import __version__  # noqa: E402

project = "symfric"
author = "the authors of symfric"
release = version = __version__
language = "en"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "docs.machine.sphinx_pages",
    "sphinx.ext.napoleon",  # after ours, which escapes markup
]
source_suffix = {".md": "markdown"}
default_role = "code"
napoleon_custom_sections = [("Attributes", "params_style")]
exclude_patterns = ["README.md", "machine", "made"]
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence", "attrs_inline", "attrs_block"]
myst_heading_anchors = 4
myst_links_external_new_tab = False

autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80
add_module_names = False
toc_object_entries = False

smartquotes = False  # options of commands begin with two hyphens

html_theme = "furo"
html_title = f"symfric {release}"
html_static_path = ["static"]
html_css_files = ["symfric.css", "sliders.css"]
html_copy_source = False
html_show_copyright = False
html_show_sourcelink = False
html_show_search_summary = False  # would be fetched, which browsers refuse to files
html_theme_options = {"navigation_with_keys": False}
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"
copybutton_prompt_text = r"\$ "
copybutton_prompt_is_regexp = True
copybutton_line_continuation_character = "\\"
