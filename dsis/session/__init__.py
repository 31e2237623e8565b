"""Sessions: plans, votes, people in the browser, simulated observers, export."""

from dsis.session.export import export_votes
from dsis.session.plan import draw_plan, plan_remarks
from dsis.session.robots import run_robots
from dsis.session.server import serve
from dsis.session.status import status
from dsis.session.validate import validate_plan

__all__ = [
    "draw_plan",
    "export_votes",
    "plan_remarks",
    "run_robots",
    "serve",
    "status",
    "validate_plan",
]
