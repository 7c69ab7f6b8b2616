"""later"""


def sharpness(rig):
    return []
