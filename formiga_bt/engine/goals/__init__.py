"""Goals: from a leaf's wish through the gate to an end; questions to people and clearances."""
