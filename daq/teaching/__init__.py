"""The original's four ways of teaching: jogging (drive-through), hand guiding, off-line steps, continuous path."""
