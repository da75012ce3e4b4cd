"""The flights' model of the diagnosis: what it holds, which terms it may be given, and its fit."""
