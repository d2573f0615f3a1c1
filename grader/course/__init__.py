"""Many reports become marks, pages and uploads; and exercises become rubrics."""
