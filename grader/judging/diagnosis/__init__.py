"""Names the cause of a lost point, with file and line, from the trace and the syntax tree of the student's file."""
