"""What every workflow function works on, opened once per server."""

from dataclasses import dataclass

from app.geometry import parser_process
from app.jobs.dispatcher import Jobs
from app.settings import Settings
from app.storage import Store, migrate
from app.workflow.handlers import WARM_UP, register
from app.workflow.values import Values


@dataclass(frozen=True)
class Context:
    """Database, background work and core values kept in memory."""

    settings: Settings
    store: Store
    jobs: Jobs
    values: Values

    def close(self) -> None:
        """Stop background work, finish writes, close the database."""
        self.jobs.close()
        self.store.close()
        if self.settings.executor != "inline":
            parser_process.shut_down()


def open_context(settings: Settings) -> Context:
    """Migrate and open the database; unfinished work goes on."""
    migrate(settings)
    store = Store(settings)
    values = Values(store)
    jobs = Jobs(store, settings, WARM_UP)
    register(jobs, values)
    jobs.start()
    if settings.executor != "inline":
        parser_process.warm_up()  # the first upload would wait for it
    return Context(settings, store, jobs, values)
