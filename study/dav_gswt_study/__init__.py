"""The study: what rules/study measures and draws. Nothing outside this package imports it."""
