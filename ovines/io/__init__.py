"""Files read and written whole: TOML, hashes, provenance, lock."""
