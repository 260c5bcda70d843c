"""Capture: takes the photos that a policy requested. To add an agent, write a function in `agents`."""
