"""Speed against accuracy: what every setting costs and what it is worth, and what `auto` chose."""
