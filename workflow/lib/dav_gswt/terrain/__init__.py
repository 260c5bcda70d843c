"""The endless terrain: tile choice, visibility, stills, and the page that shows it in a browser."""
