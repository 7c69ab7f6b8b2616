"""Reasons and notes of an answer, and the sentences that are made of them."""
