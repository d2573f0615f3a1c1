"""The report as one HTML page that works offline: text, source lines, and charts to zoom into."""
