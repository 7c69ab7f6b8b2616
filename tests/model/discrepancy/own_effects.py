"""Effects as files of the user's own bring them, for tests that never simulate them."""

from model import layout as at
from model.effects.effect import Effect, EffectFile, EffectParameter


def own_effect(name: str, joints: tuple[int, ...] = (), parameters: int = 1) -> Effect:
    """An effect with so many parameters."""
    own = tuple(EffectParameter(f"p{k}", at.USER + k, "1") for k in range(parameters))
    file = EffectFile(name=f"{name}.py", sha256="0123456789ab")
    return Effect(name, "τ = p0", "test", own, flag=at.HAS_USER_EFFECT, joints=joints, file=file)
