"""Injured files and tables through the real server: it answers each with a tool or a sentence, and stays up."""

import numpy as np
import pytest

from tests.conftest import Api, LiveServer
from tests.geometry.cad_files import FILES
from tests.geometry.mutations import mutated
from tests.geometry.test_fuzz import SIGNS_OF_A_LEAK, TABLES

EACH = 3


@pytest.mark.timeout(600)
def test_the_server_survives_injured_uploads(live_server: LiveServer, live_api: Api) -> None:
    project = live_api.post("/projects", {"name": "Injured"})["id"]
    random = np.random.default_rng(7)
    cases = [("", kind, name, content) for kind, (name, content) in FILES.items()]
    cases += [("/region-table", "csv", "table.csv", content.encode()) for content in TABLES.values()]
    answers = []
    for path, kind, name, content in cases * EACH:
        files = {"file": (name, mutated(kind, content, random, most=1))}
        response = live_api.client.post(f"/api/v1/projects/{project}/tools{path}", files=files)
        answers.append(response.status_code)
        assert response.status_code in (201, 413, 422), response.text
        if response.status_code != 201:
            detail = response.json()["detail"]
            assert detail.endswith("."), detail
            assert not [sign for sign in SIGNS_OF_A_LEAK if sign in detail], detail
    assert {201, 422} <= set(answers)
    assert live_server.process is not None
    assert live_server.process.poll() is None
    assert live_api.get("/projects")["items"][0]["id"] == project
    assert "Traceback" not in live_server.log.read_text()
