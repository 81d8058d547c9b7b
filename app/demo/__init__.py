"""The demo: a catalogue to start with, and listeners who have tastes of their own."""
