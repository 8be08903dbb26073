"""Jobs in processes of their own, and their bounds."""

import anyio
import pytest

from formiga_bt.base.errors import FormigaError
from formiga_bt.llm.mcp.ground import ServerFiles
from formiga_bt.llm.mcp.judge import JudgeJob
from formiga_bt.llm.mcp.worker import AT_ONCE, MOST_WAITING, JobProcesses
from tests.golden import Wording

pytestmark = pytest.mark.network
CHECK = JudgeJob(kind="check", yaml="formiga: 1\n")


def test_a_job_that_takes_too_long_is_given_up(wording: Wording) -> None:
    async def late() -> None:
        await JobProcesses(ServerFiles(), {"check": 0.001}).do(CHECK)

    with pytest.raises(FormigaError) as refused:
        anyio.run(late)
    wording(refused.value)


def test_more_than_can_wait_are_refused() -> None:
    async def many() -> list[str]:
        crew, said = JobProcesses(ServerFiles(), {"check": 0.001}), []

        async def one() -> None:
            try:
                await crew.do(CHECK)
            except FormigaError as error:
                said.append(str(error).partition("\n")[0])

        async with anyio.create_task_group() as group:
            for _ in range(AT_ONCE + MOST_WAITING + 1):
                group.start_soon(one)
        return said

    said = anyio.run(many)
    assert said.count("2 jobs run and 8 wait") == 1
    assert said.count("given up after 0.001 s of computing") == AT_ONCE + MOST_WAITING


def test_an_error_of_the_site_is_told(wording: Wording) -> None:
    async def wrong() -> None:
        await JobProcesses(ServerFiles("/nowhere/site.yaml")).do(CHECK)

    with pytest.raises(FormigaError) as refused:
        anyio.run(wrong)
    wording(refused.value)
