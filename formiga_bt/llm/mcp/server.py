"""Speaks the Model Context Protocol over stdin and stdout: tools, things to read, and a prompt.

The only module that imports `mcp` (the extra `formiga-bt[mcp]`). Called by `formiga mcp`. The protocol's library answers pings,
cancels what is given up, and ends when stdin closes; what takes long is done elsewhere (`worker`), so that it always can.
"""

import sys
import traceback
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Any, Final, TypeVar

import anyio
import msgspec
from mcp import MCPError, types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server

from formiga_bt import __version__
from formiga_bt.base.errors import FormigaError
from formiga_bt.llm.letters import whole
from formiga_bt.llm.mcp import pages
from formiga_bt.llm.mcp.ground import ServerFiles
from formiga_bt.llm.mcp.live import Connect
from formiga_bt.llm.mcp.outside import cleaned
from formiga_bt.llm.mcp.tools import TOOLS, Desk, McpCaller, Tool, in_thread, schema_of
from formiga_bt.llm.mcp.worker import JobProcesses

INVALID_PARAMS: Final = -32602
PAGE: Final = 100
"""Entries of a list that are sent at once."""
PROMPT: Final = "write_a_mission"
LONGEST_REQUEST: Final = 4_000
LONGEST_ERROR: Final = 20_000

Context = ServerRequestContext[Any, Any]
P = TypeVar("P")


