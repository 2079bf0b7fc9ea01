"""Paths, ports and the database address. Tuning constants live beside their algorithms, never here."""

from pathlib import Path

from pydantic_settings import BaseSettings, SettingsConfigDict

ROOT = Path(__file__).resolve().parent.parent


class Settings(BaseSettings):
    """Read from the environment with the prefix APPRENTICE_ (DATABASE_URL without it)."""

    model_config = SettingsConfigDict(env_prefix="APPRENTICE_")

    data: Path = ROOT / "data"  # database, artefacts, temporary uploads
    host: str = "127.0.0.1"  # only loopback is allowed without authentication
    port: int = 8765
    executor: str = "processes"  # "processes" | "inline"
    max_upload_mb: int = 200

    @property
    def database(self) -> Path:
        return self.data / "apprentice.db"

    @property
    def artifacts(self) -> Path:
        return self.data / "artifacts"
