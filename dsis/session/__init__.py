"""Sessions: plans, votes, people in the browser, simulated observers, export."""

from dsis.session.export import export_votes
from dsis.session.panel import add_to_panel
from dsis.session.personal import forget
from dsis.session.plan import draw_plan, plan_remarks
from dsis.session.planning import plan_panel
from dsis.session.robots import run_robots
from dsis.session.server import serve
from dsis.session.setup import read_setup
from dsis.session.sheets import read_typed_votes, write_sheets
from dsis.session.status import status
from dsis.session.validate import validate_panel, validate_plan

__all__ = [
    "add_to_panel",
    "draw_plan",
    "export_votes",
    "forget",
    "plan_panel",
    "plan_remarks",
    "read_setup",
    "read_typed_votes",
    "run_robots",
    "serve",
    "status",
    "validate_panel",
    "validate_plan",
    "write_sheets",
]
