"""W063, W071: a constant place of a task that lies outside the fence, in a no-fly region, or far from the base."""

from formiga_bt.base.geo import Place, Position
from formiga_bt.lang.expr.scope import OUTSIDE
from formiga_bt.lang.model import Expr, Site
from formiga_bt.lang.request.binding import run_outside
from formiga_bt.lang.site.far import warn_far, warn_metres
from formiga_bt.lang.site.fence import enters, leaves
from formiga_bt.lang.text.document import Node
from formiga_bt.lang.text.reading import Problems


def warn_outside(expr: Expr, node: Node, site: Site | None, problems: Problems) -> None:
    """Report W071 for a constant place far from the base, else W063 for one that lies outside the site's fence."""
    if warn_far(node, site, problems) or any(read.name not in OUTSIDE or read.field for read in expr.reads):
        return
    type_ = expr.type
    while type_.item is not None:
        type_ = type_.item
    if type_.name not in ("place", "position", "region") or (site is None and not expr.is_const):
        return
    value, none = (expr.const, []) if site is None else run_outside(expr, site, expr.mark, "this")
    if none or (isinstance(value, Place | Position) and warn_metres(value, expr.mark, problems)):
        return
    if leaves(value, site):
        what = f"this lies outside the fence of site {site.name if site is not None else ''}"
        problems.add("W063", expr.mark, what, "choose a place inside, or widen the fence of the site")
    elif enters(value, site):
        what = f"this lies in a no-fly region of site {site.name if site is not None else ''}"
        problems.add("W063", expr.mark, what, "nothing may fly there: choose another place")
