"""The open questions of a run as one page to print: pictures, the difference in words, boxes to tick."""

from html import escape
from typing import Any

Json = dict[str, Any]

STYLE = """
body { font: 14px/1.45 system-ui, sans-serif; color: #1b232b; background: #fff; max-width: 800px; margin: 24px auto; padding: 0 16px; }
h1 { font-size: 22px; margin: 0 0 4px; } h2 { font-size: 17px; margin: 0; } p { margin: 4px 0; }
section { border-top: 1px solid #9aa5b1; padding: 14px 0; break-inside: avoid; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 16px; margin: 8px 0; }
figure { margin: 0; } svg { width: 100%; height: auto; border: 1px solid #d3d9df; border-radius: 4px; }
figcaption { display: flex; flex-wrap: wrap; gap: 2px 10px; } .differs { font-weight: 700; } .signed { margin: 14px 0 18px; }
ul { display: flex; flex-wrap: wrap; gap: 6px 22px; list-style: none; margin: 8px 0 4px; padding: 0; }
li i { display: inline-block; width: 13px; height: 13px; border: 1.5px solid #1b232b; border-radius: 2px; margin-right: 7px; }
small { color: #55606b; }
@page { margin: 14mm; }
""".strip()
INTRODUCTION = (
    "Each question shows one tool twice. The numbers say in which order its regions are worked; the letters below each picture are "
    "the names of these regions. A thick ring marks where to look first. Tick one box per question. What you leave open stays open."
)
SIGNED = "Answered by ______________________________ on ____________________"


def page_of(queries: list[Json]) -> str:
    """The page; each query has `svg` and `names` in both of its sides."""
    sections = "".join(_section(query, number) for number, query in enumerate(queries, start=1))
    content = f"<p>{INTRODUCTION}</p><p class='signed'>{SIGNED}</p>{sections}" if queries else "<p>No question is open at the moment.</p>"
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Questions about orders of work</title><style>{STYLE}</style></head>"
        f"<body><h1>Questions about orders of work</h1>{content}</body></html>"
    )


def _section(query: Json, number: int) -> str:
    boxes = "".join(f"<li><i></i>{_words(choice)}</li>" for choice in query["choices"])
    return (
        f"<section><h2>{number}. {escape(query['tool_name'])}</h2><p>{escape(query['title'])}</p>"
        f'<div class="pair">{_figure(query["left"])}{_figure(query["right"])}</div>'
        f"<p>{escape(query['difference'])}</p><ul>{boxes}</ul><small>In the table of answers: {escape(query['id'])}</small></section>"
    )


def _words(choice: Json) -> str:
    return escape(choice["label"]) + (f" <small>{escape(choice['hint'])}</small>" if choice["hint"] else "")


def _figure(side: Json) -> str:
    steps = enumerate(side["names"], start=1)
    names = " ".join(
        f"<span{' class=differs' if marked else ''}><small>{step}</small> {escape(name)}</span>" for step, (name, marked) in steps
    )
    return f"<figure>{side['svg']}<figcaption><b>{escape(side['label'])}</b>{names}</figcaption></figure>"
