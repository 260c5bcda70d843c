"""Active views: score the candidate poses, choose some, capture them, refit, and again."""
