"""The vocabulary that every other room speaks; it imports nothing above it."""
