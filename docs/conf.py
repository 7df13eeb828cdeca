"""How the documentation becomes a site: `make docs`."""

import shutil
import sys
from pathlib import Path

from panto_baselines.benchmark.run import read_result
from panto_baselines.report.page import save
from panto_env import __version__

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))

project = "panto-env"
author = "the authors of panto-env"
copyright = "the authors of panto-env, MIT licence"
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    # The project's own, in the folder extensions/.
    "field_comments",
    "generated_pages",
    "equations",
]
exclude_patterns = ["_build", "generated", "environments/generated"]
nitpicky = True
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath", "smartquotes"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
nb_execution_mode = "off"  # a test runs the notebook and writes its outputs

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_class_signature = "separated"
python_use_unqualified_type_names = True
# Types of other projects, and our own names for them: the site links to no other one, since that would need a
# network to build it.
nitpick_ignore_regex = [(r"py:.*", r".*")]

html_theme = "furo"
html_title = f"panto-env {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_domain_indices = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
copybutton_prompt_text = "$ "


def copy_beside(app, exception):
    """Films and the benchmark's own page lie beside the site's pages, where these look for them."""
    if exception is None and app.builder.format == "html":
        shutil.copytree(HERE / "films", Path(app.outdir) / "films", dirs_exist_ok=True)
        page = Path(app.outdir) / "benchmark" / "index.html"
        page.parent.mkdir(exist_ok=True)
        save([read_result(path) for path in sorted((HERE / "benchmark").glob("*.json.gz"))], page)


def setup(app):
    """Sphinx calls this."""
    app.connect("build-finished", copy_beside)
