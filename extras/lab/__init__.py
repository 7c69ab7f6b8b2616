"""Extensions for a laboratory with several arms, computers or people."""
