"""How far a project is, and the one thing to do next, in plain words."""

from dataclasses import dataclass
from typing import Any

from sqlmodel import Session, col, select

from app.storage.tables import ACTIVE_RUN_STATES, Plan, PlaybackRow, PolicyRow, Query, Run, ToolRow
from app.workflow.lookup import standing, tools_of

Json = dict[str, Any]

ENOUGH = 2  # demonstrations of tools that are not marked for training


@dataclass(frozen=True)
class Progress:
    """What stages and next step are decided on."""

    tools: list[ToolRow]
    demonstrated: list[str]  # tool ids
    rho: float | None
    questions: list[Query]
    runs: list[Run]
    policies: list[PolicyRow]
    plans: list[Plan]
    playbacks: list[PlaybackRow]

    @staticmethod
    def of(session: Session, project_id: str, rho: float | None) -> "Progress":
        def rows(table: Any, *conditions: Any) -> list[Any]:
            return list(session.exec(select(table).where(table.project_id == project_id, *conditions).order_by(col(table.id))))

        return Progress(
            tools=tools_of(session, project_id),
            demonstrated=list(dict.fromkeys(d.tool_id for d in standing(session, project_id))),
            rho=rho,
            questions=rows(Query, Query.state == "open"),
            runs=rows(Run),
            policies=rows(PolicyRow),
            plans=rows(Plan),
            playbacks=rows(PlaybackRow),
        )

    @property
    def ready(self) -> list[ToolRow]:
        return [t for t in self.tools if t.state == "ready"]

    @property
    def to_record(self) -> list[ToolRow]:
        """Tools that should be demonstrated: those for training, and the first ones of any."""
        missing = [t for t in self.ready if t.id not in self.demonstrated and t.split != "test"]
        few = len(self.demonstrated) < ENOUGH
        return [t for t in missing if t.split == "train" or few]

    @property
    def active(self) -> Run | None:
        return next((run for run in reversed(self.runs) if run.state in ACTIVE_RUN_STATES), None)

    def tool_name(self, tool_id: str) -> str:
        return next((t.name for t in self.tools if t.id == tool_id), "a tool")


def stages(p: Progress) -> list[Json]:
    """The six stations with a few words each."""
    return [
        _station("tools", *_tools(p)),
        _station("demonstrations", *_demonstrations(p)),
        _station("coverage", *_coverage(p)),
        _station("teach", *_teach(p)),
        _station("policy", *_policy(p)),
        _station("robot", *_robot(p)),
    ]


def _station(key: str, state: str, meta: str) -> Json:
    return {"key": key, "state": state, "meta": meta}


def _tools(p: Progress) -> tuple[str, str]:
    asking = [t for t in p.tools if t.state == "asking"]
    if asking:
        return "wait", f"{count(len(asking), 'file')} to set up"
    if not p.tools:
        return "todo", "None yet"
    return ("done" if p.ready and all(t.state != "importing" for t in p.tools) else "doing"), count(len(p.tools), "tool")


def _demonstrations(p: Progress) -> tuple[str, str]:
    done, missing = len(p.demonstrated), len(p.to_record)
    if not done:
        return "todo", "None yet"
    return ("doing", f"{done} of {done + missing}") if missing else ("done", str(done))


def _coverage(p: Progress) -> tuple[str, str]:
    if p.rho is None:
        return "todo", "After the first demonstration"
    return ("done" if p.rho >= 0.95 else "doing"), f"{p.rho:.2f}"


def _teach(p: Progress) -> tuple[str, str]:
    if p.questions:
        return "wait", f"{count(len(p.questions), 'question')} waiting"
    if p.active:
        return "doing", "Learning"
    if not p.runs:
        return "todo", "Not started"
    last = p.runs[-1]
    words = {"stalled": "Stopped: nothing left to learn", "infeasible": "Contradiction", "failed": "Stopped", "cancelled": "Cancelled"}
    if p.policies:
        return "done", "Taught" if not p.policies[-1].effort_weights else "Taught, with effort"
    return "doing", words.get(last.state, "Learning")


def _policy(p: Progress) -> tuple[str, str]:
    if not p.policies:
        return "todo", "After teaching"
    planned = len({plan.tool_id for plan in p.plans})
    return ("done", f"{count(planned, 'tool')} planned") if planned else ("doing", "No order planned")


