"""Files and a scenario become a trace. Nothing here knows points, rubrics or reports."""
