"""The blind check: cases under seal, answers without their causes, and scores."""
