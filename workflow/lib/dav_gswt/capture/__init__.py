"""Capture: takes the photos that a policy requested. To add an agent, name it in `agents.AGENTS`."""
