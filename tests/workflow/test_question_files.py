"""Open questions as a table and a page, and answers read back row by row."""

import csv
import io
import re
from typing import Any

import pytest

from app.errors import InvalidInput, NotFound
from app.learning.differences import regions_to_mark
from app.workflow import runs, tools
from app.workflow.context import Context
from app.workflow.question_files import harmless, questions_csv, questions_page, read_answers
from tests.workflow.conftest import open_questions, settle
from tests.workflow.test_certified_runs import waiting

Json = dict[str, Any]


def table(*rows: tuple[str, str], delimiter: str = ",") -> bytes:
    return "\n".join(delimiter.join(row) for row in (("query id", "answer"), *rows)).encode()


def test_the_table_holds_what_is_asked(sample: Context) -> None:
    run = waiting(sample)
    asked = open_questions(sample, run)
    rows = list(csv.DictReader(io.StringIO(questions_csv(sample, run["id"]))))
    assert [row["query id"] for row in rows] == [q["id"] for q in asked]
    for row, query in zip(rows, asked, strict=True):
        letters = "ABCDEFGHIJKL"
        assert row["left order"].split() == [letters[a] for a in query["left"]["sequence"]]
        assert row["right order"].split() == [letters[a] for a in query["right"]["sequence"]]
        assert (row["tool"], row["difference"], row["answer"]) == (query["tool_name"], query["difference"], "")
        assert "both_wrong = Both are wrong" in row["possible answers"]


def test_the_page_shows_both_orders_of_every_question(sample: Context) -> None:
    """One number per region and picture, each region's number where its step is; no script, nothing loaded."""
    run = waiting(sample)
    asked = open_questions(sample, run)
    name = "A <b> & mould"
    tool = tools.get_tool(sample, asked[0]["tool_id"])
    tools.answer_tool(sample, tool["id"], {"name": name}, tool["version"])
    page = questions_page(sample, run["id"])
    pictures = re.findall(r"<svg.*?</svg>", page)
    assert len(pictures) == 2 * len(asked)
    for picture, count in zip(pictures, [len(q["left"]["sequence"]) for q in asked for _ in range(2)], strict=True):
        assert sorted(map(int, re.findall(r">(\d+)</text>", picture))) == list(range(1, count + 1))
        assert picture.count("<path") >= count
        inside = [(float(x), float(y)) for x, y in re.findall(r'cx="([\d.-]+)" cy="([\d.-]+)"', picture)]
        assert all(0 < x < 360 and 0 < y < 240 for x, y in inside)
    assert pictures[0].count("#b3261e") == len(asked[0]["marked"])
    assert page.count("<li><i></i>") == 5 * len(asked)
    assert "A &lt;b&gt; &amp; mould" in page
    assert name not in page
    assert not re.search(r"<script|https?:|src=|url\(", page.replace('xmlns="http://www.w3.org/2000/svg"', ""))


def test_valid_rows_count_and_faults_are_named(sample: Context) -> None:
    run = waiting(sample)
    first = open_questions(sample, run)[0]
    unknown = "0" * 8
    report = read_answers(sample, run["id"], table((unknown, "left"), (first["id"], "similar"), (first["id"], "left")))
    assert report["applied"] == []
    assert [fault["line"] for fault in report["faults"]] == [2, 3, 4]
    assert unknown in report["faults"][0]["text"]
    assert "left, right, equal, both_wrong, cant_tell, not 'similar'" in report["faults"][1]["text"]
    assert "same question as line 3" in report["faults"][2]["text"]
    assert sample.jobs.wait_idle(60)
    assert open_questions(sample, run)[0]["id"] == first["id"]

    report = read_answers(sample, run["id"], table((first["id"], "The right one"), ("", "left"), delimiter=";"))
    assert [(row["line"], row["query_id"], row["value"]) for row in report["applied"]] == [(2, first["id"], "right")]
    assert [fault["line"] for fault in report["faults"]] == [3]
    again = read_answers(sample, run["id"], table((first["id"], "left")))
    assert (again["applied"], again["faults"]) == ([], [])
    assert "answered before: The right one" in again["already"][0]["text"]
    assert runs.get_query(sample, first["id"])["answer"]["value"] == "right"


