"""The report as one HTML page that works offline: text, lines of the source, and charts to zoom into."""
