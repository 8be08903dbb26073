"""Nothing of the machine's own is used: no keys of its environment, no folders of its user."""

import os
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def no_models_of_this_machine(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path_factory.mktemp("home")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder / "config"))
    for name in list(os.environ):
        if name.startswith(("FORMIGA_LLM", "OPENAI_", "AZURE_OPENAI_", "GROQ_", "HF_", "HUGGING_FACE")):
            monkeypatch.delenv(name)
    return folder
