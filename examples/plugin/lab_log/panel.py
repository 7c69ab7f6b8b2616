"""A panel of the Live page: the module that draws it. Its route needs no caller, since it only serves a program."""

from fastapi import APIRouter, Response

MODULE = """
export default function (place, { sample }) {
  const text = place.appendChild(document.createElement('p'));
  const timer = setInterval(() => {
    const error = sample()?.error;
    text.textContent = error ? `${Math.max(...error.map(Math.abs)).toFixed(4)} rad` : 'not live';
  }, 200);
  return () => clearInterval(timer);
}
"""
router = APIRouter()


@router.get("/lab-log/panel.js", include_in_schema=False)
def panel() -> Response:
    """Returns the module."""
    return Response(MODULE, media_type="text/javascript")
