"""Whether a stage, ours or another, keeps the contract."""
