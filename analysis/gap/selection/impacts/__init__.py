"""The impacts as the diagnosis fits them, and what each residual of the contact may go with: one regression each."""
