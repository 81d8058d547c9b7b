"""The load that `encore bench` makes: listeners who ask, answer and check, on time."""
