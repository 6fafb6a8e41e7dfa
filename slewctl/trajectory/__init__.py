"""What the arm is told to do: profiles of a rest-to-rest turn, and input shapers."""
