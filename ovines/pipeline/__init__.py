"""The stages declared, their functions, and how recordings and series are run."""