def _robot(p: Progress) -> tuple[str, str]:
    ready = [b for b in p.playbacks if b.state == "ready"]
    if ready:
        flawed = flawed_regions(ready[-1])
        return ("doing", f"{count(flawed, 'region')} to look at") if flawed else ("done", "Previewed")
    return ("doing", "Being computed") if any(b.state in ("queued", "running") for b in p.playbacks) else ("todo", "Not started")


def flawed_regions(playback: PlaybackRow) -> int:
    """Regions of a playback with problems."""
    return sum(1 for region in (playback.summary or {}).get("regions", []) if region["problems"])


def next_step(p: Progress) -> Json:
    """The one obvious thing to do now."""
    return _tool_step(p) or _teach_step(p) or _use_step(p)


def _step(title: str, text: str, label: str, page: str, tool_id: str | None = None) -> Json:
    return {"title": title, "text": text, "label": label, "page": page, "tool_id": tool_id}


def _tool_step(p: Progress) -> Json | None:
    asking = next((t for t in p.tools if t.state == "asking"), None)
    if asking:
        text = "The file doesn't say its units or which side is up. Two clicks settle it."
        return _step(f"Set up {asking.name}", text, "Answer", "tools", asking.id)
    if p.questions:
        first = p.questions[0]
        name = p.tool_name(first.tool_id)
        same = all(q.tool_id == first.tool_id for q in p.questions)
        title = (
            f"{count(len(p.questions), 'question')} about {name}" if same else f"{count(len(p.questions), 'question')} about your orders"
        )
        text = "Learning goes on by itself as soon as the last one is answered."
        return _step(title, text, "Answer the questions" if len(p.questions) > 1 else "Answer the question", "teach", first.tool_id)
    if not p.ready:
        busy = next((t for t in p.tools if t.state == "importing"), None)
        if busy:
            return _step(f"{busy.name} is being read in", "Its regions show up as soon as they are found.", "Watch", "tools", busy.id)
        return _step("Add a tool", "A CAD file or a region table is all it takes.", "Add a tool", "tools")
    if p.to_record and not p.active and not p.policies:
        tool = p.to_record[0]
        text = "Click its regions in the order you would work on them."
        return _step(f"Record {tool.name}", text, f"Record {tool.name}", "record", tool.id)
    return None


def _teach_step(p: Progress) -> Json | None:
    if p.active:
        return _step("Learning from your orders", "It asks when it needs you.", "Watch", "teach")
    last = p.runs[-1] if p.runs else None
    if last and last.state == "stalled":
        text = "Every order it showed was just as good as yours. Take what it has learned, or record another tool."
        return _step("Nothing left to learn from", text, "Decide", "teach")
    if last and last.state == "infeasible":
        text = "Record one of the orders it names again, or take the compromise it found."
        return _step("No rule explains all orders", text, "Decide", "teach")
    if last and last.state == "failed":
        return _step("Learning stopped", last.message, "Go on", "teach")
    if not p.policies:
        text = f"{count(len(p.demonstrated), 'recorded order')} to learn from. It takes less than a minute, then it asks."
        return _step("Teach your order", text, "Start teaching", "teach")
    if all(run.kind != "effort" for run in p.runs) and p.policies[-1].effort_weights is None:
        text = "Some orders are equally good. A few comparisons show which one is less effort."
        return _step("Say which order is less effort", text, "Compare orders", "teach")
    return None


def _use_step(p: Progress) -> Json:
    policy = p.policies[-1]
    plans = [plan for plan in p.plans if plan.policy_id == policy.id]
    if not plans:
        new = next((t for t in p.ready if t.id not in p.demonstrated), p.ready[0])
        return _step(f"Plan {new.name}", "Nobody has shown this tool. See which order comes out.", f"Plan {new.name}", "policy", new.id)
    plan = plans[-1]
    name = p.tool_name(plan.tool_id)
    shown = [b for b in p.playbacks if b.plan_id == plan.id and b.state != "failed"]
    if not shown:
        return _step(
            f"Watch the robot do {name}", "Reach, collisions and force are checked on the way.", "Watch the robot", "robot", plan.tool_id
        )
    flawed = flawed_regions(shown[-1])
    if flawed:
        text = f"The robot can't work on {'it' if flawed == 1 else 'them'} as planned."
        return _step(f"{count(flawed, 'region')} of {name} to look at", text, "Look at the regions", "robot", plan.tool_id)
    return _step("Plan the next tool", "The policy works on any tool that is read in.", "Plan another tool", "policy")


def count(number: int, noun: str) -> str:
    """'1 tool', '3 tools'."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
