"""Loading of the templates of pages, with escaping."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from jinja2 import Template


def page_template(package: str, **filters: Callable[..., Any]) -> Template:
    """The template of a package's page, with additional filters.

    All values are escaped, since they may come from untrusted files; an undefined name is an error.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined  # slow to import

    environment = Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters
    return environment.get_template("page.html.jinja")
