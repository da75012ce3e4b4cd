"""Moving between contacts: closed forms, the stepper, sums in double-double."""
