"""How a run answers to its start, its numbers and its drive: variational equations beside the integrator."""
