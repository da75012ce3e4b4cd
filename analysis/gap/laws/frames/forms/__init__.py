"""Forms of laws of the measurement: what each may follow, and the rates that are scanned."""
