"""All text, JSON, pages and pictures: results are turned into language here and nowhere below."""
