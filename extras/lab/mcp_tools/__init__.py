"""A service's tools for programs that speak the Model Context Protocol: `daq mcp`."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "mcp",
            "Offer a service's tools to language models (MCP).",
            "extras.lab.mcp_tools.command",
            needs="mcp",
            group="Service",
        ),
    ),
)