def test_a_filled_table_takes_the_run_on_and_can_be_undone(sample: Context) -> None:
    """The downloaded table with the last column filled in, as a spreadsheet saves it."""
    run = waiting(sample)
    count = len(open_questions(sample, run))
    rows = list(csv.reader(io.StringIO(questions_csv(sample, run["id"]))))
    filled = [rows[0], *[[*row[:-1], "0"] for row in rows[1:]]]
    file = io.StringIO()
    csv.writer(file).writerows([*filled, [""] * len(rows[0])])
    report = read_answers(sample, run["id"], file.getvalue().encode("utf-8-sig"))
    assert [row["value"] for row in report["applied"]] == ["cant_tell"] * count
    assert report["run_state"] in ("training", "waiting_for_expert", "converged")
    assert settle(sample, run)["answered"] == count
    assert runs.undo_answer(sample, report["applied"][0]["id"])["state"] == "open"


@pytest.mark.parametrize("head", ["Query ID;Answer", "answer\tquery_id", "note,QUERY ID,ANSWER"])
def test_headers_vary(sample: Context, head: str) -> None:
    run = waiting(sample)
    key = open_questions(sample, run)[0]["id"]
    mark = next(m for m in ";\t," if m in head)
    row = mark.join({"answer": "equal", "note": "x"}.get(name.lower(), key) for name in head.split(mark))
    assert read_answers(sample, run["id"], f"{head}\r\n{row}\r\n".encode())["applied"][0]["value"] == "equal"


def test_rows_without_an_answer_stay_open(sample: Context) -> None:
    run = waiting(sample)
    report = read_answers(sample, run["id"], questions_csv(sample, run["id"]).encode())
    assert (report["left_open"], report["applied"], report["faults"]) == (len(open_questions(sample, run)), [], [])


def test_questions_of_another_run_are_refused(sample: Context) -> None:
    run = waiting(sample)
    old = open_questions(sample, run)[0]
    runs.cancel(sample, run["id"])
    other = waiting(sample)
    assert "another run" in read_answers(sample, other["id"], table((old["id"], "left")))["faults"][0]["text"]
    assert "no longer asked" in read_answers(sample, run["id"], table((old["id"], "left")))["faults"][0]["text"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "'query id' and 'answer'"),
        (b"query id;note\n1;2\n", "'answer'"),
        (b"\x00\x01\x02", "not text"),
        (b"a" * 1_000_001, "larger than 1 MB"),
    ],
)
def test_files_that_are_no_table_are_refused(sample: Context, content: bytes, words: str) -> None:
    run = waiting(sample)
    with pytest.raises(InvalidInput, match=words):
        read_answers(sample, run["id"], content)


def test_an_unknown_run(sample: Context) -> None:
    for act in (questions_csv, questions_page):
        with pytest.raises(NotFound):
            act(sample, "nothing")
    with pytest.raises(NotFound):
        read_answers(sample, "nothing", b"query id,answer\n")


def test_names_are_no_formulas() -> None:
    assert harmless("=1+1") == "'=1+1"
    assert harmless("Trough 07") == "Trough 07"


def test_only_what_the_sentence_names_is_marked_where_most_regions_differ() -> None:
    assert regions_to_mark((0, 1, 2, 3, 4), (0, 2, 1, 3, 4)) == (1, 2)
    assert regions_to_mark((0, 1, 2, 3, 4), (4, 3, 2, 1, 0)) == (0, 4)
    assert regions_to_mark((0, 1, 2, 3, 4), (1, 2, 3, 4, 0)) == (0, 1)
    assert regions_to_mark((0, 1, 2, 3, 4), (3, 0, 1, 4, 2)) == (0, 3, 2)
