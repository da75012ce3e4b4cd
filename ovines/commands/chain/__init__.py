"""Commands of the chain: all stages, each stage by itself, and the pages again."""
