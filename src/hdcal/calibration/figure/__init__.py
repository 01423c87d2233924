"""Figures of a calibration: bands, residuals and draws."""
