"""Campaigns: many seeded tasks over Berth, on Dask, with a result that does not depend on how they were spread.

docs/campaigns.md; `python -m berth_tools.campaign --help`.
"""

from .run import TaskFailure, is_done, run_tasks
from .summary import summarize
from .tasks import CampaignError, Task, accuracy_tasks, berth_version, evaluation_tasks, perform, render_tasks

__all__ = ["CampaignError", "Task", "TaskFailure", "accuracy_tasks", "berth_version", "evaluation_tasks", "is_done",
           "perform", "render_tasks", "run_tasks", "summarize"]
