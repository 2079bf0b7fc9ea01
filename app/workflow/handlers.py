"""Which kind of background work is done by whom."""

from app.jobs.dispatcher import Jobs
from app.workflow import bound_job, import_job, playback_job, training_job
from app.workflow.values import Values

WARM_UP = (
    "app.sequencing.warming.warm_up",
    "app.geometry.regions.warm_up",
    "app.learning.many_optima.warm_up",
    "app.learning.version_space.warm_up",
    "app.learning.soft_program.warm_up",
    "app.learning.soft_graph.warm_up",
)


def register(jobs: Jobs, values: Values) -> None:
    """Tell the queue how each kind of job is done."""
    jobs.register(import_job.KIND, import_job.handler(jobs.store, values))
    jobs.register(training_job.KIND, training_job.handler(values))
    jobs.register(playback_job.KIND, playback_job.handler(jobs.store, values))
    jobs.register(bound_job.KIND, bound_job.handler(values))
