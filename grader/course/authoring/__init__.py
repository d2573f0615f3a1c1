"""Tools for authors of rubrics: checks of rubrics, and skeletons of new ones."""
