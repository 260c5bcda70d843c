"""View selection: scores candidate poses (`scoring`) and chooses the next ones (`policies`, `selection`)."""
