"""The four ways of teaching of the original: drive-through, lead by the nose, off-line steps, continuous path."""
