"""Uploads the scores and the feedback of a graded class to Canvas or Moodle through their web interfaces."""
