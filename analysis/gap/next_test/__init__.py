"""The recording that would tell an effect best from its nearest rival."""
