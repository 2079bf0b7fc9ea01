"""Questions as a file, for experts who can't come to the pages, and the answers read back.

The table and the printable page hold the open questions of a run. Answers go through `queries.answer` one by one, so that a
file can do no more than a person who clicks.
"""

import csv
import io
from collections.abc import Iterator
from typing import Any

from sqlmodel import Session

from app.errors import AlreadyAnswered, AppError, InvalidInput, TooLarge
from app.geometry.table_text import delimiter_of, plain
from app.storage.tables import Run, ToolRow
from app.workflow.context import Context
from app.workflow.lookup import found, ready_segmentation
from app.workflow.queries import answer, get_query, list_queries
from app.workflow.question_page import page_of
from app.workflow.tool_picture import picture

Json = dict[str, Any]

COLUMNS = ("query id", "number", "tool", "question", "left order", "right order", "difference", "possible answers", "answer")
KEY, GIVEN = "query id", "answer"  # the columns that are read
MOST_BYTES = 1_000_000
UTF16 = (b"\xff\xfe", b"\xfe\xff")


def questions_csv(ctx: Context, run_id: str) -> str:
    """The open questions as a table whose last column waits for answers."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for query in list_queries(ctx, run_id=run_id, state="open"):
        names = _names(ctx, query["tool_id"])
        orders = [" ".join(names[a] for a in query[side]["sequence"]) for side in ("left", "right")]
        accepted = " / ".join(f"{c['value']} = {c['label']}" for c in query["choices"])
        words = (query["tool_name"], query["title"], *orders, query["difference"], accepted)
        writer.writerow([query["id"], query["number"], *map(harmless, words), ""])
    return file.getvalue()


def questions_page(ctx: Context, run_id: str) -> str:
    """The open questions as one printable page with pictures, nothing loaded from elsewhere."""
    queries = list_queries(ctx, run_id=run_id, state="open")

    def draw(session: Session) -> list[Json]:
        found(session, Run, run_id, "run")
        return [_drawn(ctx, session, query) for query in queries]

    return page_of(ctx.store.read(draw))


def read_answers(ctx: Context, run_id: str, content: bytes) -> Json:
    """Answer the questions of a run from a table; each row counts or is named with its fault.

    Raises:
        InvalidInput: The file is no table, or lacks a column that is needed.
        NotFound: There is no such run.
    """
    ctx.store.read(lambda session: found(session, Run, run_id, "run").id)
    report: Json = {"applied": [], "already": [], "faults": [], "left_open": 0}
    seen: dict[str, int] = {}
    for line, key, given in _rows(_text(content)):
        if not given:
            report["left_open"] += 1
        elif key in seen:
            report["faults"].append({"line": line, "text": f"Line {line} answers the same question as line {seen[key]}; the first counts."})
        else:
            seen[key] = line
            _apply(ctx, run_id, line, key, given, report)
    report["run_state"] = ctx.store.read(lambda session: found(session, Run, run_id, "run").state)
    return report


def harmless(text: str) -> str:
    """A spreadsheet must not take a name for a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") else text


def _apply(ctx: Context, run_id: str, line: int, key: str, given: str, report: Json) -> None:
    """One row, by the same way as a click."""
    try:
        query = get_query(ctx, key)
        if query["run_id"] != run_id:
            raise InvalidInput("This question belongs to another run.")
        row = answer(ctx, key, _value(query, given))
        report["applied"].append({"line": line, "query_id": key, "tool_name": query["tool_name"], "value": row["value"], "id": row["id"]})
    except AlreadyAnswered as error:
        report["already"].append({"line": line, "query_id": key, "text": f"Line {line}: {error}"})
    except AppError as error:
        report["faults"].append({"line": line, "text": f"Line {line}: {error}"})


def _value(query: Json, given: str) -> str:
    """The answer by its value, its words or its key; an unknown one is left as it is, to be refused like any other."""
    wanted = given.casefold()
    for choice in query["choices"]:
        if wanted in (choice["value"], choice["label"].casefold(), choice["key"], choice["value"].replace("_", " ")):
            return choice["value"]
    return given[:60]


def _rows(text: str) -> Iterator[tuple[int, str, str]]:
    """(line, query id, answer) of each row that holds anything."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter_of(text, {plain(KEY), plain(GIVEN)}))
    try:
        header = [plain(name) for name in next(reader, [])]
        missing = [name for name in (KEY, GIVEN) if plain(name) not in header]
        if missing:
            raise InvalidInput(
                f"The first line lacks the column {' and '.join(repr(name) for name in missing)}. "
                f"Accepted is the table that was downloaded, or one with the columns {KEY!r} and {GIVEN!r}."
            )
        columns = [header.index(plain(KEY)), header.index(plain(GIVEN))]
        for row in reader:
            if any(cell.strip() for cell in row):
                key, given = (row[c].strip() if c < len(row) else "" for c in columns)
                yield reader.line_num, key[:64], given
    except csv.Error as error:
        raise InvalidInput(f"Line {reader.line_num} can't be read as a table: {error}.") from error


def _text(content: bytes) -> str:
    if len(content) > MOST_BYTES:
        raise TooLarge("The file is larger than 1 MB; a table of answers is a short CSV file.")
    for encoding in ("utf-16",) if content.startswith(UTF16) else ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InvalidInput("This is not text. Accepted is a table of answers as CSV in UTF-8.")


def _names(ctx: Context, tool_id: str) -> list[str]:
    def query(session: Session) -> list[str]:
        cut = ready_segmentation(session, found(session, ToolRow, tool_id, "tool"))
        return [region.name for region in ctx.values.tool(session, cut).regions]

    return ctx.store.read(query)


def _drawn(ctx: Context, session: Session, query: Json) -> Json:
    """A question with its two pictures and its orders in region names."""
    tool = ctx.values.tool(session, ready_segmentation(session, found(session, ToolRow, query["tool_id"], "tool")))

    def side(which: str) -> Json:
        order, label = query[which]["sequence"], query[which]["label"]
        names = [(tool.regions[a].name, a in query["marked"]) for a in order]
        return {**query[which], "names": names, "svg": picture(tool, order, query["marked"], f"{query['tool_name']}, order {label}")}

    return {**query, "left": side("left"), "right": side("right")}
