"""By how much a formula must say more than the names in whose place it stands."""

# By so much (fall of -2 log L of runs held out) a formula must say more than names that leave nothing: the best of a
# few that are nearly the true name says 9 more by chance once in a hundred series, 16 more once in some thousands.
OUTDOES = 16.0
# A formula of fewer unknowns replaces names where it explains this share of what they do: a ring of two halves 0.995.
AS_WELL = 0.99