class Front:
    """Answers one client.

    Args:
        desk: what tools work with.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._tools = {tool.name: tool for tool in TOOLS}

    def server(self) -> Server[Any]:
        """Return the server of the protocol."""
        return Server(
            "formiga",
            version=__version__,
            title="formiga: missions of drones and people",
            instructions=pages.INSTRUCTIONS,
            on_list_tools=self.list_tools,
            on_call_tool=self.call_tool,
            on_list_resources=self.list_resources,
            on_list_resource_templates=self.list_templates,
            on_read_resource=self.read_resource,
            on_list_prompts=self.list_prompts,
            on_get_prompt=self.get_prompt,
        )

    # -- tools -----------------------------------------------------------------------------------------------------------
    async def list_tools(self, ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListToolsResult:
        """Return the tools with their schemas."""
        del ctx, params
        return types.ListToolsResult(tools=[_described(tool) for tool in TOOLS])

    async def call_tool(self, ctx: Context, params: types.CallToolRequestParams) -> types.CallToolResult:
        """Do what is asked for; what is wrong is told as a result, which a model reads and mends."""
        tool = self._tools.get(params.name)
        if tool is None:
            raise MCPError(
                INVALID_PARAMS, f"there is no tool '{cleaned(params.name, 60)}'; tools: {', '.join(self._tools)}"
            )
        try:
            asked = msgspec.convert(whole(params.arguments or {}), tool.takes)
            given, text = await tool.run(self._desk, asked, McpCaller(_client(ctx), partial(_progress, ctx)))
        except msgspec.ValidationError as error:
            return _wrong(f"{tool.name}: {error}\n  help: its schema tells what it takes")
        except FormigaError as error:
            return _wrong(str(error))
        except Exception as error:  # noqa: BLE001 - told to the client, which goes on
            traceback.print_exc(file=sys.stderr)
            return _wrong(f"{tool.name} went wrong inside formiga ({type(error).__name__}); its log tells where")
        return types.CallToolResult(
            content=[types.TextContent(type="text", text=text)], structured_content=msgspec.to_builtins(given)
        )

    # -- things to read --------------------------------------------------------------------------------------------------
    async def list_resources(
        self, ctx: Context, params: types.PaginatedRequestParams | None
    ) -> types.ListResourcesResult:
        """Return the addresses of texts, a page at a time."""
        del ctx
        ground = await _asked(self._desk.ground())
        found = await in_thread(lambda: list(pages.entries(ground)))
        first = _cursor(params)
        more = str(first + PAGE) if first + PAGE < len(found) else None
        listed = [
            types.Resource(uri=one.uri, name=one.name, title=one.title, mime_type=one.mime)
            for one in found[first : first + PAGE]
        ]
        return types.ListResourcesResult(resources=listed, next_cursor=more)

    async def list_templates(
        self, ctx: Context, params: types.PaginatedRequestParams | None
    ) -> types.ListResourceTemplatesResult:
        """Return the forms of addresses."""
        del ctx, params
        forms = {
            "language/{topic}": "A page of the language",
            "codes/{code}": "A code of the checker",
            "reasons/{code}": "A reason why something waits or failed",
            "trees/{task}": "The file of a task",
        }
        listed = [
            types.ResourceTemplate(uri_template=pages.SCHEME + form, name=form.partition("/")[0], title=title)
            for form, title in forms.items()
        ]
        return types.ListResourceTemplatesResult(resource_templates=listed)

    async def read_resource(self, ctx: Context, params: types.ReadResourceRequestParams) -> types.ReadResourceResult:
        """Return a text."""
        del ctx
        ground = await _asked(self._desk.ground())
        text, mime = await _asked(in_thread(partial(pages.page, str(params.uri), ground)))
        content = types.TextResourceContents(uri=params.uri, mime_type=mime, text=text)
        return types.ReadResourceResult(contents=[content])

    # -- how to begin ----------------------------------------------------------------------------------------------------
    async def list_prompts(self, ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListPromptsResult:
        """Return the one prompt."""
        del ctx, params
        argument = types.PromptArgument(name="request", description="What is to be done, in words.", required=True)
        does = "Write a mission from words: look, write, check, fly, propose."
        return types.ListPromptsResult(
            prompts=[types.Prompt(name=PROMPT, title="Write a mission", description=does, arguments=[argument])]
        )

    async def get_prompt(self, ctx: Context, params: types.GetPromptRequestParams) -> types.GetPromptResult:
        """Return the words with which to begin."""
        del ctx
        if params.name != PROMPT:
            raise MCPError(INVALID_PARAMS, f"there is no prompt '{cleaned(params.name, 60)}'; there is: {PROMPT}")
        request = whole((params.arguments or {}).get("request", ""))
        if len(request) > LONGEST_REQUEST:
            raise MCPError(INVALID_PARAMS, f"the request is longer than {LONGEST_REQUEST:,} characters")
        said = types.TextContent(type="text", text=pages.mission_prompt(request))
        return types.GetPromptResult(messages=[types.PromptMessage(role="user", content=said)])


def _described(tool: Tool) -> types.Tool:
    hints = types.ToolAnnotations(
        read_only_hint=not tool.writes, destructive_hint=False, idempotent_hint=not tool.writes, open_world_hint=False
    )
    return types.Tool(
        name=tool.name,
        title=tool.title,
        description=tool.does,
        input_schema=schema_of(tool.takes),
        output_schema=schema_of(tool.gives),
        annotations=hints,
    )


def _wrong(text: str) -> types.CallToolResult:
    text = "\n".join(line if line.isprintable() else cleaned(line, LONGEST_ERROR) for line in text.split("\n"))
    text = text if len(text) <= LONGEST_ERROR else text[:LONGEST_ERROR] + " ..."
    return types.CallToolResult(content=[types.TextContent(type="text", text=text)], is_error=True)


def _client(ctx: Context) -> str:
    said = ctx.session.client_params
    return said.client_info.name if said is not None else ""


async def _progress(ctx: Context, seconds: float, text: str) -> None:
    await ctx.session.report_progress(seconds, None, text)


def _cursor(params: types.PaginatedRequestParams | None) -> int:
    said = (params.cursor if params is not None else None) or "0"
    if not (said.isascii() and said.isdigit() and len(said) < 7):
        raise MCPError(INVALID_PARAMS, f"'{cleaned(said, 40)}' is no place in the list; begin without a cursor")
    return int(said)


async def _asked(found: Awaitable[P]) -> P:
    """Return what is awaited; an error of ours becomes one of the protocol."""
    try:
        return await found
    except FormigaError as error:
        raise MCPError(INVALID_PARAMS, str(error)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise MCPError(INVALID_PARAMS, "this text cannot be read; a file has changed meanwhile") from error


def serve(where: ServerFiles, connect: Connect, wall_millis: Callable[[], int], people: Sequence[str] = ()) -> None:
    """Serve the client at stdin and stdout until it closes them.

    Args:
        where: the files to judge tasks against.
        connect: finds the running engine, if there is one.
        wall_millis: Unix time, for what is written down.
        people: for whom assistants work here, the first name is told.
    """

    async def run() -> None:
        server = Front(Desk(where, connect, JobProcesses(where), wall_millis, tuple(people))).server()
        async with stdio_server() as (reading, writing):
            await server.run(reading, writing, server.create_initialization_options())

    anyio.run(run)
