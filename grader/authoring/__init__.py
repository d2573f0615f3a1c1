"""What authors of rubrics need: rubrics looked over, and skeletons of new ones."""
