"""Makes mutants and variants of a program; pure: source in, source out."""
