"""Sealed cases for the diagnosis, made by a plant that shares no code with `ovines.core`.

The plant integrates with fixed steps and bisected contacts, resolves impacts through a 2 x 2 compliance
matrix, holds sustained contact by velocity projection, takes the disk's friction from a table of direct
area integrals and a finite contact time from a spring-dashpot. None of it is the simulator's way, so that
an agreement means something.
"""
