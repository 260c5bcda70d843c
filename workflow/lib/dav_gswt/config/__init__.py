"""The config: every key with its default, unit, bounds and meaning, as pydantic models.

`model.Config` is the whole of it; `load` reads files and reports errors. workflow/reference.py makes
the JSON schema and the documentation's page of them.
"""
