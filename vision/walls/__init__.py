"""The Host's wall and the NES' rim from their edges, no markers needed."""
