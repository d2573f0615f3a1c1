"""The report in the formats of platforms that grade or show it."""
