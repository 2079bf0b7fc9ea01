"""What routes share: the context, versions (ETag, If-Match), pages of a list, bounded field types."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from fastapi import Depends, Header, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from app import errors
from app.workflow.context import Context

Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=120)]
RegionId = Annotated[int, Field(ge=0, le=100_000, description="Position in the tool's list of regions.")]
RegionOrder = Annotated[list[RegionId], Field(max_length=1000, description="Region ids in working order.")]
Seed = Annotated[int, Field(ge=0, lt=2**31)]
Json = dict[str, Any]


class Body(BaseModel):
    """A request body: unknown fields are refused, so a typo can't pass unnoticed."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class Row(BaseModel):
    """A response body; newer servers may add fields."""

    model_config = ConfigDict(extra="allow")


def context(request: Request) -> Context:
    """The one workflow context of this application."""
    return request.app.state.context


Ctx = Annotated[Context, Depends(context)]


def expected_version(
    if_match: Annotated[str, Header(alias="If-Match", pattern=r'^(W/)?"?\d{1,18}"?$', examples=['"3"'], description="The ETag last seen.")],
) -> int:
    """The version the caller has seen."""
    return int(if_match.removeprefix("W/").strip('"'))


Version = Annotated[int, Depends(expected_version)]


class Window(BaseModel):
    """Which part of a list is wanted."""

    limit: int
    after: str | None


def window(
    limit: Annotated[int, Query(ge=1, le=100, description="At most this many items.")] = 100,
    after: Annotated[str | None, Query(max_length=64, description="`next` of the page before.")] = None,
) -> Window:
    """Paging parameters of every list."""
    return Window(limit=limit, after=after)


Paging = Annotated[Window, Depends(window)]


def page(items: Sequence[Mapping[str, Any]], wanted: Window) -> Json:
    """`{items, next}`: the items behind the one called `after`; `next` is null on the last page.

    Raises:
        InvalidInput: `after` is no item of this list (any more).
    """
    start = 0
    if wanted.after is not None:
        ids = [str(item["id"]) for item in items]
        if wanted.after not in ids:
            raise errors.InvalidInput("The list no longer holds the item named by `after`; start again without it.")
        start = ids.index(wanted.after) + 1
    part = list(items[start : start + wanted.limit])
    more = start + wanted.limit < len(items)
    return {"items": part, "next": part[-1]["id"] if more else None}


def tagged(response: Response, row: Json) -> Json:
    """`row`, with its version as the response's ETag."""
    response.headers["ETag"] = f'"{row["version"]}"'
    return row


def located(response: Response, collection: str, row: Json) -> Json:
    """`row`, with the Location of what was made and its ETag where it has a version."""
    response.headers["Location"] = f"/api/v1/{collection}/{row['id']}"
    return tagged(response, row) if "version" in row else row
