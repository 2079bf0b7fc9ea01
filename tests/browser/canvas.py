"""Clicking and looking at regions in the 3D frame: where a region appears follows from the camera, not from trial."""

import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import Page

from app.geometry.moulds import sample_moulds
from app.geometry.regions import measure
from app.geometry.tool import Tool
from app.viewer.projection import camera_for, label_points, project
from tests.conftest import Api

BESIDE_LABEL = 22  # pixels left of a region's label, where its own colour shows


def sample_tool(name: str) -> Tool:
    """The sample tool as the server sees it."""
    mould = next(m for m in sample_moulds() if m.name == name)
    return measure(mould.mesh, mould.labels)


@dataclass
class Studio:
    """A browser page on the sample project."""

    page: Page
    address: str
    api: Api
    project: dict[str, Any]

    def open(self, name: str, **query: str) -> None:
        words = "&".join(f"{key}={value}" for key, value in query.items())
        self.page.goto(f"{self.address}/p/{self.project['id']}/{name}?{words}")

    def tool(self, name: str) -> dict[str, Any]:
        return next(t for t in self.api.get(f"/projects/{self.project['id']}/tools")["items"] if t["name"] == name)

    def region_pixels(self, tool: Tool) -> np.ndarray:
        """Page pixels (N, 2) of every region's label in the first 3D frame."""
        box = self.page.locator(".view3d iframe").first.bounding_box()
        assert box is not None
        return project(label_points(tool), camera_for(tool), box["width"], box["height"]) + np.array([box["x"], box["y"]])

    def colour(self, pixel: np.ndarray) -> np.ndarray:
        """RGB just left of a label."""
        clip = {"x": float(pixel[0]) - BESIDE_LABEL, "y": float(pixel[1]), "width": 1, "height": 1}
        return np.array(Image.open(io.BytesIO(self.page.screenshot(clip=clip))).convert("RGB"))[0, 0].astype(int)

    def wait_for_colour(self, pixel: np.ndarray, near: np.ndarray, tolerance: int = 48, seconds: float = 60) -> None:
        """Look again until the region beside `pixel` has about the colour `near`."""
        for _ in range(int(seconds / 0.25)):
            seen = self.colour(pixel)
            if np.abs(seen - near).max() <= tolerance:
                return
            self.page.wait_for_timeout(250)
        raise AssertionError(f"expected about {near} at {pixel}, saw {seen}")

    def wait_for_regions(self, pixels: np.ndarray, seconds: float = 60) -> None:
        """Until the tinted regions are drawn; the empty scene is grey."""
        for _ in range(int(seconds / 0.25)):
            if np.ptp(self.colour(pixels[0])) > 12:
                return
            self.page.wait_for_timeout(250)
        raise AssertionError("the regions were not drawn")
