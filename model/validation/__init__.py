"""Validation by distortion (chapter 4): how far must parameters change to explain a model's error?"""
