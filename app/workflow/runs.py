from app.errors import RunActive
from app.workflow.lookup import active_run
def refuse_while_training(session, row):
    if active_run(session, row.id): raise RunActive("x")
