"""The disk between contacts: its forces and torques, by what acts."""
